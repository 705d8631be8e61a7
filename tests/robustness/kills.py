"""Kills the command at random times (SIGKILL), resumes the work until it is done, and counts
faults: incomplete files, files with other bits than the undisturbed job's, temporaries
that the final job has not removed.

Each piece of work is one of `run`, `ab` and `bench` over a generated sequence. It is started, killed
after a random fraction of its duration, started again with --on-existing skip (ab: overwrite),
killed again, up to five times, and then left to end. The fractions depend on --seed; the duration is learned
from which processes ended before their kill, because it varies with other load.

    python3 tests/robustness/kills.py build/tools/apps/postchain/postchain --work /tmp/kills \\
        --kills 1000

The counts are kept in WORK/counts.json: the same command again continues up to --kills. The files
of a fault are kept in WORK/find-PIECE, beside WORK/new-VERB of the undisturbed job.
"""
import argparse
import json
import random
import shutil
import signal
import subprocess
import sys
import time

import jobs

VERBS = ("run", "run", "ab", "bench")  # half of the kills are of runs
MOST_KILLS = 5                         # of one piece of work


def kill_after(command, seconds):
    """Starts the command and kills it; True when it was still running."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
    return process.returncode == -signal.SIGKILL


class Duration:
    """Estimated duration of a job, so that most kills interrupt it, at any point."""

    def __init__(self, seconds):
        self.seconds = seconds

    def moment(self, chance):
        return chance.uniform(0.02, 1) * self.seconds

    def learn(self, killed):
        self.seconds *= 1.02 if killed else 0.9


class Counts:
    """Counts over all calls of this script in one folder."""

    def __init__(self, path):
        self.path = path
        self.values = json.loads(path.read_text()) if path.exists() else {
            "pieces of work": 0, "kills": 0, "kills of run": 0, "kills of ab": 0,
            "kills of bench": 0, "kills of work taken up again": 0,
            "kills that left a temporary": 0, "half files or differing bits": 0,
            "work that could not be taken up": 0, "temporaries never removed": 0}

    def add(self, name, count=1):
        self.values[name] += count

    def save(self):
        temporary = self.path.with_suffix(".new")
        temporary.write_text(json.dumps(self.values, indent=1) + "\n")
        temporary.replace(self.path)

    def faults(self):
        return sum(self.values[name] for name in
                   ("half files or differing bits", "work that could not be taken up",
                    "temporaries never removed"))


def piece_of_work(job, command, out, expected, durations, chance, counts, most):
    """Kills a job up to `most` times, lets it end, counts; returns sentences."""
    jobs.empty(out)
    said = []
    for again in range(most):
        duration = durations[again > 0]
        killed = kill_after(command, duration.moment(chance))
        duration.learn(killed)
        if not killed:
            break
        counts.add("kills")
        counts.add("kills of " + job.name)
        if again:
            counts.add("kills of work taken up again")
        if jobs.temporaries(out):
            counts.add("kills that left a temporary")
        wrong = jobs.differences(out, expected, whole=False)
        counts.add("half files or differing bits", len(wrong))
        said += wrong
    done = jobs.run(command)
    if done.returncode:
        counts.add("work that could not be taken up")
        said.append(f"exit code {done.returncode}: {done.stderr.strip()}")
    else:
        wrong = jobs.differences(out, expected, whole=True)
        counts.add("half files or differing bits", len(wrong))
        said += wrong
        left = jobs.temporaries(out)
        counts.add("temporaries never removed", len(left))
        said += [f"{path}: never removed" for path in left]
    if said:
        shutil.copytree(out, out.parent / f"find-{counts.values['pieces of work']}",
                        dirs_exist_ok=True)
    counts.add("pieces of work")
    return said


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    jobs.add_options(parser)
    parser.add_argument("--kills", type=int, default=1000, help="total number of kills, including earlier calls")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--again", action="store_true", help="forget the counts of earlier calls")
    parser.add_argument("--frames", type=int, default=4, help="number of frames")
    arguments = parser.parse_args()
    work = arguments.work.resolve()
    scene, out = work / "in", work / "out"
    jobs.make_scene(arguments.postchain, scene, arguments.frames)
    expected, durations = {}, {}
    for verb in dict.fromkeys(VERBS):
        expected[verb], seconds = jobs.undisturbed(jobs.JOBS[verb], arguments.postchain, scene,
                                                   work / f"new-{verb}")
        durations[verb] = [Duration(seconds), Duration(seconds)]  # of a fresh start, of a resumed one
    if arguments.again:
        (work / "counts.json").unlink(missing_ok=True)
    counts = Counts(work / "counts.json")
    start = time.monotonic()
    while counts.values["kills"] < arguments.kills:
        piece = counts.values["pieces of work"]
        chance = random.Random(f"{arguments.seed} {piece}")
        job = jobs.JOBS[VERBS[piece % len(VERBS)]]
        most = min(MOST_KILLS, arguments.kills - counts.values["kills"])
        command = job.command(arguments.postchain, scene, out)
        for sentence in piece_of_work(job, command, out, expected[job.name], durations[job.name],
                                      chance, counts, most):
            print(f"{job.name}: {sentence}", flush=True)
        counts.save()
    for name, count in counts.values.items():
        print(f"{name}: {count}")
    print(f"{time.monotonic() - start:.0f} s")
    return 1 if counts.faults() else 0


if __name__ == "__main__":
    sys.exit(main())
