"""Checks the order of calls that create each file of each subcommand:

    create .NAME.PID.tmp, lock -> write ... -> fsync -> rename to NAME -> fsync of the folder

with the library of file_calls.cpp, which logs the calls. Nothing is written in any other way,
a frame's other files come after its output is safe, and no temporary is left.

    python3 tests/robustness/write_order.py build/tools/apps/postchain/postchain \\
        build/tests/robustness/libpostchain_file_calls.so --work /tmp/order
"""
import argparse
import pathlib
import sys

import jobs


def faults_of_file(calls, name):
    """Faults of one finished file, as sentences. calls: (call, path, second path), in their order."""
    renames = [i for i, (call, _, to) in enumerate(calls)
               if call in ("rename", "link") and to == str(name)]
    if len(renames) != 1:
        return [f"{name}: got its name {len(renames)} times by a rename"]
    rename = renames[0]
    temporary = calls[rename][1]
    said = []
    match = jobs.TEMPORARY.fullmatch(pathlib.Path(temporary).name)
    if pathlib.Path(temporary).parent != name.parent or not match or match[1] != name.name:
        said.append(f"{name}: its temporary is called {temporary}")
    own = [(i, call) for i, (call, path, _) in enumerate(calls) if path == temporary]
    first = {}
    for i, call in own:
        first.setdefault(call, i)
    last_write = max((i for i, call in own if call == "write"), default=None)
    synced = [i for i, call in own if call == "fsync"]
    if own[0][1] != "create" or own[1][1] != "lock":
        said.append(f"{name}: its temporary is not created and locked first")
    if last_write is None:
        said.append(f"{name}: was never written")
    elif not any(last_write < i < rename for i in synced):
        said.append(f"{name}: no fsync between its last write and its rename")
    if first.get("close", rename + 1) < rename:
        said.append(f"{name}: closed, and with that unlocked, before its rename")
    after = [i for i, (call, path, _) in enumerate(calls)
             if call == "fsync_folder" and i > rename and path == str(name.parent)]
    next_create = next((i for i, (call, *_) in enumerate(calls) if i > rename and call == "create"),
                       len(calls))
    if not after:
        said.append(f"{name}: its folder is not synced after the rename")
    # A job that writes in one thread has the name on disk before it begins the next file.
    elif after[0] > next_create:
        said.append(f"{name}: the next file is begun before its folder is synced")
    return said


def faults_of_job(log, out):
    """Faults of all calls of a job below the folder `out`, as sentences."""
    calls = [tuple(line.split("\t")[1:4]) for line in log.read_text().splitlines()]
    said = []
    for path in jobs.files_of(out):
        said += faults_of_file(calls, out / path)
    known = {str(out / path) for path in jobs.files_of(out)}
    for call, path, to in calls:
        if call == "create" and not jobs.TEMPORARY.fullmatch(pathlib.Path(path).name):
            said.append(f"{path}: opened for writing under its final name")
        if call in ("rename", "link") and to not in known:
            said.append(f"{to}: got a name and is not there at the end")
    said += [f"{path}: left behind" for path in jobs.temporaries(out)]
    return said


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    jobs.add_options(parser)
    parser.add_argument("library", type=pathlib.Path, help="built from file_calls.cpp")
    arguments = parser.parse_args()
    work = arguments.work.resolve()
    jobs.make_scene(arguments.postchain, work / "in", 2)
    faults = files = 0
    for job in jobs.JOBS.values():
        out, log = jobs.empty(work / "out"), work / "log"
        log.unlink(missing_ok=True)
        done = jobs.run(job.command(arguments.postchain, work / "in", out),
                        jobs.watched(arguments.library, out, log))
        said = faults_of_job(log, out)
        if done.returncode:
            said.append(f"exit code {done.returncode}: {done.stderr}")
        for sentence in said:
            print(f"{job.name}: {sentence}")
        written = len(jobs.files_of(out))
        print(f"{job.name}: {written} files, {len(log.read_text().splitlines())} calls, "
              f"{len(said)} faults")
        faults += len(said)
        files += written
    print(f"{files} files, {faults} faults")
    return 1 if faults or not files else 0


if __name__ == "__main__":
    sys.exit(main())
