"""postchain serve --backend slurm on a real Slurm of two nodes: requeued tasks, a restart of slurmctld,
tasks, daemons and services that are killed, a script above 64 KiB, another user's job of the same name,
another version on the node, priorities and a full queue, an experiment, and programs of Slurm that hang.
Skipped if Slurm cannot start.

    serve_slurm.py COMMAND [--work DIR]
"""
import argparse
import contextlib
import json
import os
import pathlib
import random
import shlex
import shutil
import signal
import subprocess
import sys
import time

for folder in ("service", "support"):
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / folder))
from cluster import CannotStart, Cluster, PACKAGES, check, failures, program, writers  # noqa: E402
from server import Events, Server, make_scene, serve_command, wait_until  # noqa: E402
from skips import skip  # noqa: E402

FRAMES = 16
NOBODY = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
POSTCHAIN = WORK = CLUSTER = None
TOOLS = ["sbatch", "squeue", "scontrol", "scancel", "sacct"]


def script(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(0o755)
    return str(path)


def programs_that_can_hang():
    """Slurm's programs, which hang without reading their input as long as WORK/hang exists."""
    for tool in TOOLS:
        if program(tool):
            script(WORK / "bin" / tool, f"if [ -e {WORK}/hang ]; then\n"
                   f"    ls -l /proc/self/fd > {WORK}/descriptors\n    exec sleep 1000\nfi\n"
                   f"exec {program(tool)} \"$@\"\n")
    CLUSTER.environment["PATH"] = f"{WORK}/bin:{os.environ['PATH']}"


def slow_program(seconds):
    """The command that filters later, so that every task is seen on a fast machine too."""
    return script(WORK / f"slow{seconds}", f"[ \"$1\" = --version ] || sleep {seconds}\n"
                  f"exec {shlex.quote(str(POSTCHAIN))} \"$@\"\n")


def start(name, *more, farm_program=None, attempts=2):
    command = serve_command(POSTCHAIN, WORK / "root", "--backend", "slurm", "--farm-folder",
                            str(WORK / "tasks"), "--farm-lag", "2", "--farm-frames", "4", "--attempts", str(attempts),
                            "--farm-program", str(farm_program or POSTCHAIN), *more, store=f"../{name}.sqlite")
    return Server(command, CLUSTER.environment)


@contextlib.contextmanager
def serving(name, *more, **keys):
    server = start(name, *more, **keys)
    try:
        yield server
    finally:
        began = time.monotonic()
        server.stop()
        check(time.monotonic() - began < 8, f"{name}: SIGTERM took {time.monotonic() - began:.1f} s")


def body(out, **more):
    return {"chain": "paper", "input": "in/sharp.####.exr", "camera": "in/camera.json",
            "output": f"{out}/o.####.exr", "mkdir": True, **more}


def rows(format):
    return [line.split("|") for line in CLUSTER.ask("squeue", "-h", "-r", "-o", format).splitlines()]


def first_in_slurm():
    """Name and number of the only job, as soon as there is one."""
    number, name = wait_until(lambda: rows("%F|%j"))[0]
    return name, number


def check_done(server, number, out, what):
    job = server.ended(number)
    check((job["state"], job["done"]) == ("done", FRAMES), f"{what}: {job}")
    made = {file.name: file.read_bytes() for file in (WORK / "root" / out).glob("o.*.exr")}
    expected = {file.name: file.read_bytes() for file in (WORK / "expected").glob("o.*.exr")}
    check(made == expected, f"{what}: {len(made)} of {len(expected)} frames, or other bits")
    print(f"{what}: {job['done']} frames", flush=True)


def check_one_attempt(server, number):
    frames = server.get(f"/v1/jobs/{number}/frames")["frames"]
    check(all(frame["attempts"] == 1 for frame in frames), f"job {number}: frames failed: {frames}")


def undisturbed_and_disturbed():
    with serving("run", farm_program=slow_program(2)) as server:
        number = server.submit(body("out1"))
        _, array = first_in_slurm()
        wait_until(lambda: ["RUNNING"] in rows("%T"))
        shown = CLUSTER.ask("scontrol", "show", "job", "-o", array)
        check("CPUs/Task=2" in shown and "Nice=1000 " in shown, f"CPUs and nice: {shown}")
        CLUSTER.ask("scontrol", "requeue", f"{array}_1")
        of_task = lambda: CLUSTER.ask("scontrol", "show", "job", "-o", f"{array}_1")
        wait_until(lambda: "JobState=PENDING" in of_task() and "Restarts=1" in of_task())
        # It would wait for two minutes. Within a second of its end slurmd takes it for the one that was killed.
        CLUSTER.ask("scontrol", "update", f"JobId={array}_1", "StartTime=now+2")
        check_done(server, number, "out1", "a requeued task")
        check_one_attempt(server, number)
        check(oct((WORK / "tasks").stat().st_mode)[-3:] == "700", "the folder of tasks is closed")
        wait_until(lambda: not list((WORK / "tasks").iterdir()))
        number = server.submit(body("out2"))
        wait_until(lambda: ["RUNNING"] in rows("%T"))
        CLUSTER.restart_controller()
        check_done(server, number, "out2", "slurmctld restarted")
        check_one_attempt(server, number)


def killed():
    """Tasks, daemons of nodes and the service are killed; each frame is counted once."""
    chance, out = random.Random(1), WORK / "root/killed"
    keys = {"farm_program": slow_program(1), "attempts": 4}
    server = start("killed", **keys)
    try:
        number = server.submit(body("killed"))
        kills = ["task", "service", "node1", "task", "node2", "service"]
        end = time.monotonic() + 500
        while not server.get(f"/v1/jobs/{number}")["ended"] and time.monotonic() < end:
            tasks = writers(out, lambda command: b"run" in command)
            if kills and tasks:
                kind = kills[0]
                if kind == "service":
                    server.stop(signal.SIGKILL)
                    server = start("killed", **keys)
                elif kind != "task":
                    CLUSTER.kill_node(kind)
                else:
                    try:
                        os.kill(chance.choice(tasks), signal.SIGKILL)
                    except ProcessLookupError:
                        continue
                kills.pop(0)
            time.sleep(0.3)
        check(not kills, f"kills that did not come in time: {kills}")
        check_done(server, number, "killed", "2 tasks, 2 daemons and 2 services killed")
        listener = Events(server, f"/v1/jobs/{number}/events")
        ends = [event["data"]["frame"] for _, event in listener.rest() if event["type"] == "frame"]
        check(sorted(ends) == list(range(1, FRAMES + 1)), f"ends of frames: {sorted(ends)}")
    finally:
        server.stop()


def other_version():
    other = script(WORK / "other", "echo postchain 0.0.1\n")
    with serving("version", farm_program=other) as server:
        job = server.ended(server.submit(body("out3")))
        frame = server.get(f"/v1/jobs/{job['id']}/frames/1")
        check(job["state"] == "failed" and "0.0.1, the service is postchain" in frame["message"],
              f"another version: {frame}")
    print("another version on the node is refused", flush=True)


def held():
    """Jobs that Slurm holds: their scripts, names, priorities and number."""
    layers = ",".join(f"layer{i:05}" for i in range(7000))
    with serving("held", "--slurm-option=--hold", "--farm-jobs", "2", "--max-queue", "1") as server:
        number = server.submit(body("long", aovs=layers))
        name, array = first_in_slurm()
        text = CLUSTER.ask("scontrol", "write", "batch_script", array, "-")
        check(len(text) > 65536 and layers in text, f"a script of {len(text)} bytes")
        # Another user has jobs of this name and of the next one.
        for stolen in (name, name.replace("-1-", "-2-")):
            subprocess.run([*NOBODY, program("sbatch"), "--hold", "--output=/dev/null", "--chdir=/",
                            f"--job-name={stolen}", "--wrap=true"], env=CLUSTER.environment,
                           check=True, capture_output=True)
        strangers = {row[0] for row in rows("%F|%U") if row[1] == "65534"}
        check(len(strangers) == 2, f"another user's jobs: {strangers}")
        server.submit(body("next"))
        wait_until(lambda: {row[0] for row in rows("%F|%U") if row[1] == "0"} - {array})
        status, _, _ = server.ask("PATCH", f"/v1/jobs/{number}", {"priority": 42})
        check(status == 200, "priority")
        wait_until(lambda: "Nice=580 " in CLUSTER.ask("scontrol", "show", "job", "-o", array))
        waits = server.submit(body("third"))
        time.sleep(4)  # two polls
        check(server.get(f"/v1/jobs/{waits}")["place"] == 1, "a third job waits in the service")
        status, _, answer = server.ask("POST", "/v1/jobs", body("fourth"))
        check(status == 429, f"a fourth job: {status} {answer}")
        for job in ("1", "2", "3"):
            server.ask("DELETE", f"/v1/jobs/{job}")
        wait_until(lambda: {row[0] for row in rows("%F")} == strangers)
    for job in strangers:
        CLUSTER.ask("scancel", job)
    print(f"a script of {len(text)} bytes, foreign names, priorities, a full queue", flush=True)


def experiments():
    """ab in one task; a study as an array with a report after it."""
    make_scene(POSTCHAIN, WORK / "root/poles", "1-1", "64x36", "--truth-samples", "4", scene="poles")
    scene = {"input": "poles/sharp.####.exr", "truth": "poles/both.####.exr",
             "camera": "poles/camera.json"}
    (WORK / "root/order.yaml").write_text(json.dumps(
        {"postchain_study": 1, "settings": {"repeats": 1}, "scenes": [{"name": "poles", **scene}],
         "chains": {"quick": "fast", "report": "paper", "lens": "dof_first"}}))
    with serving("experiments", "--farm-cpus", "1") as server:
        first = server.submit({"kind": "ab", "chain": "fast", "chain_b": "paper", "output": "ab",
                               "repeats": 1, "fail_above": ["flip=0"], **scene})
        study = server.submit({"kind": "study", "study": "order.yaml", "output": "study"})
        job = server.ended(first)
        check((job["state"], job["exit_code"], bool(job["verdict"])) == ("done", 8, True), f"ab: {job}")
        job = server.ended(study)
        check((job["state"], job["exit_code"]) == ("done", 0) and "report against quick" in job["verdict"],
              f"study: {job}")
        for number, total in ((first, 4), (study, 3)):
            listener = Events(server, f"/v1/jobs/{number}/events")
            told = [one["data"] for _, one in listener.rest() if one["type"] == "progress"]
            listener.close()
            check(told and told[-1]["total"] == total and told[-1]["what"], f"progress of job {number}: {told}")
            status, _, page = server.ask("GET", f"/v1/jobs/{number}/report/index.html")
            check(status == 200 and page, f"the page of job {number}: {status}")
    print("ab and study", flush=True)


def hanging():
    with serving("hang") as server:
        (WORK / "hang").touch()
        server.submit(body("out4"))
        ready = lambda: server.ask("GET", "/readyz")
        check(ready()[0] == 200, "ready at first")
        wait_until(lambda: ready()[0] == 503)
        check(b"slurm has not answered for" in ready()[2], f"the reason: {ready()[2]}")
        descriptors = (WORK / "descriptors").read_text()
        check("socket:" not in descriptors, f"inherited: {descriptors}")
        (WORK / "hang").unlink()
        wait_until(lambda: ready()[0] == 200)
        check(server.ended("1")["state"] == "done", "the job after it")
        (WORK / "hang").touch()
        server.submit(body("out5"))
        wait_until(lambda: not (WORK / "descriptors").unlink())  # a program hangs when it ends
        wait_until((WORK / "descriptors").exists)
    (WORK / "hang").unlink()
    print("programs that hang", flush=True)


def main():
    global POSTCHAIN, WORK, CLUSTER
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--only")
    arguments = parser.parse_args()
    POSTCHAIN, WORK = arguments.postchain.resolve(), arguments.work.resolve()
    shutil.rmtree(WORK, ignore_errors=True)
    (WORK / "root").mkdir(parents=True)
    make_scene(POSTCHAIN, WORK / "root/in", f"1-{FRAMES}", "64x36")
    subprocess.run([str(POSTCHAIN), "run", "paper", "-i", f"{WORK}/root/in/sharp.####.exr", "--camera",
                    f"{WORK}/root/in/camera.json", "-o", f"{WORK}/expected/o.####.exr", "--mkdir",
                    "--device", "software", "-q"], check=True)
    cases = [undisturbed_and_disturbed, killed, other_version, held, experiments, hanging]
    try:
        with Cluster(WORK / "cluster", cores=2, nodes=2) as CLUSTER:
            programs_that_can_hang()
            for case in cases:
                if arguments.only in (None, case.__name__):
                    case()
    except CannotStart as reason:
        skip(f"serve --backend slurm: {reason}", *PACKAGES)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
