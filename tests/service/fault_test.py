"""What a program that fails does to the service: a program beside it stands in for the command, and does
each fault in each kind of job. The job fails with the reason; the service goes on. Prints a table.

usage: fault_test.py POSTCHAIN"""
import collections
import os
import pathlib
import shutil
import sys
import tempfile
import threading
import time
import unittest

from server import Server, make_scene, serve_command

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
MOST_S = 0.5     # until GET /healthz is answered, whatever a job does
MOST_MIB = 64    # that the service may grow by in one job
KINDS = ["run", "ab", "bench", "study"]
# The output's name is FAULT-KIND. `begins`: the frame's first line. What leaks is not touched: the machine
# keeps its memory.
STAND_IN = """#!/bin/sh
case "$*" in --version | *--schema | *--check*) exec {program} "$@" ;; esac
begins() {{ [ "$1" != run ] || echo '{{"frame": 1, "begins": true}}'; }}
case "$*" in
*/crash-*) begins "$1"; kill -SEGV $$ ;;
*/hang-*) begins "$1"; exec sleep 1000 ;;
*/leak-*) begins "$1"; exec python3 -c '
import mmap
kept = [mmap.mmap(-1, 1 << 28, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) for part in range(1 << 12)]
print("1 TiB is taken", flush=True)' ;;
*/link-*) rm -rf {root}/link-$1; ln -s {outside} {root}/link-$1; exec {program} "$@" ;;
*/nothing-*) exit 0 ;;
*/garbage-*) head -c 1000000 /dev/urandom; exit 0 ;;
*/flood-*) yes "{{\\"note\\": \\"$(printf %01000d 0)\\"}}" | head -c 100000000; exit 0 ;;
esac
exec {program} "$@"
"""
WITHOUT_RESULT = "ended without (this frame|a report)"
FAULTS = {  # and the reason that people read
    "crash": "ended by SIGSEGV",
    "hang": "nothing was read, filtered or written for 2 s",
    "leak": "Cannot allocate memory",
    "link": "outside",
    "nothing": WITHOUT_RESULT,
    "garbage": WITHOUT_RESULT,
    "flood": WITHOUT_RESULT,
}
FXAA = {"postchain": 1, "passes": ["fxaa"]}
Row = collections.namedtuple("Row", "kind fault state grown_mib healthz_ms message")


def body_of(kind, output):
    frames = {"input": "in/sharp.####.exr", "frames": "1"}
    own = {
        "run": {"chain": FXAA, "output": f"{output}/o.####.exr", "mkdir": True, **frames},
        "ab": {"chain": FXAA, "chain_b": {"postchain": 1, "passes": []}, "output": output, "repeats": 1, **frames},
        "bench": {"chain": FXAA, "sweep": ["fxaa.preset=12,39"], "output": output, "repeats": 1, "split_frames": 0,
                  **frames},
        "study": {"output": output, "study": {
            "postchain_study": 1, "settings": {"repeats": 1}, "chains": {"x": ["fxaa"], "y": []},
            "scenes": [{"name": "one", "truth": frames["input"], **frames}]}},
    }
    return {"kind": kind, "frame_timeout": 2 if output.startswith("hang") else 300, **own[kind]}


class Pulse(threading.Thread):
    """Asks GET /healthz again and again."""

    def __init__(self, server):
        super().__init__(daemon=True)
        self.server, self.slowest_s, self.over = server, 0.0, threading.Event()

    def run(self):
        while not self.over.wait(0.05):
            start = time.monotonic()
            status = self.server.ask("GET", "/healthz")[0]
            took = time.monotonic() - start
            self.slowest_s = max(self.slowest_s, took if status == 200 else 1000)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.join()


class Faults(unittest.TestCase):
    def setUp(self):
        path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.root, self.outside, self.bin = path / "root", path / "outside", path / "bin"
        for folder in (self.root, self.outside, self.bin):
            folder.mkdir()
        make_scene(PROGRAM, self.root / "in", "1", "32x18")
        # The service looks for the command beside itself.
        shutil.copy(PROGRAM.with_name("postchain-serve"), self.bin)
        for name in ("postchain-lab", "postchain-preview"):
            (self.bin / name).symlink_to(PROGRAM.with_name(name))
        stand_in = self.bin / "postchain"
        stand_in.write_text(STAND_IN.format(program=PROGRAM, root=self.root, outside=self.outside))
        stand_in.chmod(0o755)
        command = serve_command("", self.root, "--attempts", "2", store="../jobs.sqlite")
        self.server = Server([str(self.bin / "postchain-serve"), *command[2:]])
        self.addCleanup(self.server.stop)

    def job(self, kind, fault):
        before = self.server.memory_kib()
        with Pulse(self.server) as pulse:
            job = self.server.ended(self.server.submit(body_of(kind, f"{fault}-{kind}")))
        grown = (self.server.memory_kib() - before) / 1024
        return Row(kind, fault, job["state"], grown, 1000 * pulse.slowest_s, job["message"])

    def test_each_fault_ends_its_job_alone(self):
        self.job("ab", "warm")
        rows = []
        for fault, reason in FAULTS.items():
            for kind in KINDS:
                row = self.job(kind, fault)
                rows.append(row)
                next_one = self.job("ab" if kind == "run" else "run", f"after-{fault}-{kind}")
                with self.subTest(kind=kind, fault=fault):
                    self.assertEqual(row.state, "failed")
                    self.assertRegex(row.message, reason)
                    self.assertLess(row.grown_mib, MOST_MIB)
                    self.assertLess(row.healthz_ms, 1000 * MOST_S)
                    self.assertEqual(next_one.state, "done", next_one.message)
        self.assertEqual(os.listdir(self.outside), [])
        print("kind   fault    state   MiB  healthz  message")
        for row in rows:
            print(f"{row.kind:6} {row.fault:8} {row.state:6} {row.grown_mib:5.1f} {row.healthz_ms:5.0f} ms  "
                  f"{row.message[:110]}")


if __name__ == "__main__":
    unittest.main()
