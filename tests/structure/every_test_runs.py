"""Does each test of each GoogleTest program run in an entry of ctest?

Usage: every_test_runs.py BUILD
"""
import json
import pathlib
import subprocess
import sys


def names_of(program, words):
    """The tests that the program would run with the arguments `words`."""
    listing = subprocess.run([program, *words, "--gtest_list_tests"], check=True, capture_output=True, text=True).stdout
    names, suite = set(), ""
    for line in listing.splitlines():
        word = line.split("#")[0].strip()
        if not line.startswith(" "):
            suite = word
        elif not word.startswith("DISABLED_"):
            names.add(suite + word)
    return names


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], check=True, capture_output=True,
                             text=True).stdout
    run, programs = set(), set()
    for entry in json.loads(listing)["tests"]:
        command = entry.get("command", [])
        found = [word for word in command if word.endswith("_tests") and pathlib.Path(word).is_file()]
        if len(found) == 1:  # others are scripts that choose tests themselves
            programs.add(found[0])
            run |= names_of(found[0], [word for word in command if word.startswith("--gtest_filter=")])
    # Two programs may have the same tests, and one of them run a part (tests/guest).
    missed = sorted(f"{pathlib.Path(program).name}: {name}" for program in programs
                    for name in names_of(program, []) - run)
    for line in missed:
        print("runs in no entry of ctest:", line)
    print(f"{len(programs)} programs, {len(run)} tests")
    return 1 if missed or not run else 0


if __name__ == "__main__":
    sys.exit(main())
