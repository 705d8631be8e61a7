"""Fails the command's file system calls one at a time and checks the files left.

For call n = 1, 2, ... of a job (numbered by the library of file_calls.cpp): the disk reports an error
(EIO), has no room once (ENOSPC), is full from then on, writes half, or the process is
killed. Each time:

- a call that a file needs (create, lock, write, fsync, rename, folder made or synced) ends the job
  with a documented exit code, and a message that names the file or its folder;
- calls that a file does not need (close after the sync, the hint to begin writing), and a half
  write, change nothing: exit code 0;
- every file under its final name is whole: the bits of the undisturbed job, or, where the job
  replaces files, the old one; none of these is missing, but an old sidecar is never beside a new
  image;
- no temporary is left; after a kill, none after the next job has ended;
- the next job ends with exit code 0 and the bits of the undisturbed one.

    python3 tests/robustness/failing_writes.py build/tools/apps/postchain/postchain \\
        build/tests/robustness/libpostchain_file_calls.so --work /tmp/faults [--jobs run,diff]

--one-of-each tests the first call of each kind on each kind of file in each job.
"""
import argparse
import pathlib
import re
import sys
import time

import jobs

# Calls that a file needs to be safely in place.
NEEDED = {"create", "lock", "write", "fsync", "rename", "link", "mkdir", "open_folder",
          "fsync_folder"}
WAYS = ("EIO", "ENOSPC", "full", "short", "kill")
REASON = {"EIO": "Input/output error", "ENOSPC": "disk full", "full": "disk full"}


def read_log(log):
    """(call, path, outcome) of each call."""
    lines = [line.split("\t") for line in log.read_text().splitlines()]
    return [(line[1], line[2], line[4]) for line in lines]


def kind_of(path):
    """Name of a file without frame numbers, hashes and process id."""
    return re.sub(r"[0-9a-f]{16}|\d+", "#", pathlib.Path(path).name)


def chosen(calls, one_of_each):
    """Numbers of the calls to fail."""
    if not one_of_each:
        return range(1, len(calls) + 1)
    first = {}
    for number, (call, path, _) in enumerate(calls, 1):
        first.setdefault((call, kind_of(path)), number)
    return sorted(first.values())


class Trial:
    """One job with one failing call."""

    def __init__(self, job, arguments, work, old, new):
        self.job, self.arguments, self.work = job, arguments, work
        self.old, self.new = old, new  # contents of files before, and of the undisturbed job
        self.out, self.log = work / "out", work / "log"

    def prepare(self):
        jobs.empty(self.out)
        self.log.unlink(missing_ok=True)
        for path, data in (self.old or {}).items():
            (self.out / path).write_bytes(data)

    def command(self, on_existing=None):
        return self.job.command(self.arguments.postchain, self.work / "in", self.out, on_existing)

    def faults(self, number, way):
        """Faults of the job with this failure, and of the next job, as sentences."""
        self.prepare()
        done = jobs.run(self.command(),
                        jobs.watched(self.arguments.library, self.out, self.log,
                                     f"{number}:{way}"))
        calls = read_log(self.log)
        hit = [(call, path) for call, path, outcome in calls if outcome != "ok"]
        said = self.faults_of_outcome(done, way, hit)
        said += self.faults_of_files(way, hit)
        after = jobs.run(self.command())
        if after.returncode:
            said.append(f"the job after it: exit code {after.returncode}: {after.stderr.strip()}")
        said += jobs.differences(self.out, self.new, whole=True)
        said += [f"{path}: left behind by the job after it" for path in jobs.temporaries(self.out)]
        return said

    def faults_of_outcome(self, done, way, hit):
        if way == "kill":
            # Threads may end the job before this call; then nothing was killed.
            return [] if done.returncode == (-9 if hit else 0) else [
                f"exit code {done.returncode}: {done.stderr.strip()}"]
        needed = [(call, path) for call, path in hit if call in NEEDED] if way != "short" else []
        if not needed:
            return [] if done.returncode == 0 else [
                f"exit code {done.returncode} without need: {done.stderr.strip()}"]
        said = []
        if done.returncode not in (1, 5):
            said.append(f"exit code {done.returncode}, should be 5 (or 1: some frames)")
        path = pathlib.Path(needed[0][1])
        match = jobs.TEMPORARY.fullmatch(path.name)
        name = str(path.parent / match[1]) if match else str(path)
        if name not in done.stderr:
            said.append(f"the message does not name {name}: {done.stderr.strip()}")
        if REASON[way] not in done.stderr and "No space left" not in done.stderr:
            said.append(f"the message does not say why ({way}): {done.stderr.strip()}")
        return said

    def faults_of_files(self, way, hit):
        said = []
        for path in jobs.files_of(self.out):
            name = str(path)
            if self.old and (self.out / path).read_bytes() == self.old.get(name):
                continue
            said += jobs.differences_of_file(self.out, path, self.new)
        said += [f"{path}: was there before and is gone" for path in self.old or {}
                 if not (self.out / path).is_file() and not self.may_lack(path, way, hit)]
        said += [f"{path}: is of another image" for path in self.old or {}
                 if path.endswith(".exr.json") and self.is_old(path) and
                 not self.is_old(path.removesuffix(".json"))]
        if way != "kill":
            # A temporary whose unlink fails stays.
            kept = [pathlib.Path(path).name for call, path in hit if call == "unlink"]
            said += [f"{path}: left behind" for path in jobs.temporaries(self.out)
                     if pathlib.Path(path).name not in kept]
        return said

    def is_old(self, path):
        return (self.out / path).is_file() and (self.out / path).read_bytes() == self.old[path]

    def may_lack(self, path, way, hit):
        """A sidecar: that of a new image could not be written, the job was killed between the two,
        or the old one, set aside, could not be renamed back."""
        back = self.out / f".{path}.0.tmp"
        return path.endswith(".exr.json") and (
            way == "kill" or not self.is_old(path.removesuffix(".json")) or
            ("rename", str(back)) in hit)


def try_job(job, arguments, work):
    """Tries all failures of a job; returns (trials, faults)."""
    old = None
    if job.replaces:
        first = jobs.JOBS[job.replaces]
        jobs.undisturbed(first, arguments.postchain, work / "in", work / "out")
        old = {str(path): (work / "out" / path).read_bytes()
               for path in jobs.files_of(work / "out")}
    new = jobs.undisturbed(job, arguments.postchain, work / "in", work / "new")
    trial = Trial(job, arguments, work, old, new)
    trial.prepare()
    jobs.run(trial.command(), jobs.watched(arguments.library, trial.out, trial.log))
    calls = read_log(trial.log)
    numbers = chosen(calls, arguments.one_of_each)
    trials = faults = 0
    for i, number in enumerate(numbers):
        call = calls[number - 1][0]
        ways = [way for way in WAYS if way != "short" or call == "write"]
        if arguments.one_of_each:  # each call fails in one way, each way is used; writes also short
            ways = [ways[i % len(ways)]] + (["short"] if call == "write" else [])
        for way in ways:
            trials += 1
            for sentence in trial.faults(number, way):
                faults += 1
                print(f"{job.name}, {way} at call {number} ({call}): {sentence}", flush=True)
    return len(calls), len(numbers), trials, faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    jobs.add_options(parser)
    parser.add_argument("library", type=pathlib.Path, help="built from file_calls.cpp")
    parser.add_argument("--jobs", default=",".join(jobs.JOBS), help="default: all")
    parser.add_argument("--one-of-each", action="store_true",
                        help="the first call of each kind on each kind of file, in one way")
    arguments = parser.parse_args()
    work = arguments.work.resolve()
    jobs.make_scene(arguments.postchain, work / "in", 2)
    total = 0
    for name in arguments.jobs.split(","):
        start = time.monotonic()
        calls, tried, trials, faults = try_job(jobs.JOBS[name], arguments, work)
        print(f"{name}: {tried} of {calls} calls, {trials} failures, {faults} faults, "
              f"{time.monotonic() - start:.0f} s", flush=True)
        total += faults
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
