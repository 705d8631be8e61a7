"""Prints the blocks of code that no test has run, from the counters of a build with --coverage.

Usage: blocks.py BUILD [FOLDER ...]   FOLDER: of the source, such as chain/gl; none: all that are instrumented

A block is a run of lines that were not executed, or one line of which a part was not: `(part)`. A header's line
counts as executed if one of the programs that include it has executed it.
"""

import collections
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
START = 0  # in place of a line: a function starts, at a place of file, line and column
FOLDERS = ["chain", "passes", "config", "tools/sequence", "tools/service"]


def lines_of(build, notes):
    """(file, line, count, whether a part was not executed) of each line and each function of an object."""
    text = subprocess.run(["gcov", "--json-format", "--stdout", notes.relative_to(build)], cwd=build, check=True,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    found = []
    for file in json.loads(text)["files"]:
        started = collections.Counter()  # the count of a line in which a lambda starts can be 0
        for function in file["functions"]:
            started[function["start_line"]] += function["execution_count"]
            place = (file["file"], function["start_line"], function["start_column"])
            found.append((place, START, function["execution_count"], False))
        for line in file["lines"]:
            number = line["line_number"]
            found.append((file["file"], number, line["count"] or started[number], line["unexecuted_block"]))
    return found


def read(build, folders):
    """For each file and line: 'run', 'part' or 'no', and whether a function starts there."""
    counts = collections.Counter()
    whole = set()  # lines that one object has executed completely
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for found in pool.map(lambda notes: lines_of(build, notes), sorted(build.rglob("*.gcno"))):
            for file, line, count, part in found:
                counts[file, line] += count
                if count and not part:
                    whole.add((file, line))
    lines = collections.defaultdict(dict)
    starts = {place[:2] for place, line in counts if line == START}
    # Lambdas may share their line with code that runs.
    idle = {place[:2] for (place, line), count in counts.items() if line == START and not count}
    for (file, line), count in counts.items():
        if line == START or not any(file.startswith(f"{SOURCE}/{folder}/") for folder in folders):
            continue
        place = (file, line)
        state = "no" if not count else "run" if place in whole and place not in idle else "part"
        lines[pathlib.Path(file).relative_to(SOURCE)][line] = (state, place in starts)
    return lines


def blocks_of(states):
    """(first line, last line, part) of each block of a file."""
    blocks = []
    before = "run"
    for line, (state, starts) in sorted(states.items()):
        if state == "no" and before == "no" and not starts:
            blocks[-1][1] = line
        elif state != "run":
            blocks.append([line, line, state == "part"])
        before = state
    return blocks


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    lines = read(build, sys.argv[2:] or FOLDERS)
    table = collections.defaultdict(collections.Counter)
    for file in sorted(lines):
        text = (SOURCE / file).read_text().splitlines()
        # The end of a scope stands for destructors on a way that is taken elsewhere.
        states = {line: state for line, state in lines[file].items() if text[line - 1].strip() != "}"}
        count = table[str(file.parent)]
        count["lines"] += len(states)
        count["not run"] += sum(state == "no" for state, _ in states.values())
        for first, last, part in blocks_of(states):
            count["parts" if part else "blocks"] += 1
            place = f"{file}:{first}" + (f"-{last}" if last > first else "")
            print(f"{place}: {'(part) ' if part else ''}{text[first - 1].strip()}")
    columns = ("lines", "not run", "blocks", "parts")
    print(f"\n| folder | {' | '.join(columns)} |\n|---|{'--:|' * len(columns)}")
    table["all"] = sum(table.values(), collections.Counter())
    for folder, count in table.items():
        print(f"| {folder} | {' | '.join(str(count[column]) for column in columns)} |")


if __name__ == "__main__":
    main()
