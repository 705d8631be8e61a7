"""Writes the typed stub of the module: stub.pyi.in, completed from the parameter tables.

    make_stub.py OUTPUT
"""
import pathlib
import re
import sys
import textwrap

from postchain._postchain import _tables

def literal(words):
    return f"Literal[{', '.join(repr(word) for word in words)}]".replace("'", '"')


def type_of_row(row):
    if row["type"] == "choice":
        kind = literal(row["choices"])
    else:
        kind = {"boolean": "bool", "integer": "int", "number": "float", "text": "_Path",
                "point": "_Point"}[row["type"]]
    return f"Optional[{kind}]" if row["optional"] else kind


def table_class(name, rows):
    lines = [f"class {name}(TypedDict, total=False):"]
    for row in rows:
        help_text = f"{row['help']}; {row['domain']}" + (f" ({row['unit']})" if row["unit"] else "")
        lines += textwrap.wrap(help_text, 92, initial_indent="    # ", subsequent_indent="    # ")
        lines.append(f"    {row['key']}: {type_of_row(row)}")
    return "\n".join(lines)


def passes(tables):
    blocks = [f"{name} = {literal(tables[key])}" for name, key in (
        ("DepthEncoding", "depth_encodings"), ("Metric", "metrics"), ("SceneName", "scenes"),
        ("ToneMapper", "tone_mappers"))]
    blocks.append("ErrorMap = " + literal([""] + tables["maps"]))
    blocks.append("PassName = " + literal(one["name"] for one in tables["passes"]))
    classes, keys = [table_class("CameraValues", tables["camera"])], []
    for one in tables["passes"]:
        name = "".join(word.capitalize() for word in one["name"].split("_"))
        classes.append(table_class(name, one["parameters"] + tables["every_pass"]))
        keys.append(f"    {one['name']}: Optional[{name}]")
    classes.append("class PassDict(TypedDict, total=False):\n" + "\n".join(keys))
    return "\n".join(blocks) + "\n\n\n" + "\n\n\n".join(classes)


def setting(key, schema):
    kinds = [schema["type"]] if isinstance(schema["type"], str) else schema["type"]
    if "enum" in schema:
        kind = literal(word for word in schema["enum"] if word is not None)
    else:
        kind = {"boolean": "bool", "integer": "int", "number": "float", "string": "_Text"}[kinds[0]]
    default = schema.get("default")
    if default is None:
        return f"{key}: Optional[{kind}] = None"
    return f"{key}: {kind} = " + (f'"{default}"' if isinstance(default, str) else repr(default))


def settings(tables, groups):
    """A group is a table of rows of its own, or keys of the job's settings."""
    rows = {}
    for group in groups:
        found = tables[group]
        rows.update(found if isinstance(found, dict) else
                    {key: row for key, row in tables["settings"].items() if key in found})
    rows = [setting(key, row) for key, row in rows.items()]
    return textwrap.indent(",\n".join(rows), " " * 12)


def stub(tables, template):
    text = template.replace("@PASSES@", passes(tables))
    return re.sub(r"@SETTINGS ([a-z_ ]+)@",
                  lambda found: settings(tables, found[1].split()), text)


if __name__ == "__main__":
    source = pathlib.Path(__file__).with_name("stub.pyi.in").read_text(encoding="utf-8")
    pathlib.Path(sys.argv[1]).write_text(stub(_tables(), source), encoding="utf-8")
