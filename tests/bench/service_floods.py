"""The latency of one user's requests while another client floods the service in one of several ways: the
list of jobs, and a thumbnail of a job; the median, 99 %, and replies other than 200.

usage: service_floods.py POSTCHAIN [--seconds N] [--only FLOOD ...]"""
import argparse
import contextlib
import pathlib
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from server import Server, token_hash  # noqa: E402

USERS = f"""postchain_users: 1
users:
  ann: {{tokens: [{token_hash("a" * 16)}]}}
  bob: {{tokens: [{token_hash("b" * 16)}]}}
"""
PATIENCE_S = 130


def request(line, user=None, body=""):
    token = f"Authorization: Bearer {user[0] * 16}\r\n" if user else ""
    kind = f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n" if body else ""
    return f"{line} HTTP/1.1\r\nHost: localhost\r\n{token}{kind}\r\n{body}".encode()


PREVIEW = ('{"chain": "best", "input": "shots/sharp.####.exr", "camera": "shots/camera.json", "frame": 2}')
IMAGE = "GET /v1/image?input=shots/sharp.%23%23%23%23.exr&frame=2&side=9999"


class Flood:
    """Connections that send one request after the other, while the context is open."""

    def __init__(self, port, count, text, addresses=("127.0.0.1",), once=False):
        self.port, self.count, self.text, self.addresses, self.once = port, count, text, addresses, once
        self.going, self.sockets, self.lock = True, [], threading.Lock()
        self.threads = [threading.Thread(target=self.run, args=(i,), daemon=True)
                        for i in range(1 if once else count)]

    def connect(self, i):
        client = socket.create_connection(("127.0.0.1", self.port), PATIENCE_S,
                                          source_address=(self.addresses[i % len(self.addresses)], 0))
        with self.lock:
            self.sockets.append(client)
        client.sendall(self.text)
        return client

    def run(self, number):
        if self.once:
            for i in range(self.count):
                with contextlib.suppress(OSError):
                    self.connect(i)
            return
        while self.going:
            with contextlib.suppress(OSError):
                client = self.connect(number)
                while self.going and client.recv(65536):
                    client.sendall(self.text)
            time.sleep(0.01)

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        time.sleep(3)
        return self

    def __exit__(self, *_):
        self.going = False
        with self.lock:
            for client in self.sockets:
                with contextlib.suppress(OSError):
                    client.shutdown(socket.SHUT_RDWR)
                client.close()
        for thread in self.threads:
            thread.join(5)


def measure(server, target, seconds):
    """Seconds of each request, and the number of replies that were not 200."""
    times, refused = [], 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        start = time.monotonic()
        try:
            status = server.ask("GET", target, headers={"Authorization": "Bearer " + "b" * 16},
                                timeout=PATIENCE_S)[0]
        except OSError:
            status = 0
        times.append(time.monotonic() - start)
        refused += status != 200
        time.sleep(0.05)
    return sorted(times), refused


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--only", nargs="*")
    options = parser.parse_args()
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        subprocess.run([options.program, "scene", "wheels", "-o", str(root / "shots"), "--frames", "1-3",
                        "--size", "960x540", "-q"], check=True)
        (root / "out").mkdir()
        (root / "users").write_text(USERS)
        server = Server([options.program, "serve", "--root", folder, "--store", str(root / "jobs.sqlite"),
                         "--port", "0", "--users", str(root / "users"), "--device", "software"])
        auth = {"Authorization": "Bearer " + "b" * 16}
        server.ask("POST", "/v1/jobs", {"chain": "fast", "input": "shots/sharp.####.exr", "frames": "2",
                                        "camera": "shots/camera.json", "output": "out/a.####.exr"}, auth)
        while b'"state":"done"' not in server.ask("GET", "/v1/jobs/1", headers=auth)[2].replace(b" ", b""):
            time.sleep(0.2)
        floods = {
            "none": None,
            "300 x GET /readyz": (300, request("GET /readyz")),
            "256 x image": (256, request(IMAGE, "ann")),
            "64 x preview": (64, request("POST /v1/preview", "ann", PREVIEW)),
            "300 x list": (300, request("GET /v1/jobs", "ann")),
            "4096 half headers": (4096, b"GET /v1/jobs HTTP/1.1\r\nHost: loc", ("127.0.0.2", "127.0.0.3"), True),
        }
        for name, flood in floods.items():
            if options.only and not any(word in name for word in options.only):
                continue
            with Flood(server.port, *flood) if flood else contextlib.nullcontext():
                for what, target in [("list", "/v1/jobs?limit=5"), ("thumbnail", "/v1/jobs/1/thumbnail.png")]:
                    times, refused = measure(server, target, options.seconds)
                    print(f"{name:20} {what:10} n {len(times):4}  median {times[len(times) // 2]:7.3f} s  "
                          f"99 % {times[int(0.99 * len(times))]:7.3f} s  not 200: {refused}", flush=True)
        server.stop()


if __name__ == "__main__":
    main()
