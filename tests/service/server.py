"""A server under test: raw sockets to it, jobs, and a fixture for `postchain serve`. Needs only Python's
own library."""
import contextlib
import hashlib
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

PATIENCE_S = 120  # for what takes milliseconds on an idle machine
KILLED = (-signal.SIGKILL, 128 + signal.SIGKILL)


def wait_until(holds, patience_s=PATIENCE_S):
    """The first true value of holds()."""
    end = time.monotonic() + patience_s
    while not (value := holds()):
        if time.monotonic() > end:
            raise AssertionError(f"not within {patience_s} s")
        time.sleep(0.02)
    return value


def serve_command(program, root, *more, store="jobs.sqlite"):
    return [str(program), "serve", "--root", str(root), "--store", str(root / store), "--port", "0",
            "--device", "software", *more]


def token_hash(token):
    """As `postchain serve --hash-token` prints it."""
    return "blake2b-" + hashlib.blake2b(token.encode(), digest_size=32).hexdigest()


def make_scene(program, folder, frames, size, *more, scene="wheels"):
    """Frames sharp.####.exr and camera.json."""
    subprocess.run([str(program), "scene", scene, "-o", str(folder), "--frames", frames, "--size", size,
                    "--device", "software", "-q", *more], check=True)


# Compiled programs of all tests, as of their other programs.
KEPT_PROGRAMS = {"MESA_SHADER_CACHE_DIR": os.path.expanduser("~/.cache")}


class Server:
    """A program that prints its port or its address on the first line."""

    def __init__(self, command, env=None):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True, env=env or os.environ | KEPT_PROGRAMS)
        self.stderr = []
        line = self.process.stdout.readline()
        found = re.search(r"(\d+)/?\s*$", line)
        if not found:
            error = self.process.communicate()[1]
            if self.process.returncode in KILLED:
                raise ConnectionError("was killed at once")
            raise RuntimeError(f"did not start: {line} {error}")
        self.port = int(found[1])
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.stderr.append(line)

    def stop(self, number=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(timeout=PATIENCE_S)
        self.reader.join()
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def status(self, key):
        text = pathlib.Path(f"/proc/{self.process.pid}/status").read_text("ascii")
        return int(re.search(rf"{key}:\s+(\d+)", text)[1])

    def threads(self):
        return self.status("Threads")

    def memory_kib(self):
        return self.status("VmRSS")

    def connect(self, timeout=PATIENCE_S):
        return socket.create_connection(("127.0.0.1", self.port), timeout)

    def send(self, raw, timeout=PATIENCE_S):
        """All bytes until the server closes, or is silent for `timeout` seconds."""
        with self.connect(timeout) as client:
            try:
                client.sendall(raw)
            except (BrokenPipeError, ConnectionResetError):
                pass  # it has answered before it read all
            return read_all(client)

    def ask(self, method, target, body=None, headers=None, timeout=PATIENCE_S):
        """Status, headers with lower-case names, body."""
        lines = {"Host": f"127.0.0.1:{self.port}", "Connection": "close"}
        if body is not None:
            if not isinstance(body, (bytes, str)):
                body = json.dumps(body)
            body = body.encode() if isinstance(body, str) else body
            lines |= {"Content-Type": "application/json", "Content-Length": str(len(body))}
        lines |= headers or {}
        text = f"{method} {target} HTTP/1.1\r\n"
        text += "".join(f"{k}: {v}\r\n" for k, v in lines.items() if v is not None)
        return parse(self.send(text.encode("latin1") + b"\r\n" + (body or b""), timeout))

    def get(self, target, headers=None):
        """The JSON of a reply."""
        return json.loads(self.ask("GET", target, None, headers)[2])

    def submit(self, body, headers=None):
        """The job's id."""
        status, _, answer = self.ask("POST", "/v1/jobs", body, headers)
        if status not in (200, 202):
            raise AssertionError(f"{status}: {answer.decode()}")
        return json.loads(answer)["id"]

    def ended(self, job, headers=None, patience_s=PATIENCE_S):
        """The job when it has ended."""
        wait_until(lambda: self.get(f"/v1/jobs/{job}", headers)["ended"], patience_s)
        return self.get(f"/v1/jobs/{job}", headers)


class Served(unittest.TestCase):
    """A folder and services over it."""
    PROGRAM = None

    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def command(self, *more):
        return serve_command(self.PROGRAM, self.path, *more)

    @contextlib.contextmanager
    def serving(self, *more, env=None, ends_by=signal.SIGTERM):
        """A service, which this signal ends."""
        server = Server(self.command(*more), env)
        try:
            yield server
        finally:
            code = server.stop(ends_by)
        self.assertEqual(code, 128 + ends_by, server.stderr)

    def write(self, name, text):
        (self.path / name).write_text(text)
        return str(self.path / name)

    def shots(self, frames, size="96x54"):
        make_scene(self.PROGRAM, self.path / "shots", frames, size)


def work_on(command, body, key, kill_after=None, env=None):
    """Starts the service, submits a job under a key, waits until it has ended and stops the service.
    The job as it was told, or None where the process was killed first: by itself, or `kill_after`
    seconds after its start."""
    if kill_after is not None:
        command = ["timeout", "-s", "KILL", str(kill_after), *command]
    server = job = None
    try:
        server = Server(command, env)
        job = server.ended(server.submit(body, {"Idempotency-Key": key}), patience_s=10 * PATIENCE_S)
    except (OSError, ValueError, AssertionError):
        if server and server.stop() not in KILLED:
            raise
        return None
    server.stop()
    return job


def read_all(client):
    got = b""
    try:
        while True:
            data = client.recv(65536)
            if not data:
                return got
            got += data
    except (TimeoutError, ConnectionResetError):
        return got


def parse(raw):
    head, _, body = raw.partition(b"\r\n\r\n")
    lines = head.decode("latin1").split("\r\n")
    if not lines[0].startswith("HTTP/1.1 "):
        return 0, {}, raw
    headers = dict((k.lower(), v.strip()) for k, _, v in (x.partition(":") for x in lines[1:]))
    return int(lines[0].split()[1]), headers, body


def statuses(raw):
    return [int(x) for x in re.findall(rb"(?:^|[\n}])HTTP/1\.1 (\d+)", raw)]


class Events:
    """Listens to server-sent events on a socket of its own until closed."""

    def __init__(self, server, target="/v1/events", last=None, headers=None):
        self.client = server.connect()
        lines = f"GET {target} HTTP/1.1\r\nHost: localhost\r\n"
        if last is not None:
            lines += f"Last-Event-ID: {last}\r\n"
        lines += "".join(f"{k}: {v}\r\n" for k, v in (headers or {}).items())
        self.client.sendall(lines.encode() + b"\r\n")
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            data = self.client.recv(4096)
            if not data:
                break
            self.buffer += data
        self.buffer = self.buffer.partition(b"\r\n\r\n")[2]

    def next(self, seconds=PATIENCE_S):
        """(id, data) of the next event; None at the end. A comment is ("", None)."""
        end = time.monotonic() + seconds
        while b"\n\n" not in self.buffer:
            self.client.settimeout(max(0.01, end - time.monotonic()))
            data = self.client.recv(65536)
            if not data:
                return None
            self.buffer += data
        text, _, self.buffer = self.buffer.partition(b"\n\n")
        fields = dict(line.split(": ", 1) for line in text.decode().split("\n") if ": " in line)
        if "id" not in fields:
            return "", None
        return int(fields["id"]), json.loads(fields["data"])

    def rest(self):
        """(id, data) of all further events, until the server closes."""
        found = []
        while (got := self.next()) is not None:
            if got[1]:
                found.append(got)
        return found

    def close(self):
        self.client.close()
