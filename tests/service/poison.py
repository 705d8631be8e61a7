"""Two frames of a job kill the process that opens them. The service is started again whenever it has
died: it must quarantine these two after three attempts each, alone, and do all the others, whose bits
are those of the command.

    python3 tests/service/poison.py build/tools/apps/postchain/postchain \\
        build/tests/service/libpostchain_poison.so --work /tmp/poison
"""
import argparse
import os
import pathlib
import sqlite3
import sys

from kills import faults_of_outputs, prepare
from server import work_on

FRAMES = 20
POISON = [3, 13]  # sharp.0003.exr and sharp.0013.exr end alike
ATTEMPTS = 3  # of `serve` as it is


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("library", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    work, body, command, expected, _ = prepare(arguments.postchain, arguments.work, FRAMES)
    for frame in POISON:
        for name in (f"o.{frame:04}.exr", f"o.{frame:04}.exr.json"):
            del expected[name]
    poisoned = {**os.environ, "LD_PRELOAD": str(arguments.library.resolve()),
                "POSTCHAIN_POISON": "3.exr"}
    said, deaths = [], 0
    while not (ended := work_on(command, body, "key", env=poisoned)):
        deaths += 1
        if deaths > 4 * ATTEMPTS:
            raise SystemExit("it dies again and again")
    if ended["state"] != "failed" or "quarantined: 3, 13" not in ended["message"]:
        said.append(f"the job: {ended['state']}, {ended['message']}")
    # First together with others, then each alone.
    if not len(POISON) * ATTEMPTS <= deaths <= len(POISON) * (ATTEMPTS + 1):
        said.append(f"the process died {deaths} times")
    said += faults_of_outputs(work, expected)
    store = sqlite3.connect(work / "jobs.sqlite")
    quarantined = [row[0] for row in store.execute(
        "SELECT frame FROM frames WHERE state = 'quarantined' ORDER BY frame")]
    if quarantined != POISON:
        said.append(f"quarantined: {quarantined}")
    if ended["done"] != FRAMES - len(POISON):
        said.append(f"{ended['done']} frames done")
    print("\n".join(said))
    print(f"{deaths} deaths, {len(said)} faults")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
