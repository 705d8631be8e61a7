"""A server under test and raw sockets to it; needs only Python's own library."""
import contextlib
import http.client
import json
import re
import signal
import socket
import subprocess
import threading
import time


class Server:
    """A program that prints its port or its address on the first line."""

    def __init__(self, command, env=None):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True, env=env)
        self.stderr = []
        line = self.process.stdout.readline()
        found = re.search(r"(\d+)/?\s*$", line)
        if not found:
            raise RuntimeError(f"did not start: {line} {self.process.stderr.read()}")
        self.port = int(found[1])
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.stderr.append(line)

    def stop(self, number=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(timeout=30)
        self.reader.join()
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def threads(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"Threads:\s+(\d+)", status.read())[1])

    def memory_kib(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"VmRSS:\s+(\d+)", status.read())[1])

    def connect(self, timeout=10):
        return socket.create_connection(("127.0.0.1", self.port), timeout)

    def send(self, raw, timeout=10):
        """All bytes until the server closes, or is silent for `timeout` seconds."""
        with self.connect(timeout) as client:
            try:
                client.sendall(raw)
            except (BrokenPipeError, ConnectionResetError):
                pass  # it has answered before it read all
            return read_all(client)

    def ask(self, method, target, body=None, headers=None, timeout=10):
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


def work_on(command, body, key, kill_after=None, env=None):
    """Starts the service, submits a job under a key, waits until it has ended and stops the service.
    The job as it was told, or None where the process died first: by itself, or by SIGKILL
    `kill_after` seconds after its start."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env=env) as process:
        killer = threading.Timer(kill_after, process.kill) if kill_after is not None else None
        if killer:
            killer.start()
        errors = []
        reader = threading.Thread(target=lambda: errors.extend(process.stderr), daemon=True)
        reader.start()
        try:
            job = submit_and_wait(process.stdout.readline().strip(), body, key)
        except (OSError, http.client.HTTPException):
            job = None
        finally:
            if killer:
                killer.cancel()
            process.terminate()
            code = process.wait(timeout=60)
            reader.join()
    if job is None and code != -signal.SIGKILL:
        raise RuntimeError(f"exit code {code}: {''.join(errors)}")
    return job


def submit_and_wait(address, body, key):
    """Raises OSError or HTTPException if the service has ended."""
    if not address:
        raise ConnectionError("no address")
    client = http.client.HTTPConnection(address.split("/")[2], timeout=60)
    with contextlib.closing(client):
        client.request("POST", "/v1/jobs", json.dumps(body),
                       {"Content-Type": "application/json", "Idempotency-Key": key})
        while True:
            reply = client.getresponse()
            text = reply.read()
            if reply.status not in (200, 202):
                raise RuntimeError(f"{reply.status}: {text.decode()}")
            job = json.loads(text)
            if job["ended"]:
                return job
            time.sleep(0.02)
            client.request("GET", f"/v1/jobs/{job['id']}")


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
        self.client = server.connect(30)
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
        head, _, self.buffer = self.buffer.partition(b"\r\n\r\n")
        self.status = int(head.split()[1])

    def next(self, seconds=10):
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

    def close(self):
        self.client.close()
