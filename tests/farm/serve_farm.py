"""postchain serve --backend slurm on a real Slurm of two nodes, while tasks, a node's daemon and the
service are killed: the outputs have the bits of one run, each frame is counted once, and a canceled
job leaves no task behind. Skipped if Slurm cannot start.

    serve_farm.py COMMAND [--work DIR]
"""
import argparse
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
from cluster import CannotStart, Cluster, PACKAGES, check, failures, writers  # noqa: E402
from server import Events, Server, make_scene, serve_command  # noqa: E402
from skips import skip  # noqa: E402

FRAMES = 16
SECONDS = 500


def workers(out):
    """Tasks of Slurm."""
    return writers(out, lambda command: b"run" in command)


def slow_program(postchain, work):
    """The command after a second, so that every task is seen on a fast machine too."""
    program = work / "slow_postchain"
    program.write_text(f"#!/bin/sh\nsleep 1\nexec {shlex.quote(str(postchain))} \"$@\"\n")
    program.chmod(0o755)
    return program


class Service:
    def __init__(self, postchain, work, environment):
        self.command = serve_command(postchain, work / "root", "--backend", "slurm", "--farm-folder",
                                     str(work / "tasks"), "--farm-frames", "4", "--farm-cpus", "1",
                                     "--farm-lag", "2",
                                     "--farm-program", str(slow_program(postchain, work)),
                                     "--attempts", "4")
        self.environment = environment
        self.server = Server(self.command, environment)

    def kill(self):
        self.server.stop(signal.SIGKILL)
        self.server = Server(self.command, self.environment)


def body(out, **more):
    return {"chain": {"postchain": 1, "passes": ["motion_blur", "fxaa"]},
            "set": ["motion_blur.samples=9"], "input": "in/sharp.####.exr",
            "camera": "in/camera.json", "output": f"{out}/o.####.exr", "mkdir": True, **more}


def disturbed(service, cluster, work, expected):
    chance = random.Random(1)
    number = service.server.submit(body("out"))
    out = work / "root/out"
    kills = ["task", "service", "node1", "task", "node2", "service"]
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        running = workers(out)
        if kills and running:
            kind = kills.pop(0)
            if kind == "task":
                try:
                    os.kill(chance.choice(running), signal.SIGKILL)
                except ProcessLookupError:
                    kills.insert(0, kind)
            elif kind == "service":
                service.kill()
            else:
                cluster.kill_node(kind)
        job = service.server.get(f"/v1/jobs/{number}")
        if job["ended"]:
            break
        time.sleep(0.3)
    check((job["state"], job["done"]) == ("done", FRAMES), f"the job: {job}")
    check(not kills, f"kills that did not come in time: {kills}")
    made = {file.name: file.read_bytes() for file in out.glob("o.*.exr")}
    check(made == expected, f"{len(made)} of {len(expected)} frames, or other bits")
    listener = Events(service.server, f"/v1/jobs/{number}/events")
    ends = [event["data"]["frame"] for _, event in listener.rest() if event["type"] == "frame"]
    check(sorted(ends) == list(range(1, FRAMES + 1)), f"ends of frames: {sorted(ends)}")
    print(f"serve on two nodes: {len(made)} frames, 2 tasks, 2 daemons and 2 services killed")


def canceled(service, cluster):
    number = service.server.submit(body("later"))
    end = time.monotonic() + 120
    while time.monotonic() < end and "postchain-" not in cluster.ask("squeue", "-h", "-o", "%j"):
        time.sleep(0.2)
    check(service.server.ask("DELETE", f"/v1/jobs/{number}")[0] == 200, "cancel")
    while time.monotonic() < end and cluster.ask("squeue", "-h"):
        time.sleep(0.2)
    check(not cluster.ask("squeue", "-h"), "tasks of the canceled job are left")
    print("a canceled job leaves no task")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("postchain", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    postchain = arguments.postchain.resolve()
    work = arguments.work.resolve()
    shutil.rmtree(work, ignore_errors=True)
    (work / "root").mkdir(parents=True)
    make_scene(postchain, work / "root/in", f"1-{FRAMES}", "160x90")
    (work / "chain.yaml").write_text(
        "postchain: 1\npasses: [{motion_blur: {samples: 9}}, fxaa]\n")
    subprocess.run([str(postchain), "run", str(work / "chain.yaml"), "-i",
                    f"{work}/root/in/sharp.####.exr", "--camera", f"{work}/root/in/camera.json", "-o",
                    f"{work}/expected/o.####.exr", "--mkdir", "--device", "software", "-q"], check=True)
    expected = {file.name: file.read_bytes() for file in (work / "expected").glob("o.*.exr")}
    try:
        with Cluster(work / "cluster", cores=1, nodes=2) as cluster:
            service = Service(postchain, work, cluster.environment)
            try:
                disturbed(service, cluster, work, expected)
                canceled(service, cluster)
            finally:
                service.server.stop()
    except CannotStart as reason:
        skip(f"serve --backend slurm: {reason}", *PACKAGES)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
