"""Puts one fault at a time into the code, runs the tests that should fail, and prints a table.

Usage: run.py [--build FOLDER] [NAME ...]   NAME: a pattern of names, such as 'clock*'
       run.py [--build FOLDER] --check [NAME ...]   only whether every line and every test exists

Each tests/mutants/*.toml is a list of

    ["chain/gl/compiled_plan.cpp"."no barrier between steps"]
    line = "if (command.barriers) glMemoryBarrier(command.barriers);"  # stands once in the file
    with = ""
    tests = ["executor_tests:Barriers.*"]

`line` is any part of the file's text, `with` replaces it. A test is a name of ctest, after `:` a GoogleTest
filter that selects a part of it. A mutant is caught by the default if a test of the default set fails.
The tests run without a fault first. The file is restored also if the run is interrupted. Exit code 1: a test
fails without a fault, or a mutant survives its tests, does not compile, or its line does not stand once in its
file.
"""

import argparse
import collections
import fnmatch
import json
import os
import pathlib
import signal
import subprocess
import sys
import tomllib

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TIME_LIMIT_S = 600
# A test with one of these labels is not in the default set (tests/CMakeLists.txt).
NOT_DEFAULT = {"full", "serve", "view", "blender", "python", "openfx"}

Test = collections.namedtuple("Test", "command environment folder full")
Mutant = collections.namedtuple("Mutant", "file name line replacement tests")


def mutants_of(patterns):
    """Those of all lists whose names match; no pattern: all."""
    mutants = []
    for path in sorted(pathlib.Path(__file__).parent.glob("*.toml")):
        for file, faults in tomllib.loads(path.read_text()).items():
            mutants += [Mutant(file, name, fault["line"], fault["with"], fault["tests"])
                        for name, fault in faults.items()
                        if not patterns or any(fnmatch.fnmatch(name, pattern) for pattern in patterns)]
    return mutants


def tests_of_build(build):
    """All tests of ctest by name. One whose program is not built has no command."""
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], check=True,
                             capture_output=True, text=True).stdout
    tests = {}
    for entry in json.loads(listing)["tests"]:
        properties = {p["name"]: p["value"] for p in entry.get("properties", [])}
        environment = dict(word.split("=", 1) for word in properties.get("ENVIRONMENT", []))
        tests[entry["name"]] = Test(entry.get("command", []), environment, properties.get("WORKING_DIRECTORY", build),
                                    not NOT_DEFAULT.isdisjoint(properties.get("LABELS", [])))
    return tests


def names_of(command, environment=None):
    """The tests of a GoogleTest program that `command` runs."""
    listing = subprocess.run([*command, "--gtest_list_tests"], check=True, capture_output=True, text=True,
                             env=environment).stdout
    suite, names = "", []
    for line in listing.splitlines():
        word = line.split("#")[0].strip()
        if not line.startswith(" ") and word.endswith("."):
            suite = word
        elif line.startswith("  "):
            names.append(suite + word)
    return names


def fails(tests, wanted):
    """Whether a test of the list fails."""
    name, _, pattern = wanted.partition(":")
    test = tests[name]
    environment = os.environ | {"GALLIVM_PERF": "nopt", "LP_NUM_THREADS": "1"} | test.environment
    command = test.command
    if pattern:
        chosen = [name for name in names_of(command, environment)
                  if any(fnmatch.fnmatchcase(name, part) for part in pattern.split(":"))]
        if not chosen:
            raise SystemExit(f"{wanted}: no test of {name} has such a name")
        command = [*command, "--gtest_filter=" + ":".join(chosen)]
    try:
        return subprocess.run(command, cwd=test.folder, env=environment, stdin=subprocess.DEVNULL,
                              capture_output=True, timeout=TIME_LIMIT_S).returncode != 0
    except subprocess.TimeoutExpired:
        return True


def compile_tests(tests, build, wanted):
    """Builds the programs that the tests run. Whether that succeeded."""
    files = set()
    for name in {word.partition(":")[0] for word in wanted}:
        for word in tests[name].command + list(tests[name].environment.values()):
            path = pathlib.Path(word.rpartition("=")[2])  # PYTHONPATH=FOLDER too
            if path.is_absolute() and path.is_relative_to(build) and path.suffix != ".zip":
                files.add(str(path.relative_to(build)))
                if path.name == "postchain":  # the programs that it starts
                    files |= {str(path.relative_to(build)) + part for part in ("-lab", "-serve")}
    known = subprocess.run(["ninja", "-C", build, "-t", "targets", "all"], check=True, capture_output=True,
                           text=True).stdout
    known = {line.partition(":")[0] for line in known.splitlines()}
    targets = sorted(one for one in known if any(one == file or one.startswith(f"{file}/") for file in files))
    return subprocess.run(["ninja", "-C", build, *targets], capture_output=True).returncode == 0


def run(mutant, tests, build):
    """The row of the table: verdict, and the tests that failed."""
    path = SOURCE / mutant.file
    before = path.read_text()
    if before.count(mutant.line) != 1:
        return "line not found once", []
    try:
        path.write_text(before.replace(mutant.line, mutant.replacement))
        if not compile_tests(tests, build, mutant.tests):
            return "does not compile", []
        failed = [word for word in mutant.tests if fails(tests, word)]
    finally:
        path.write_text(before)
    if not failed:
        return "survives", []
    by_default = any(not tests[word.partition(":")[0]].full for word in failed)
    return "default" if by_default else "full", failed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default=SOURCE / "build", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="put no fault in; check the lists alone")
    parser.add_argument("names", nargs="*", help="patterns of names; none: all mutants")
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # restores the file
    build = arguments.build.resolve()

    mutants = mutants_of(arguments.names)
    tests = tests_of_build(build)
    wanted = sorted({word for mutant in mutants for word in mutant.tests})
    unknown = [word for word in wanted if word.partition(":")[0] not in tests]
    if unknown:
        sys.exit("no such test: " + ", ".join(unknown))
    if arguments.check:
        moved = [f"{mutant.file}: {mutant.name}" for mutant in mutants
                 if (SOURCE / mutant.file).read_text().count(mutant.line) != 1]
        if moved:
            sys.exit("the line does not stand once:\n" + "\n".join(moved))
        return 0
    missing = [word for word in wanted if not tests[word.partition(":")[0]].command]
    if missing:
        sys.exit(f"not built: {', '.join(missing)}; run cmake --build --preset release")
    if not compile_tests(tests, build, wanted):
        sys.exit("the tests do not compile; run cmake --build --preset release")
    broken = [word for word in wanted if fails(tests, word)]
    if broken:
        sys.exit("these fail without a fault: " + ", ".join(broken))

    counts = collections.Counter()
    print("| fault | file | caught by | tests that fail |\n|---|---|---|---|")
    for mutant in mutants:
        verdict, failed = run(mutant, tests, build)
        counts[verdict if verdict in ("default", "full") else "not caught"] += 1
        print(f"| {mutant.name} | {mutant.file} | {verdict} | {', '.join(failed)} |", flush=True)
    compile_tests(tests, build, wanted)
    caught = counts["default"] + counts["full"]
    print(f"\n{len(mutants)} mutants: {counts['default']} caught by the default, {caught} by --full, "
          f"{counts['not caught']} not caught")
    return 1 if caught < len(mutants) else 0


if __name__ == "__main__":
    sys.exit(main())
