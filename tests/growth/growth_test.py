#!/usr/bin/env python3
"""Checks that the work of each parser and route is in proportion to its text, by instructions.

Runs a program of cases (growth.h) under callgrind: a text of twice the size may take 2.5 times the instructions, and
no text of 1 MiB more than MOST, about a tenth of a second.
Usage: growth_test.py PROGRAM
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# A quadratic step takes four times the instructions for twice the text. The rest is for tables that grow at once.
MOST_FOR_TWICE = 2.5
FIXED = 300_000  # instructions that a case may take whatever its size
MOST = 700_000_000


def counts(program, what, names=()):
    """Instructions of each dump, by its case and the size of its text."""
    found = {}
    with tempfile.TemporaryDirectory() as work:
        files = Path(work) / "files"
        files.mkdir()
        callgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={work}/dump", "--quiet"]
        folder = [files] if Path(program).name == "reader_growth" else []
        subprocess.run([*callgrind, program, what, *folder], check=True, input="\n".join(names), text=True)
        for dump in Path(work).glob("dump.*"):
            text = dump.read_text()
            name = re.search(r"^desc: Trigger: Client Request: (.*) \| (\w+)$", text, re.M)
            total = re.search(r"^(?:summary|totals): (\d+)", text, re.M)
            if name and total:
                found.setdefault(name[1], {})[name[2]] = int(total[1])
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if not shutil.which("valgrind"):
        print("skipped: valgrind is not installed")
        sys.exit(77)
    program = sys.argv[1]
    doubled = counts(program, "doubled")
    assert len(doubled) > 40, f"only {len(doubled)} cases ran"
    faults = [f"{name}: {c['once']} instructions, {c['twice']} for twice the text" for name, c in doubled.items()
              if c["twice"] > MOST_FOR_TWICE * c["once"] + FIXED]
    # A case that grows faster would take hours with a megabyte. The others take less than the most expensive ones.
    if not faults:
        requests = [name for name in doubled if not name.startswith("report:")]  # a report has higher limits
        most = sorted(requests, key=lambda name: doubled[name]["twice"])[-12:]
        whole = counts(program, "whole", most)
        assert sorted(whole) == sorted(most), "each case runs"
        faults = [f"{name}: {c['whole']} instructions for 1 MiB" for name, c in whole.items() if c["whole"] > MOST]
    print("\n".join(faults) if faults else f"{len(doubled)} cases are in proportion to their texts")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
