"""An OpenAPI document on stdin as lines: its operations, problems that many of them have once, its schemas by member.
Descriptions of a job's members, which are those of the command's options, are left out."""
import json
import sys

document = json.load(sys.stdin)
problems = {}
for path, methods in document.pop("paths").items():
    for method, one in methods.items():
        print(f"{method.upper()} {path} {one.pop('operationId')}: {one.pop('summary')}")
        for given in one.pop("parameters", []):
            print(f"  {given.pop('in')} {given.pop('name')}", json.dumps(given))
        refusals = []
        for status, reply in one.pop("responses").items():
            if "application/problem+json" not in reply.get("content", ""):
                print(f"  {status}", json.dumps(reply))
                continue
            refusals.append(status)
            problems[f"{status} {json.dumps(reply)}"] = None
        print("  problems", *refusals)
        for key, value in one.items():
            print(f"  {key}", json.dumps(value))
print(*sorted(problems), sep="\n")


def members(name, schema):
    properties = schema.pop("properties", {})
    print(name, json.dumps(schema))
    for key, value in properties.items():
        if name.startswith("JobRequest"):
            value.pop("description", None)
        print(f"  {key}", json.dumps(value))


for name, schema in document["components"].pop("schemas").items():
    kinds = schema.pop("oneOf", [])
    members(name, schema)
    for kind in kinds:
        members(f"{name} {kind['title']}", kind)
print(json.dumps(document))
