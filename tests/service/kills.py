"""Kills `postchain serve` while it works on one job of small frames, and starts it again until the job is
done. All that it wrote is compared with an undisturbed run of the command: every frame there once, whole, of
the same bits; no temporary left.

    python3 tests/service/kills.py build/tools/apps/postchain/postchain --work /tmp/kills \\
        --frames 200 --kills 40
    python3 tests/service/kills.py build/tools/apps/postchain/postchain --work /tmp/poison \\
        --frames 20 --poison build/tests/service/libpostchain_poison.so

--kills: at random moments (SIGKILL). Then the store has one job, every frame written, none quarantined, each
with one event of its end, and no attempt counted.
--poison: frames 3 and 13 kill the process that opens them. They are quarantined after three attempts each, all the
others are done, and the service lives.
"""
import argparse
import collections
import json
import os
import pathlib
import random
import sqlite3
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "robustness"))
import jobs  # noqa: E402  (of tests/robustness)
from server import serve_command, work_on  # noqa: E402

KEY = "one-job"
POISON = [3, 13]  # sharp.0003.exr and sharp.0013.exr end alike


def faults_of_store(path, frames):
    """Messages about faults of the job in the store."""
    store = sqlite3.connect(path)
    said = []
    found = store.execute("SELECT state, done, failed FROM jobs").fetchall()
    if found != [("done", frames, 0)]:
        said.append(f"jobs (state, done, failed): {found}")
    states = collections.Counter(row[0] for row in store.execute("SELECT state FROM frames"))
    if states != {"written": frames}:
        said.append(f"states of the frames: {dict(states)}")
    ends = collections.Counter(json.loads(row[0])["frame"] for row in store.execute(
        "SELECT data FROM events WHERE type = 'frame'"))
    said += [f"frame {frame} ended {count} times" for frame, count in ends.items() if count != 1]
    said += [f"frame {frame} never ended" for frame in range(1, frames + 1) if frame not in ends]
    said += [f"frame {frame} has no sidecar" for frame, output in store.execute(
        "SELECT frame, output FROM frames") if not pathlib.Path(output + ".json").exists()]
    if store.execute("PRAGMA integrity_check").fetchone() != ("ok",):
        said.append("the store is damaged")
    return said


def prepare(postchain, work, frames):
    """Makes the frames. The request for a job over them, the service's command, and the outputs and seconds
    of an undisturbed run of the command."""
    work = jobs.empty(work.resolve())
    jobs.empty(work / "out")
    jobs.make_scene(postchain, work / "in", frames)
    job = jobs.Job("run", "run fast -i {IN}/sharp.####.exr --camera {IN}/camera.json "
                   "-o {OUT}/o.####.exr", "skip")
    start = time.monotonic()
    expected = jobs.undisturbed(job, postchain, work / "in", work / "undisturbed")
    seconds = time.monotonic() - start
    body = {"chain": "fast", "input": "in/sharp.####.exr", "camera": "in/camera.json",
            "output": "out/o.####.exr"}
    return work, body, serve_command(postchain, work), expected, seconds


def faults_of_outputs(work, expected):
    return jobs.differences(work / "out", expected, whole=True) + [
        f"{path}: never removed" for path in jobs.temporaries(work / "out")]


def killed(work, body, command, expected, seconds, arguments):
    """Faults after kills at random moments."""
    out = work / "out"
    chance = random.Random(1)
    # Each process should finish about one part of the job, whatever the speed of the machine.
    span = 0.15 + 2.5 * seconds / arguments.kills
    part = max(1, arguments.frames // arguments.kills)
    kills = left_temporary = 0
    for _ in range(arguments.kills):
        before = len(list(out.glob("*.exr")))
        if work_on(command, body, KEY, chance.uniform(0.02, 1) * span):
            break
        kills += 1
        span *= 0.95 if len(list(out.glob("*.exr"))) - before > part else 1.05
        left_temporary += bool(jobs.temporaries(out))
        if wrong := jobs.differences(out, expected, whole=False):
            return wrong
    print(f"{kills} kills, {left_temporary} of them left a temporary, {arguments.frames} frames")
    job = work_on(command, body, KEY)
    said = [] if job["state"] == "done" else [f"the job is {job['state']}: {job['message']}"]
    return said + faults_of_outputs(work, expected) + faults_of_store(work / "jobs.sqlite", arguments.frames)


def poisoned(work, body, command, expected, arguments):
    """Faults after frames that kill the process of their job."""
    for frame in POISON:
        for name in (f"o.{frame:04}.exr", f"o.{frame:04}.exr.json"):
            del expected[name]
    environment = {**os.environ, "LD_PRELOAD": str(arguments.poison.resolve()), "POSTCHAIN_POISON": "3.exr"}
    ended = work_on(command, body, KEY, env=environment)
    said = []
    if ended["state"] != "failed" or "quarantined: 3, 13" not in ended["message"]:
        said.append(f"the job: {ended['state']}, {ended['message']}")
    if ended["done"] != arguments.frames - len(POISON):
        said.append(f"{ended['done']} frames done")
    return said + faults_of_outputs(work, expected)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--poison", type=pathlib.Path, help="poison_calls.cpp as a library")
    arguments = parser.parse_args()
    start = time.monotonic()
    *prepared, seconds = prepare(arguments.postchain, arguments.work, arguments.frames)
    said = poisoned(*prepared, arguments) if arguments.poison else killed(*prepared, seconds, arguments)
    print("\n".join(said))
    print(f"{len(said)} faults, {time.monotonic() - start:.0f} s")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
