"""Finds faults that no test notices: puts them mechanically into a copy of the source, all at once, and asks the tests.

    survey.py build [FOLDER ...]          copies the source to build-survey/source, inserts the fault points into FOLDER
                                          (none: config, chain/base, chain/plan, tools), and builds it
    survey.py reach [--jobs N] [TEST ...] runs the tests that match (patterns of names; none: the default set) without
                                          a fault and keeps what each reaches; those that ran are not run again
    survey.py undecided [FILE ...]        lists conditions that no such test has seen true, or false, and statements
                                          that none has run, in the files that match
    survey.py sample [--count N] [--seed S] [--seconds T] [--jobs N] [FILE ...]
                                          puts N (100) random faults that a test reaches in, one at a time, runs the
                                          quickest tests that reach them, at most T seconds of tests (20; a quarter
                                          of them in one program), and lists those that live
    survey.py messages [FILE ...]         lists texts of several words in C++ code that no file of tests/ contains, not
                                          even a part of 18 characters

A fault that lives changes nothing that matters, or shows what a test should assert. Each condition's parts become
always true and always false, bounds of comparisons move, statements of one line are left out, returned truth values
are flipped, 1 becomes 0 in sums and differences, terms change sign, and a maximum is taken for a minimum
(points/insert.py). The build needs the packages of
tools/install_packages.sh --full.
"""

import argparse
import collections
import concurrent.futures
import fnmatch
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import run
from points.insert import ALWAYS_FALSE, ALWAYS_TRUE, KINDS, Inserter

HERE = run.SOURCE / "build-survey"
COPY, POINTS, REACHED = HERE / "source", HERE / "points.json", HERE / "reached"
BUILD = COPY / "build"
FOLDERS = ["config", "chain/base", "chain/plan", "tools"]
MAX_POINTS = 1 << 16  # fault_point.h
SEEN_FALSE, SEEN_TRUE = 1, 2
TIME_LIMIT_S = 1800

Point = collections.namedtuple("Point", "file line kinds text")
# The points that a test has reached, with what it saw there. `case`: of a GoogleTest program, otherwise "".
Reached = collections.namedtuple("Reached", "test case seconds points")


def build(folders):
    files = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=run.SOURCE,
                           check=True, capture_output=True, text=True).stdout.split("\0")
    points = []
    for name in files:
        if not (run.SOURCE / name).is_file():
            continue
        path = COPY / name
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(run.SOURCE / name, made := HERE / "file")
        shutil.copymode(run.SOURCE / name, made)
        # Headers of config/ and chain/ are compiled into programs in other languages and standards.
        if any(name.startswith(folder + "/") for folder in folders) and (
                name.endswith(".cpp") or name.endswith(".h") and name.startswith("tools/")) and (
                not name.startswith("tools/samples/")):
            inserter = Inserter((run.SOURCE / name).read_text(), len(points))
            made.write_text(inserter.result())
            points += [Point(name, *point) for point in inserter.points]
        if not path.exists() or path.read_bytes() != made.read_bytes():  # keeps what is compiled
            made.replace(path)
    if len(points) > MAX_POINTS:
        sys.exit(f"{len(points)} points; {MAX_POINTS} at most: name fewer folders")
    POINTS.write_text(json.dumps(points))
    shutil.rmtree(REACHED, ignore_errors=True)
    parts = [f"-DPOSTCHAIN_{part}=ON" for part in ("LAB", "SERVE", "VIEW", "PYTHON", "OPENFX")]
    subprocess.run(["cmake", "--preset", "release", "-DBUILD_TESTING=ON", "-DPOSTCHAIN_SURVEY=ON",
                    "-DCMAKE_CXX_FLAGS=-w", *parts], cwd=COPY,
                   check=True)
    subprocess.run(["ninja", "-C", BUILD, "-k", "0", "-j", str(os.cpu_count())], check=True)
    print(f"{len(points)} points, {sum(len(point.kinds) for point in points)} faults")


def run_test(test, command, environment, limit_s):
    """Whether it succeeded."""
    environment = os.environ | {"GALLIVM_PERF": "nopt", "LP_NUM_THREADS": "1"} | test.environment | environment
    process = subprocess.Popen(command, cwd=test.folder, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        return process.wait(limit_s) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        try:
            os.killpg(process.pid, signal.SIGKILL)  # and what it has started
        except ProcessLookupError:
            pass
        process.wait()


def reach(patterns, jobs):
    tests = run.tests_of_build(BUILD)
    names = [name for name, test in tests.items() if test.command and (
        any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns) if patterns else not test.full)]
    REACHED.mkdir(exist_ok=True)

    def reach_one(name):
        kept = REACHED / f"{name}.txt"
        if kept.exists():
            return
        with tempfile.TemporaryDirectory() as folder:
            reached, cases = pathlib.Path(folder, "reached"), pathlib.Path(folder, "cases")
            reached.write_bytes(bytes(MAX_POINTS))
            begin = time.monotonic()
            good = run_test(tests[name], tests[name].command, {
                "POSTCHAIN_REACHED": str(reached), "POSTCHAIN_REACHED_BY": str(cases)}, TIME_LIMIT_S)
            text = cases.read_text() if cases.exists() else " ".join(
                ["-", str(int(1000 * (time.monotonic() - begin))), str(int(not good)),
                 *(f"{point}:{what}" for point, what in enumerate(reached.read_bytes()) if what)]) + "\n"
        kept.write_text(text)
        print(name, "" if good else "fails", flush=True)

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        list(pool.map(reach_one, names))


def read_points():
    if not POINTS.exists():
        sys.exit("survey.py build comes first")
    return [Point(*point) for point in json.loads(POINTS.read_text())]


def read_reached():
    """Of tests that succeed."""
    found = []
    for path in sorted(REACHED.glob("*.txt")):
        for line in path.read_text().splitlines():
            case, milliseconds, failed, *points = line.split()
            if failed == "0":
                found.append(Reached(path.stem, "" if case == "-" else case, int(milliseconds) / 1000, {
                    int(point): int(what) for point, what in (word.split(":") for word in points)}))
    if not found:
        sys.exit("survey.py reach comes first")
    return found


def changes(kind, seen):
    """Whether a fault of the kind changes something where that was seen."""
    return bool(seen & {ALWAYS_TRUE: SEEN_FALSE, ALWAYS_FALSE: SEEN_TRUE}.get(kind, ~0))


def matches(point, patterns):
    return not patterns or any(fnmatch.fnmatchcase(point.file, pattern) for pattern in patterns)


def undecided(patterns):
    seen = collections.Counter()
    for one in read_reached():
        for point, what in one.points.items():
            seen[point] |= what
    for number, point in enumerate(read_points()):
        if not matches(point, patterns):
            continue
        if not seen[number]:
            print(f"{point.file}:{point.line} never run: {point.text}")
        elif ALWAYS_FALSE in point.kinds and seen[number] in (SEEN_FALSE, SEEN_TRUE):
            print(f"{point.file}:{point.line} never {'true' if seen[number] == SEEN_FALSE else 'false'}: {point.text}")


def messages(patterns):
    listed = subprocess.run(["git", "ls-files", "chain", "passes", "config", "tools", "tests"], cwd=run.SOURCE,
                            check=True, capture_output=True, text=True).stdout.splitlines()

    def joined(text):
        """Neighboring literals as one, and line ends as blanks."""
        return re.sub(r"\s+", " ", re.sub(r'"\s*\n\s*"', "", text))

    tests = joined("\n".join((run.SOURCE / name).read_text(errors="replace") for name in listed
                             if name.startswith("tests/")))
    for name in listed:
        if name.startswith("tests/") or not name.endswith((".cpp", ".h")):
            continue
        code = re.sub(r"//[^\n]*", "", (run.SOURCE / name).read_text())
        for found in re.finditer(r'(?:"(?:[^"\\\n]|\\.)*"\s*)+', code):
            text = joined(found[0]).strip().strip('"').replace('\\"', '"').replace("\\n", " ").strip()
            point = Point(name, code.count("\n", 0, found.start()) + 1, [], text)
            if len(text) < 14 or " " not in text or not matches(point, patterns):
                continue
            size = min(len(text), 18)
            if not any(text[at:at + size] in tests for at in range(len(text) - size + 1)):
                print(f"{name}:{point.line}: {text[:150]}")


def command_of(test, cases):
    if not cases or not cases[0].case:
        return test.command
    return [test.command[0], "--gtest_fail_fast", "--gtest_filter=" + ":".join(one.case for one in cases)]


def noticed(number, kind, reached, tests, limit_s):
    """The test that notices the fault, or None; and the tests that were too slow to ask."""
    by_test, whole = collections.defaultdict(list), collections.Counter()
    for one in reached:
        whole[one.test] += one.seconds
        if changes(kind, one.points.get(number, 0)):
            by_test[one.test].append(one)
    asked, left = 0, []

    def fails(name, cases, seconds):
        nonlocal asked
        begin = time.monotonic()
        good = run_test(tests[name], command_of(tests[name], cases), {"POSTCHAIN_FAULT": str(8 * number + kind)},
                        10 * seconds + 60)
        asked += time.monotonic() - begin
        return not good

    for name, cases in sorted(by_test.items(), key=lambda item: sum(one.seconds for one in item[1])):
        cases.sort(key=lambda one: one.seconds)
        while len(cases) > 1 and sum(one.seconds for one in cases) > limit_s / 4:
            cases.pop()
        seconds = sum(one.seconds for one in cases)
        if asked + seconds > limit_s and asked:
            left.append(name)
        elif fails(name, cases, seconds):
            return name, []
    # One case computes a static value, and others show its fault.
    for name in sorted(by_test, key=lambda name: whole[name]):
        if by_test[name][0].case and whole[name] < limit_s / 2 and fails(name, [], whole[name]):
            return name, []
    return None, left


def sample(count, seed, limit_s, jobs, patterns):
    points, reached, tests = read_points(), read_reached(), run.tests_of_build(BUILD)
    seen = collections.Counter()
    for one in reached:
        for point, what in one.points.items():
            seen[point] |= what
    faults = [(number, kind) for number, point in enumerate(points) if matches(point, patterns)
              for kind in point.kinds if changes(kind, seen[number])]
    faults = random.Random(seed).sample(faults, min(count, len(faults)))

    def ask(fault):
        number, kind = fault
        test, left = noticed(number, kind, reached, tests, limit_s)
        if not test:
            point = points[number]
            more = f" (not asked: {', '.join(left)})" if left else ""
            print(f"{point.file}:{point.line} {KINDS[kind]}: {point.text}{more}", flush=True)
        return bool(test)

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        caught = sum(pool.map(ask, faults))
    print(f"{caught} of {len(faults)} faults are noticed")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    for name, words in (("build", "folders"), ("reach", "tests"), ("undecided", "files"), ("messages", "files"),
                        ("sample", "files")):
        command = commands.add_parser(name)
        if name == "sample":
            command.add_argument("--count", type=int, default=100)
            command.add_argument("--seed", type=int, default=1)
            command.add_argument("--seconds", type=float, default=20)
        if name in ("reach", "sample"):
            command.add_argument("--jobs", type=int, default=os.cpu_count())
        command.add_argument("words", metavar=words.upper(), nargs="*")
    options = parser.parse_args()
    if options.command == "build":
        build([folder.rstrip("/") for folder in options.words] or FOLDERS)
    elif options.command == "reach":
        reach(options.words, options.jobs)
    elif options.command in ("undecided", "messages"):
        {"undecided": undecided, "messages": messages}[options.command](options.words)
    else:
        sample(options.count, options.seed, options.seconds, options.jobs, options.words)


if __name__ == "__main__":
    main()
