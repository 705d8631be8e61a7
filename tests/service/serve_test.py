"""postchain serve as a process: exit codes, tokens, addresses, signals, READY.

usage: serve_test.py POSTCHAIN [LIBRARY]: poison_calls.cpp as a library"""
import contextlib
import ctypes
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from server import (Events, KEPT_PROGRAMS, PATIENCE_S, Served, Server, make_scene, serve_command,  # noqa: E402
                    token_hash, wait_until, work_on)
from skips import skipped  # noqa: E402

PROGRAM = LIBRARY = None
SOURCE = pathlib.Path(__file__).parents[2]
JOB = {"chain": "fast", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
       "output": "out/a.####.exr", "mkdir": True}


class Serve(Served):
    def fails(self, code, text, *more, command=None):
        done = subprocess.run(command or self.command(*more), capture_output=True, text=True,
                              timeout=PATIENCE_S)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(text, done.stderr)

    @contextlib.contextmanager
    def notified(self):
        """The socket of a service manager, and the environment of its services."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as system:
            system.bind(str(self.path / "notify"))
            system.settimeout(PATIENCE_S)
            yield system, dict(os.environ, NOTIFY_SOCKET=str(self.path / "notify"))

    def test_usage(self):
        users = ["--users", self.write("users.yaml", "postchain_users: 1\nusers: {ann: {}}\n")]
        bad = self.write("bad", "postchain_users: 1\nusers: {a: {tokn: x}}\n")
        for words, text in [
                (["--bind", "0.0.0.0"], "add --users"), (["--bind", "::"], "add --users"),
                (["--hash-token", self.write("short", "0123456789\n")], "16 to 512 characters"),
                (["--users", bad], "unknown key 'tokn' (did you mean 'tokens'?)"),
                (["--bind", "example.org", *users], "is not an address"),
                (["--bind", "192.0.2.1", *users], "not an address of this machine"),
                (["--trusted-proxy", "127.0.0.1"], "add --users"),
                (["--user-header", "X-User", *users], "add --trusted-proxy"),
                (["--farm-frames", "3"], "add --backend slurm"), (["--slurm-option=-p=a"], "add --backend slurm"),
                (["--backend", "slurm"], "add --farm-folder"),
                (["--hash-token", str(self.path / "none")], "cannot be read"),
                (["--bind", "localhost"], "add --users")]:
            self.fails(2, text, *words)
        serve = [PROGRAM, "serve", "--root", str(self.path)]
        self.fails(5, "--store: ", command=["env", "STATE_DIRECTORY=" + bad, *serve])
        self.fails(2, "--store: give a file", command=["env", "-i", *serve])
        self.fails(2, "--root", command=[PROGRAM, "serve"])
        self.fails(2, "", command=[PROGRAM, "serve", "--root", str(self.path / "none")])

    def test_port_or_store_that_is_taken(self):
        with self.serving() as server:
            self.fails(5, "another service")
            other = serve_command(PROGRAM, self.path, store="other.sqlite")
            self.fails(5, "choose another port",
                       command=[str(server.port) if word == "0" else word for word in other])

    def test_token(self):
        plain = self.write("plain", "0123456789abcdef\nmore\n")
        printed = subprocess.run([PROGRAM, "serve", "--root", str(self.path), "--hash-token", plain],
                                 check=True, capture_output=True, text=True).stdout
        self.assertEqual(printed, token_hash("0123456789abcdef") + "\n")
        piped = subprocess.run([PROGRAM, "serve", "--hash-token", "-"], input="0123456789abcdef\r\n", check=True,
                               capture_output=True, text=True).stdout
        self.assertEqual(piped, printed)
        users = self.write("users.yaml", f"postchain_users: 1\nusers: {{ann: {{tokens: [{printed.strip()}]}}}}\n")
        known = {"Authorization": "Bearer 0123456789abcdef"}
        with self.serving("--bind", "0.0.0.0", "--users", users) as server:
            self.assertEqual(server.ask("GET", "/v1/jobs")[0], 401)
            self.assertEqual(server.ask("GET", "/v1/jobs", None, known)[0], 200)
        self.assertIn("without encryption", "".join(server.stderr))

    def test_options_of_a_file(self):
        """That of the package too."""
        self.write("users.yaml", "postchain_users: 1\nusers: {ann: {}}\n")
        shipped = (SOURCE / "tools/packaging/service/service.yaml").read_text()
        text = shipped.replace("/srv/postchain", str(self.path)).replace("/etc/postchain", str(self.path))
        config = self.write("service.yaml", text + "hosts: [farm.example]\nkeep_jobs: 5\n")
        with self.serving("--config", config) as server:
            self.assertEqual(server.ask("GET", "/v1/jobs")[0], 401)
            self.assertEqual(server.ask("GET", "/readyz", None, {"Host": "farm.example"})[0], 200)
        for text, fault in [("keep_jobs: 5", "expected postchain_service: 1"),
                            ("postchain_service: 2", "postchain_service"),
                            ("postchain_service: 1\nkeep_job: 5", "2:11: error: keep_job: unknown key 'keep_job'"),
                            ("postchain_service: 1\nkeep_jobs: 0", "keep_jobs"),
                            ("postchain_service: 1\nhosts: x", "expected a list"),
                            ("postchain_service: 1\nhosts: [[x]]", "expected a list of strings"),
                            ("postchain_service: 1\ndevice: [x]", "device: expected a string"),
                            ("postchain_service: 1\nthreads: 0", "threads: "),
                            ("postchain_service: [", "bad.yaml:"),
                            ("postchain_service: 1\nbackup: x", "unknown key 'backup'")]:
            self.fails(2, fault, command=[PROGRAM, "serve", "--root", str(self.path), "--config",
                                          self.write("bad.yaml", text + "\n")])

    def test_unit(self):
        """systemd accepts it, and what broke results, Slurm and GPUs is not set."""
        unit = (SOURCE / "tools/packaging/service/postchain.service").read_text()
        copy = self.path / "postchain.service"
        copy.write_text(unit.replace("/usr/bin/postchain", PROGRAM).replace("Documentation=", "#"))
        if shutil.which("systemd-analyze"):
            checked = subprocess.run(["systemd-analyze", "verify", str(copy)], check=False,
                                     capture_output=True, text=True)
            self.assertEqual((checked.returncode, checked.stderr), (0, ""))
        for trap in ("UMask=0077", "IPAddressDeny", "ProcSubset"):
            self.assertNotIn(f"\n{trap}", unit)
        self.assertRegex(unit, r"\nMemoryMax=\d")

    def test_without_the_lab(self):
        """It starts, and says why it takes no comparison."""
        self.shots("1-1")
        (self.path / "bin").mkdir()
        for name in ("postchain", "postchain-serve", "postchain-preview"):
            shutil.copy2(pathlib.Path(PROGRAM).parent / name, self.path / "bin" / name)
        server = Server(serve_command(self.path / "bin/postchain", self.path))
        for kind in ("ab", "bench", "study"):
            status, _, body = server.ask("POST", "/v1/jobs", {"kind": kind})
            self.assertEqual(status, 422)
            self.assertIn(f"{kind} jobs need postchain-lab beside the command".encode(), body)
        self.assertEqual(server.ended(server.submit(JOB))["state"], "done")
        self.assertEqual(server.stop(), 143)

    def test_host_ready_and_interrupt(self):
        with self.notified() as (system, environment):
            with self.serving("--host", "farm.example", ends_by=signal.SIGINT,
                              env=environment) as server:
                self.assertEqual(system.recv(100), b"READY=1")
                for host, status in [("farm.example", 200), ("other.example", 421)]:
                    self.assertEqual(server.ask("GET", "/readyz", None, {"Host": host})[0], status)
            self.assertEqual(system.recv(100), b"STOPPING=1")

    def test_a_study_survives_kills(self):
        """After repeated SIGKILL the report equals the command's, byte by byte."""
        scenes = []
        for name in ("wheels", "poles"):
            make_scene(PROGRAM, self.path / name, "1-2", "64x48", "--truth-samples", "4", scene=name)
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
        inner = json.loads((self.path / "made/report.json").read_text())["scenes"][0]["reports"][0]
        report = f"/v1/jobs/{job['id']}/report/"
        with self.serving() as server:
            status, _, page = server.ask("GET", report + "index.html")
            self.assertEqual((status, page), (200, (self.path / "made/index.html").read_bytes()))
            self.assertEqual(server.ask("GET", report + inner)[0], 200)

    def test_a_file_that_crashes_its_reader(self):
        """Only requests for its image fail; a FIFO in place of a camera file holds no thread."""
        self.shots("1-2")
        os.mkfifo(self.path / "pipe.json")
        environment = os.environ | ({"LD_PRELOAD": LIBRARY, "POSTCHAIN_POISON": "sharp.0002.exr"}
                                    if LIBRARY else {})
        with self.serving(env=environment) as server:
            plan = {"chain": "fast", "input": "shots/sharp.####.exr", "camera": "pipe.json"}
            for _ in range(24):
                status, _, body = server.ask("POST", "/v1/plan", plan, timeout=30)
                self.assertEqual(status, 422, body)
                self.assertIn(b"is not a file", body)
            image = "/v1/image?input=shots/sharp.%23%23%23%23.exr&frame="
            status, headers, _ = server.ask("GET", image + "1")
            self.assertEqual((status, headers["content-type"]), (200, "image/png"))
            self.assertEqual(server.ask("GET", image + "9")[0], 404)
            preview = {"chain": "paper", "input": "shots/sharp.####.exr",
                       "camera": "shots/camera.json", "scale": 0.5}
            good = server.ask("POST", "/v1/preview", preview | {"frame": 1})
            self.assertEqual((good[0], good[1]["content-type"]), (200, "image/png"))
            self.check_that_previews_are_confined(server.process.pid)
            if not LIBRARY:
                return
            for words in [("GET", image + "2"), ("POST", "/v1/preview", preview | {"frame": 2})]:
                status, _, body = server.ask(*words)
                self.assertEqual(status, 422, body)
                self.assertIn("sharp.0002.exr: its reader crashed", json.loads(body)["detail"])
            self.assertEqual(server.ask("GET", image + "1")[0], 200)
            again = server.ask("POST", "/v1/preview", preview | {"frame": 1})
            self.assertEqual((again[0], again[2]), (200, good[2]))

    def test_a_decoder_that_crashes(self):
        """Frames of one user that read its file fail; neither the other frames nor another's job nor the service
        suffer."""
        if not LIBRARY:
            skipped("a decoder that crashes `postchain serve`: nothing is preloaded with sanitizers")
            self.skipTest("no library")
        self.shots("1-4")
        users = {"ann": "a" * 16, "bob": "b" * 16}
        for name in users:
            shutil.copytree(self.path / "shots", self.path / name / "shots")
        self.write("users.yaml", "postchain_users: 1\nusers:\n" + "".join(
            f"  {name}: {{tokens: [{token_hash(token)}]}}\n" for name, token in users.items()))
        head = {name: {"Authorization": f"Bearer {token}"} for name, token in users.items()}
        environment = os.environ | KEPT_PROGRAMS | {
            "LD_PRELOAD": LIBRARY, "POSTCHAIN_CRASH": "ann/shots/sharp.0002.exr"}
        with self.serving("--users", str(self.path / "users.yaml"), "--slice", "0", "--attempts", "2",
                          env=environment) as server:
            # It reads the frames before and after each frame.
            jobs = {name: server.submit(
                {"chain": "best", "mkdir": True, "input": f"{name}/shots/sharp.####.exr",
                 "camera": f"{name}/shots/camera.json", "output": f"{name}/out/o.####.exr"}, head[name])
                for name in users}
            ended = {name: server.ended(job, head[name]) for name, job in jobs.items()}
            frames = {name: server.get(f"/v1/jobs/{jobs[name]}/frames", head[name])["frames"] for name in users}
            for frame, name, status in [(2, "ann", 422), (2, "bob", 200), (1, "ann", 200)]:
                got, _, said = server.ask(
                    "GET", f"/v1/image?input={name}/shots/sharp.%23%23%23%23.exr&frame={frame}", None, head[name])
                self.assertEqual(got, status, said)
                self.assertEqual(b"sharp.0002.exr: its reader crashed" in said, status == 422)
        self.assertIn("3 of 4 frames quarantined: 1-3; frame 1: its process was ended by SIGSEGV",
                      ended["ann"]["message"])
        self.assertEqual([frame["state"] for frame in frames["ann"]], ["quarantined"] * 3 + ["written"])
        self.assertEqual([frame["attempts"] for frame in frames["ann"]][:3], [2] * 3)
        self.assertEqual((ended["bob"]["state"], ended["bob"]["done"]), ("done", 4))
        self.assertEqual([frame["message"] for frame in frames["bob"]], [""] * 4)

    def test_programs_are_kept(self):
        """Those of jobs and previews, in one folder."""
        self.shots("1-2")
        programs = self.path / ".jobs.sqlite.programs"
        kept = lambda: sum(file.is_file() for file in programs.rglob("*"))
        with self.serving(env=dict(os.environ)) as server:
            preview = {"chain": "paper", "input": "shots/sharp.####.exr", "camera": "shots/camera.json", "frame": 1}
            before = kept()
            self.assertEqual(server.ask("POST", "/v1/preview", preview)[0], 200)
            wait_until(lambda: kept() > before)
            before = kept()
            self.assertEqual(server.ended(server.submit(JOB))["state"], "done")
            self.assertGreater(kept(), before)
        self.assertNotIn("shader cache", "".join(server.stderr))

    def check_that_previews_are_confined(self, service):
        """Landlock demands that the process renounces privileges, which /proc shows."""
        if ctypes.CDLL(None).syscall(444, None, 0, 1) < 1:
            return  # the kernel has none
        children = [file.read_text().split() for file in pathlib.Path(f"/proc/{service}/task").glob("*/children")]
        threads = [status.read_text() for some in children for one in some
                   for status in pathlib.Path(f"/proc/{one}/task").glob("*/status")]
        self.assertTrue(any("NoNewPrivs:\t1" in thread for thread in threads), children)

    def test_a_read_that_hangs(self):
        """A frame's disk does not answer: its process is killed, the frames beside it are made, the service manager
        hears that the service lives, and a second signal ends it at once."""
        if not LIBRARY:
            skipped("a read that hangs in `postchain serve`: nothing is preloaded with sanitizers")
            self.skipTest("no library")
        self.shots("1-3")
        alone = JOB | {"chain": "paper"}  # reads no frame beside it
        hang = self.path / "hang"
        hang.touch()
        with self.notified() as (system, environment):
            environment |= {"WATCHDOG_USEC": "400000", "LD_PRELOAD": LIBRARY,
                            "POSTCHAIN_HANG": "sharp.0002.exr", "POSTCHAIN_HANG_WHILE": str(hang)}
            with self.serving("--frame-timeout", "10", "--attempts", "1", env=environment) as server:
                self.assertEqual(system.recv(100), b"READY=1")
                job = server.ended(server.submit(alone))
                self.assertIn("frame 2: nothing was read, filtered or written for 10 s", job["message"])
                self.assertEqual((job["state"], job["done"]), ("failed", 2), job)
                self.assertEqual(system.recv(100), b"WATCHDOG=1")
                # No limit: the job stays.
                hung = hang.stat().st_size
                server.submit(alone | {"frames": "2", "output": "out/c.####.exr", "frame_timeout": 3600})
                wait_until(lambda: hang.stat().st_size > hung)
                server.process.terminate()
                wait_until(lambda: "shutting down" in server.get("/readyz")["why"])
                self.assertIsNone(server.process.poll(), "waits for the step under way")
                start = time.monotonic()
            self.assertLess(time.monotonic() - start, 15, "the second signal ends it at once")

    def test_users(self):
        users = self.path / "users.yaml"
        tokens = {"ann": "a" * 20, "ops": "o" * 20}
        write = lambda names: users.write_text("postchain_users: 1\nusers:\n" + "".join(
            f"  {name}: {{tokens: [{token_hash(tokens[name])}], admin: {str(name == 'ops').lower()}}}\n"
            for name in names))
        write(["ann"])
        self.shots("1-1")
        known = {name: {"Authorization": "Bearer " + token} for name, token in tokens.items()}
        proxied = ["--trusted-proxy", "127.0.0.1", "--user-header", "X-Remote-User"]
        with self.serving("--users", str(users), "--log-format", "json", *proxied) as server:
            self.assertEqual(server.ask("GET", "/v1/jobs", None, known["ops"])[0], 401)
            write(["ann", "ops"])
            server.process.send_signal(signal.SIGHUP)
            wait_until(lambda: server.ask("GET", "/v1/jobs", None, known["ops"])[0] == 200)
            user = server.get("/v1/user", known["ann"])
            self.assertEqual((user["user"], user["admin"]), ("ann", False))
            server.ended(server.submit(JOB, known["ann"]), known["ann"])
            self.assertEqual(server.get("/v1/jobs?owner=ops", known["ann"])["jobs"], [])
            named = {"X-Forwarded-For": "192.0.2.7", "X-Remote-User": "ops"}
            self.assertEqual(server.ask("DELETE", "/v1/jobs/1/record", None, named)[0], 200)
        lines = [json.loads(line) for line in server.stderr if '"event"' in line]
        audited = [line for line in lines if line["event"] == "audit"]
        self.assertEqual([(line["action"], line.get("user"), line["address"]) for line in audited
                          if line["status"] < 300],
                         [("submitJob", "ann", "127.0.0.1"), ("forgetJob", "ops", "192.0.2.7")])
        done = [line for line in lines if line.get("job") == "1" and line["event"] != "audit"][-1]
        self.assertEqual((done["event"], done["user"], done["level"]), ("done", "ann", "info"))
        self.assertRegex(done["time"], r"^\d{4}-\d\d-\d\dT[\d:.]+Z$")

    def test_backup_and_dashboard(self):
        """A backup while it runs; every metric that the dashboard of Grafana asks for exists."""
        self.shots("1-1")
        store, copy = self.path / "jobs.sqlite", self.path / "copy.sqlite"
        backup = [PROGRAM, "serve", "--store", str(store), "--backup", str(copy)]
        with self.serving() as server:
            before = server.ended(server.submit(JOB))
            text = server.ask("GET", "/metrics")[2].decode()
            self.assertEqual(subprocess.run(backup, check=False).returncode, 0)
            self.fails(2, "is not a backup", command=backup[:-1] + [self.write("mine", "mine")])
            self.assertEqual(server.ask("DELETE", "/v1/jobs/1/record")[0], 200)
            self.assertEqual(server.ask("GET", "/v1/jobs/1")[0], 404)
        for end in ("", "-wal", "-shm"):
            pathlib.Path(f"{store}{end}").unlink(missing_ok=True)
        store.write_bytes(copy.read_bytes())
        with self.serving() as server:
            self.assertEqual(server.get("/v1/jobs/1"), before)
        # The users have metrics of their own.
        known = {"Authorization": "Bearer " + "a" * 20}
        users = self.write("users.yaml", f"postchain_users: 1\nusers: {{ann: {{tokens: [{token_hash('a' * 20)}]}}}}\n")
        with self.serving("--users", users) as server:
            server.ended(server.submit(JOB | {"on_existing": "overwrite"}, known), known)
            text += server.ask("GET", "/metrics", None, known)[2].decode()
        names = {re.match(r"\w+", line)[0] for line in text.splitlines() if line[:1] != "#"}
        alerts = SOURCE / "tools/packaging/service/alerts.yaml"
        self.assertEqual(subprocess.run(["promtool", "check", "rules", str(alerts)], check=False).returncode, 0)
        asked = set(re.findall(r"\b(?:postchain|process)_\w+", " ".join(
            re.findall(r"expr: (.*)", alerts.read_text()))))
        self.assertTrue(len(asked) > 8 and asked <= names | {"postchain_step_seconds_count"}, asked - names)

    def test_jobs_go_on_after_sigterm(self):
        self.shots("1-12", "160x90")
        with self.serving() as server:
            server.submit(JOB | {"chain": "balanced"})
            listener = Events(server, "/v1/jobs/1/events")
            while not ((got := listener.next())[1] and got[1]["type"] == "frame"):
                pass
        listener.close()
        written = len(list((self.path / "out").glob("a.*.exr")))
        self.assertTrue(1 <= written < 12, written)
        with self.serving() as server:
            listener = Events(server, "/v1/jobs/1/events")
            frames = [event["data"]["frame"] for _, event in listener.rest() if event["type"] == "frame"]
            listener.close()
            # The events of both processes, with each frame once.
            self.assertEqual(sorted(frames), list(range(1, 13)))
            job = server.get("/v1/jobs/1")
            self.assertEqual((job["state"], job["done"]), ("done", 12))
            # Prometheus's own tool accepts the metrics; they count since the start.
            text = server.ask("GET", "/metrics")[2].decode()
            self.assertIn(f'postchain_frames_total{{result="written"}} {12 - written}\n', text)
            check = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True,
                                   text=True, timeout=60)
            self.assertEqual((check.returncode, check.stdout + check.stderr), (0, ""))


if __name__ == "__main__":
    PROGRAM = Served.PROGRAM = os.path.abspath(sys.argv.pop(1))
    if len(sys.argv) > 1 and sys.argv[1].endswith(".so"):
        LIBRARY = sys.argv.pop(1)
    unittest.main()
