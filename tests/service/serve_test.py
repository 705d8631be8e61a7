"""postchain serve as a process: exit codes, tokens, addresses, signals, READY.

usage: serve_test.py POSTCHAIN [LIBRARY]: poison_calls.cpp as a library"""
import io
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

from server import Events, Server, work_on

PROGRAM = LIBRARY = None
SOURCE = pathlib.Path(__file__).parents[2]
JOB = {"chain": "fast", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
       "output": "out/a.####.exr", "mkdir": True}


class Serve(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def command(self, *more):
        return [PROGRAM, "serve", "--root", str(self.path), "--store", str(self.path / "jobs.sqlite"),
                "--port", "0", "--device", "software", *more]

    def fails(self, code, text, *more, command=None):
        done = subprocess.run(command or self.command(*more), capture_output=True, text=True,
                              timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(text, done.stderr)

    def write(self, name, text):
        (self.path / name).write_text(text)
        return str(self.path / name)

    def test_other_addresses_need_a_token(self):
        self.fails(2, "add --token-file", "--bind", "0.0.0.0")
        self.fails(2, "add --token-file", "--bind", "::")
        self.fails(2, "cannot be read", "--token-file", str(self.path / "none"))
        self.fails(2, "16 to 512 characters", "--token-file", self.write("short", "0123456789\n"))
        self.fails(2, "printable ASCII", "--token-file", self.write("blank", "0123456789 0123456789\n"))

    def test_usage(self):
        token = self.write("token", "0123456789abcdef\n")
        self.fails(2, "is not an address", "--bind", "example.org", "--token-file", token)
        self.fails(2, "not an address of this machine", "--bind", "192.0.2.1", "--token-file", token)
        self.fails(2, "--token-file", "--trusted-proxy", "127.0.0.1")
        self.fails(2, "add --backend slurm", "--farm-frames", "3")
        self.fails(2, "--root", command=[PROGRAM, "serve"])
        self.fails(2, "", command=[PROGRAM, "serve", "--root", str(self.path / "none")])

    def test_port_that_is_taken(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            port = str(other.getsockname()[1])
            self.fails(5, "choose another port",
                       command=[port if word == "0" else word for word in self.command()])

    def test_store_that_is_taken(self):
        server = Server(self.command())
        self.fails(5, "")
        self.assertEqual(server.stop(), 143)

    def test_token(self):
        token = self.write("token", "0123456789abcdef\nmore\n")
        server = Server(self.command("--bind", "0.0.0.0", "--token-file", token))
        self.assertEqual(server.ask("GET", "/v1/jobs")[0], 401)
        known = {"Authorization": "Bearer 0123456789abcdef"}
        self.assertEqual(server.ask("GET", "/v1/jobs", None, known)[0], 200)
        self.assertEqual(server.stop(), 143)
        self.assertIn("without encryption", "".join(server.stderr))
        self.assertNotIn("0123456789abcdef", "".join(server.stderr))

    def test_host(self):
        server = Server(self.command("--host", "farm.example"))
        self.assertEqual(server.ask("GET", "/v1/jobs", None, {"Host": "farm.example"})[0], 200)
        self.assertEqual(server.ask("GET", "/v1/jobs", None, {"Host": "other.example"})[0], 421)
        self.assertEqual(server.stop(signal.SIGINT), 130)

    def test_ready_and_stopping(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as system:
            system.bind(str(self.path / "notify"))
            system.settimeout(20)
            server = Server(self.command(), dict(os.environ, NOTIFY_SOCKET=str(self.path / "notify")))
            self.assertEqual(system.recv(100), b"READY=1")
            self.assertEqual(server.ask("GET", "/readyz")[0], 200)
            self.assertEqual(server.stop(), 143)
            self.assertEqual(system.recv(100), b"STOPPING=1")

    def test_a_study_survives_kills(self):
        """After repeated SIGKILL the report equals the command's, byte by byte."""
        scenes = []
        for name in ("wheels", "poles"):
            subprocess.run([PROGRAM, "scene", name, "-o", str(self.path / name), "--frames", "1-2",
                            "--size", "64x48", "--truth-samples", "4", "--device", "software", "-q"],
                           check=True)
            scenes.append({"name": name, "input": f"{name}/sharp.####.exr",
                           "truth": f"{name}/both.####.exr", "camera": f"{name}/camera.json"})
        study = {"postchain_study": 1, "settings": {"repeats": 1}, "scenes": scenes,
                 "chains": {"quick": "fast", "report": "paper", "lens": "dof_first"}}
        (self.path / "order.yaml").write_text(json.dumps(study))
        start = time.monotonic()
        subprocess.run([PROGRAM, "study", "order.yaml", "-o", "expected", "--device", "software", "-q"],
                       check=True, cwd=self.path, stdout=subprocess.DEVNULL)
        seconds = time.monotonic() - start
        body = {"kind": "study", "study": "order.yaml", "output": "made"}
        kills = 0
        for part in (0.1, 0.3, 0.5, 0.4, 0.6):
            job = work_on(self.command("--attempts", "50"), body, "key", part * seconds)
            if job:
                break
            kills += 1
        job = work_on(self.command("--attempts", "50"), body, "key")
        self.assertEqual((job["state"], job["kind"], job["exit_code"]), ("done", "study", 0), job)
        self.assertGreaterEqual(kills, 2)
        self.assertIn("report against quick", job["verdict"])
        for name in ("report.json", "report.csv", "report.md", "index.html"):
            self.assertEqual((self.path / "made" / name).read_bytes(),
                             (self.path / "expected" / name).read_bytes(), name)
        server = Server(self.command())
        status, headers, page = server.ask("GET", f"/v1/jobs/{job['id']}/report/index.html")
        self.assertEqual((status, page), (200, (self.path / "made/index.html").read_bytes()))
        inner = json.loads((self.path / "made/report.json").read_text())["scenes"][0]["reports"][0]
        self.assertEqual(server.ask("GET", f"/v1/jobs/{job['id']}/report/{inner}")[0], 200)
        self.assertEqual(server.stop(), 143)

    def test_a_read_that_hangs(self):
        """A frame's disk does not answer. Its job ends, the next one is done, the service manager
        hears that the service lives, and a second signal ends it at once."""
        if not LIBRARY:
            self.skipTest("no library to preload, with sanitizers")
        self.scene("wheels", "1-3")
        hang = self.path / "hang"
        hang.touch()
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as system:
            system.bind(str(self.path / "notify"))
            system.settimeout(60)
            server = Server(self.command("--frame-timeout", "10"),
                            dict(os.environ, NOTIFY_SOCKET=str(self.path / "notify"),
                                 WATCHDOG_USEC="400000", LD_PRELOAD=LIBRARY,
                                 POSTCHAIN_HANG="sharp.0002.exr", POSTCHAIN_HANG_WHILE=str(hang)))
            self.assertEqual(system.recv(100), b"READY=1")
            # Its shaders are compiled by a job without a limit.
            warm = JOB | {"frames": "1", "output": "out/w.####.exr", "frame_timeout": 3600}
            self.assertEqual(server.ask("POST", "/v1/jobs", warm)[0], 202)
            self.assertEqual(self.ended(server, 1)["state"], "done")
            self.assertEqual(server.ask("POST", "/v1/jobs", JOB)[0], 202)
            job = self.ended(server, 2)
            self.assertEqual((job["state"], job["exit_code"]), ("failed", 4), job)
            self.assertIn("frame 2 was not read within 10 s", job["message"])
            second = JOB | {"frames": "1,3", "output": "out/b.####.exr"}
            self.assertEqual(server.ask("POST", "/v1/jobs", second)[0], 202)
            self.assertEqual(self.ended(server, 3)["state"], "done")
            status, _, ready = server.ask("GET", "/readyz")
            self.assertEqual(status, 200, ready)
            self.assertIn("1 thread hangs", json.loads(ready)["why"])
            self.assertEqual(system.recv(100), b"WATCHDOG=1")
            # No limit: the job stays, and so would the process.
            third = warm | {"frames": "2", "output": "out/c.####.exr"}
            hung = hang.stat().st_size
            self.assertEqual(server.ask("POST", "/v1/jobs", third)[0], 202)
            while hang.stat().st_size == hung:
                time.sleep(0.05)
            server.process.terminate()
            time.sleep(0.5)
            self.assertIsNone(server.process.poll(), "waits for the step under way")
            start = time.monotonic()
            self.assertEqual(server.stop(), 143)
            self.assertLess(time.monotonic() - start, 5)
        hang.unlink()
        server = Server(self.command())
        self.assertEqual(self.ended(server, 4)["state"], "done")
        self.assertEqual(server.ask("POST", "/v1/jobs/2/retry")[0], 200)
        job = self.ended(server, 2)
        self.assertEqual((job["state"], job["done"]), ("done", 3), job)
        self.assertEqual(server.stop(), 143)

    def test_users(self):
        users = self.path / "users.yaml"
        tokens = {"ann": "a" * 20, "ops": "o" * 20}
        write = lambda names: users.write_text("postchain_users: 1\nusers:\n" + "".join(
            f"  {name}: {{token: {tokens[name]}, admin: {str(name == 'ops').lower()}}}\n"
            for name in names))
        write(["ann"])
        self.scene("wheels", "1-1")
        server = Server(self.command("--users", str(users), "--log-format", "json",
                                     "--trusted-proxy", "127.0.0.1"))
        known = {name: {"Authorization": "Bearer " + token} for name, token in tokens.items()}
        self.assertEqual(server.ask("GET", "/v1/jobs", None, known["ops"])[0], 401)
        write(["ann", "ops"])
        server.process.send_signal(signal.SIGHUP)
        while server.ask("GET", "/v1/jobs", None, known["ops"])[0] != 200:
            time.sleep(0.1)
        session = json.loads(server.ask("GET", "/v1/session", None, known["ann"])[2])
        self.assertEqual((session["user"], session["admin"]), ("ann", False))
        self.assertEqual(server.ask("POST", "/v1/jobs", JOB, known["ann"])[0], 202)
        self.assertEqual(self.ended(server, 1, known["ann"])["owner"], "ann")
        listed = server.ask("GET", "/v1/jobs?owner=ops", None, known["ann"])[2]
        self.assertEqual(json.loads(listed)["jobs"], [])
        secure = {"X-Forwarded-For": "192.0.2.7", "X-Forwarded-Proto": "https"}
        cookie = server.ask("POST", "/v1/session", None, known["ann"] | secure)[1]["set-cookie"]
        self.assertIn("; Secure", cookie)
        users.write_text("postchain_users: 1\nusers: {ann: {token: short}}\n")
        server.process.send_signal(signal.SIGHUP)
        while "16 to 512 characters" not in "".join(server.stderr):
            time.sleep(0.1)
        self.assertEqual(server.ask("GET", "/v1/jobs", None, known["ops"])[0], 200)
        self.assertEqual(server.stop(), 143)
        lines = [json.loads(line) for line in server.stderr if '"event"' in line]
        done = [line for line in lines if line["event"] == "done"][0]
        self.assertEqual((done["user"], done["job"], done["level"]), ("ann", "1", "info"))
        self.assertGreaterEqual(done["seconds"], 0)
        self.assertRegex(done["time"], r"^\d{4}-\d\d-\d\dT[\d:.]+Z$")
        self.assertEqual([line["event"] for line in lines if line.get("job") == "1"],
                         ["queued", "started", "done"])
        for token in tokens.values():
            self.assertNotIn(token, "".join(server.stderr))
        self.fails(2, "unknown key 'tokn'", "--users",
                   self.write("bad", "postchain_users: 1\nusers: {a: {tokn: x}}\n"))

    def test_backup_while_it_runs(self):
        self.scene("wheels", "1-1")
        server = Server(self.command())
        self.assertEqual(server.ask("POST", "/v1/jobs", JOB)[0], 202)
        before = self.ended(server, 1)
        store, copy = self.path / "jobs.sqlite", self.path / "copy.sqlite"
        backup = [PROGRAM, "serve", "--store", str(store), "--backup", str(copy)]
        self.assertEqual(subprocess.run(backup, check=False).returncode, 0)
        self.assertEqual(subprocess.run(["sqlite3", str(store), f".backup {copy}2"],
                                        check=False).returncode, 0)
        self.fails(2, "is not a backup", command=backup[:-1] + [self.write("mine", "mine")])
        self.assertEqual(server.ask("DELETE", "/v1/jobs/1/record")[0], 200)
        self.assertEqual(server.ask("GET", "/v1/jobs/1")[0], 404)
        self.assertEqual(server.stop(), 143)
        for file in (copy, f"{copy}2"):
            for end in ("", "-wal", "-shm"):
                pathlib.Path(f"{store}{end}").unlink(missing_ok=True)
            store.write_bytes(pathlib.Path(file).read_bytes())
            server = Server(self.command())
            self.assertEqual(json.loads(server.ask("GET", "/v1/jobs/1")[2]), before)
            self.assertEqual(server.stop(), 143)

    def test_outputs_are_downloaded(self):
        self.scene("wheels", "1-3")
        server = Server(self.command())
        status, headers, _ = server.ask("POST", "/v1/jobs", JOB)
        self.assertEqual((status, headers["location"]), (202, "jobs/1"))
        self.ended(server, 1)
        status, headers, data = server.ask("GET", "/v1/jobs/1/frames/2/output")
        self.assertEqual((status, headers["content-type"]), (200, "image/x-exr"))
        self.assertEqual(data, (self.path / "out/a.0002.exr").read_bytes())
        status, headers, data = server.ask("GET", "/v1/jobs/1/outputs.zip?frames=2-3")
        self.assertIn("job-1.zip", headers["content-disposition"])
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            self.assertIsNone(archive.testzip())
            self.assertEqual(archive.namelist(), ["a.0002.exr", "a.0003.exr"])
            for name in archive.namelist():
                self.assertEqual(archive.read(name), (self.path / "out" / name).read_bytes())
        self.assertEqual(server.ask("GET", "/v1/jobs/1/outputs.zip?frames=7-9")[0], 404)
        for query in ["frames=x", "frames=3-1", "frame=1"]:
            self.assertEqual(server.ask("GET", f"/v1/jobs/1/outputs.zip?{query}")[0], 400, query)
        self.assertEqual(server.stop(), 143)

    def test_dashboard(self):
        """Every metric that the dashboard of Grafana asks for exists."""
        self.scene("wheels", "1-1")
        server = Server(self.command())
        self.assertEqual(server.ask("POST", "/v1/jobs", JOB)[0], 202)
        self.ended(server, 1)
        text = server.ask("GET", "/metrics")[2].decode()
        self.assertEqual(server.stop(), 143)
        names = {re.match(r"\w+", line)[0] for line in text.splitlines() if line[:1] != "#"}
        dashboard = json.loads((SOURCE / "tools/packaging/service/grafana.json").read_text())
        asked = set()
        for panel in dashboard["panels"]:
            for target in panel["targets"]:
                found = set(re.findall(r"\b(?:postchain|process)_\w+", target["expr"]))
                self.assertTrue(found, target)
                self.assertEqual(found - names, set(), panel["title"])
                asked |= found
        self.assertGreater(len(asked), 15)

    def scene(self, name, frames):
        subprocess.run([PROGRAM, "scene", name, "-o", str(self.path / "shots"), "--frames", frames,
                        "--size", "96x54", "--device", "software", "-q"], check=True)

    def ended(self, server, job, headers=None):
        while True:
            got = json.loads(server.ask("GET", f"/v1/jobs/{job}", None, headers)[2])
            if got["ended"]:
                return got
            time.sleep(0.05)

    def metrics(self, server, frames):
        """Prometheus's own tool accepts the metrics; `frames` were written since the start."""
        text = server.ask("GET", "/metrics")[2].decode()
        done = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True,
                              text=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))
        values = dict(line.rsplit(" ", 1) for line in text.splitlines() if line[:1] != "#")
        self.assertEqual(float(values['postchain_frames_total{result="written"}']), frames)
        self.assertEqual(float(values['postchain_step_seconds_count{step="write"}']), frames)
        self.assertEqual(float(values['postchain_jobs{state="done"}']), 1)

    def test_jobs_go_on_after_sigterm(self):
        scene = self.path / "shots"
        subprocess.run([PROGRAM, "scene", "wheels", "-o", str(scene), "--frames", "1-24", "--size",
                        "320x180", "--device", "software", "-q"], check=True)
        (self.path / "out").mkdir()
        server = Server(self.command())
        body = {"chain": "balanced", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
                "output": "out/a.####.exr"}
        self.assertEqual(server.ask("POST", "/v1/jobs", body)[0], 202)
        listener = Events(server, "/v1/jobs/1/events")
        while not ((got := listener.next(60))[1] and got[1]["type"] == "frame"):
            pass
        start = time.monotonic()
        self.assertEqual(server.stop(), 143)
        self.assertLess(time.monotonic() - start, 20)
        listener.close()
        written = len(list((self.path / "out").glob("a.*.exr")))
        self.assertTrue(1 <= written < 24, written)
        server = Server(self.command())
        listener = Events(server, "/v1/jobs/1/events")
        frames = []
        while True:
            got = listener.next(60)
            if got is None:
                break
            if got[1] and got[1]["type"] == "frame":
                frames.append(got[1]["data"]["frame"])
        listener.close()
        # The events of both processes, with each frame once.
        self.assertEqual(sorted(frames), list(range(1, 25)))
        job = json.loads(server.ask("GET", "/v1/jobs/1")[2])
        self.assertEqual((job["state"], job["done"]), ("done", 24))
        self.metrics(server, 24 - written)
        self.assertEqual(server.stop(), 143)


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    if len(sys.argv) > 1 and sys.argv[1].endswith(".so"):
        LIBRARY = sys.argv.pop(1)
    unittest.main()
