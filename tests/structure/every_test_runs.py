"""Does each test of each GoogleTest program run in an entry of ctest?

Usage: every_test_runs.py BUILD
"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "mutants"))
import run  # noqa: E402


def main():
    ran, programs = set(), set()
    for test in run.tests_of_build(pathlib.Path(sys.argv[1]).resolve()).values():
        found = [word for word in test.command
                 if word.endswith(("_tests", "_tests_more")) and pathlib.Path(word).is_file()]
        if len(found) == 1:  # others are scripts that choose tests themselves
            programs.add(found[0])
            filters = [word for word in test.command if word.startswith("--gtest_filter=")]
            ran.update(run.names_of([found[0], *filters]))
    # Two programs may have the same tests, and one of them run a part (tests/guest).
    missed = sorted(f"{pathlib.Path(program).name}: {name}" for program in programs
                    for name in run.names_of([program]) if name not in ran)
    for line in missed:
        print("runs in no entry of ctest:", line)
    print(f"{len(programs)} programs, {len(ran)} tests")
    return 1 if missed or not ran else 0


if __name__ == "__main__":
    sys.exit(main())
