"""A sequence split over a farm has the pixels of a single run, whatever is killed.

    farm.py COMMAND FARM [--work DIR] [--only slurm|openjd|opencue]

FARM: tools/farm. Frames of a generated scene are filtered once in one process, then
  slurm    by tools/farm/postchain.sbatch on a single-node Slurm (cluster.py), as more tasks than
           frames; and as 4 tasks while processes are killed, tasks requeued and the node's daemon
           killed. Skipped, with a message, if no node can start
  openjd   the command lines of tools/farm/postchain.openjd.json, and the lines they print
  opencue  the command line of docs/farm.md
Each output must equal the first run's bit by bit. Exits with 1 if one differs.
"""
import argparse
import hashlib
import json
import os
import pathlib
import random
import re
import shlex
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from cluster import CannotStart, Cluster, PACKAGES, check, failures, writers  # noqa: E402
from skips import skipped  # noqa: E402

FRAMES = 40
FARM = POSTCHAIN = WORK = None


def words(out):
    return ["balanced", "-i", f"{WORK}/scene/sharp.####.exr", "--camera",
            f"{WORK}/scene/camera.json", "-o", f"{out}/o.####.exr"]


def folder(name):
    path = WORK / name
    path.mkdir(parents=True)
    return path


def pictures(path):
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest()
            for file in sorted(path.glob("o.*.exr"))}


def compare(what, path, expected):
    found = pictures(path)
    check(found.keys() == expected.keys(),
          f"{what}: {len(found)} frames of {len(expected)}")
    differing = [name for name in found if found[name] != expected.get(name)]
    check(not differing, f"{what}: bits differ in {', '.join(differing[:5])}")
    left = [file.name for file in path.glob(".*")]
    check(not left, f"{what}: temporary files left: {', '.join(left[:5])}")
    print(f"{what}: {len(found)} frames, {len(differing)} with other bits")


def kill_one(out, chance):
    running = writers(out, lambda command: command[0].endswith(b"postchain"))
    try:
        os.kill(chance.choice(running), signal.SIGKILL)
    except (IndexError, ProcessLookupError):
        return False
    return True


ENDED = {"COMPLETED", "FAILED", "CANCELLED", "NODE_FAIL", "TIMEOUT", "BOOT_FAIL"}


def slurm_round(cluster, name, tasks, expected, kills=0):
    """After the last of the kills the node's daemon is killed too."""
    out = folder(name)
    chance = random.Random(tasks)
    start = time.monotonic()
    job = cluster.submit(FARM / "postchain.sbatch", tasks, [str(tasks), *words(out)],
                         f"{WORK}/{name}.%a.log")
    killed = requeued = 0
    while time.monotonic() < start + 600:
        states = cluster.states(job)
        # Work continues until there is output to lose.
        if killed < kills and list(out.glob("o.*.exr")) and kill_one(out, chance):
            killed += 1
            if killed == kills:
                cluster.kill_node("node1")
        lost = [task for task, state in states.items() if state in ENDED - {"COMPLETED"}]
        for task in lost:
            cluster.requeue(job, task)
            requeued += 1
        if len(states) == tasks and all(state == "COMPLETED" for state in states.values()):
            break
        time.sleep(0.2)
    else:
        check(False, f"{name}: not done after ten minutes: {states}")
    check(killed == kills, f"{name}: {killed} of {kills} kills came in time")
    check(requeued >= killed, f"{name}: {requeued} tasks requeued after {killed} kills")
    print(f"{name}: {tasks} tasks, {killed} killed, {requeued} requeued, {time.monotonic() - start:.0f} s")
    compare(name, out, expected)


def run_slurm(expected):
    with Cluster(WORK / "cluster", cores=2) as cluster:
        cluster.environment["POSTCHAIN"] = str(POSTCHAIN)
        slurm_round(cluster, "undisturbed", FRAMES + 3, expected)
        slurm_round(cluster, "killed", 4, expected, kills=3)


def filled(text, values):
    return re.sub(r"\{\{\s*([\w.]+)\s*\}\}", lambda name: values[name.group(1)], text)


def run_openjd(expected):
    template = json.loads((FARM / "postchain.openjd.json").read_text())
    out = folder("openjd")
    given = {"Frames": f"1-{FRAMES}", "InputFolder": f"{WORK}/scene", "InputName": "sharp.####.exr",
             "Camera": f"{WORK}/scene/camera.json", "OutputFolder": str(out),
             "OutputName": "o.####.exr", "FramesPerTask": "12"}
    values = {f"Param.{parameter['name']}":
              given.get(parameter["name"], str(parameter.get("default", "")))
              for parameter in template["parameterDefinitions"]}
    step, = template["steps"]
    frame, = step["parameterSpace"]["taskParameterDefinitions"]
    first, last = map(int, filled(frame["range"], values).split("-"))
    count = int(filled(frame["chunks"]["defaultTaskCount"], values))
    run = step["script"]["actions"]["onRun"]
    for start in range(first, last + 1, count):
        values["Task.Param.Frame"] = f"{start}-{min(start + count - 1, last)}"
        command = [filled(word, values) for word in [run["command"], *run["args"]]]
        check(command[0] == "postchain", "openjd: the command is postchain")
        result = subprocess.run([POSTCHAIN, *command[1:]], capture_output=True, text=True)
        check(result.returncode == 0, f"openjd: {result.stderr}")
        lines = result.stdout.splitlines()
        progress = [float(line.split(": ")[1]) for line in lines
                    if line.startswith("openjd_progress: ")]
        check(progress == sorted(progress) and progress and progress[-1] == 100,
              f"openjd: progress {progress}")
        check(sum(line.startswith("openjd_status: ") for line in lines) == len(progress),
              "openjd: a status with each progress")
        check(len(lines) == 2 * len(progress), f"openjd: other lines on stdout: {lines}")
    compare("openjd", out, expected)
    # An error prints its reason on a line of its own.
    values["Task.Param.Frame"] = f"{last + 1}-{last + 2}"
    for more in [[], ["--no-such-option"]]:
        command = [filled(word, values) for word in run["args"]]
        result = subprocess.run([POSTCHAIN, *command, *more], capture_output=True, text=True)
        check(result.returncode != 0 and result.stdout.startswith("openjd_fail: "),
              f"openjd: the failure is reported: {result.stdout}")


def run_opencue(expected):
    """The command of docs/farm.md, with its tokens replaced as OpenCue does for layers of chunks."""
    text = (FARM.parent.parent / "docs" / "farm.md").read_text()
    command = re.search(r"^postchain run (?:\\\n|.)*?#FRAME_START#.*$", text, re.MULTILINE).group(0)
    out = folder("opencue")
    chunk = 15
    for start in range(1, FRAMES + 1, chunk):
        line = command.replace("\\\n", " ").replace("#FRAME_START#", str(start))
        line = line.replace("#FRAME_END#", str(min(start + chunk - 1, FRAMES)))
        line = line.replace("'shot.####.exr'", f"{WORK}/scene/sharp.####.exr")
        line = line.replace("camera.json", f"{WORK}/scene/camera.json")
        line = line.replace("'out/shot.####.exr'", f"{out}/o.####.exr")
        result = subprocess.run([POSTCHAIN, *shlex.split(line)[1:]], capture_output=True, text=True)
        check(result.returncode == 0, f"opencue: {result.stderr}")
    compare("opencue", out, expected)


def main():
    global FARM, POSTCHAIN, WORK
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("command", type=pathlib.Path)
    parser.add_argument("farm", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, default="out/farm")
    parser.add_argument("--only", choices=["slurm", "openjd", "opencue"])
    options = parser.parse_args()
    POSTCHAIN, FARM, WORK = options.command.resolve(), options.farm.resolve(), options.work.resolve()
    subprocess.run(["rm", "-rf", WORK], check=True)
    WORK.mkdir(parents=True)
    subprocess.run([POSTCHAIN, "scene", "wheels", "-o", WORK / "scene", "--size", "64x36",
                    "--frames", f"1-{FRAMES}", "-q"], check=True)
    whole = folder("whole")
    subprocess.run([POSTCHAIN, "run", *words(whole), "-q"], check=True)
    expected = pictures(whole)
    assert len(expected) == FRAMES
    for name, run in (("slurm", run_slurm), ("openjd", run_openjd), ("opencue", run_opencue)):
        if options.only in (None, name):
            try:
                run(expected)
            except CannotStart as why:
                skipped(f"a sequence over Slurm: {why}", *PACKAGES)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
