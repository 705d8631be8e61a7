"""The latency of one user's requests while another client floods the service in one of several ways: the
list of jobs, and a thumbnail of a job; the median, 99 %, and replies other than 200. Then the largest
resident memory meanwhile, of the service and of all its processes together. A last row asks for an image
of 16384 x 16384 pixels (made by oiiotool).

usage: service_floods.py POSTCHAIN [--seconds N] [--only FLOOD ...]"""
import argparse
import contextlib
import pathlib
import re
import resource
import shutil
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


def request(line, user=None, body="", accept="*/*"):
    token = f"Authorization: Bearer {user[0] * 16}\r\n" if user else ""
    kind = f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n" if body else ""
    return f"{line} HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\n{token}{kind}\r\n{body}".encode()


PREVIEW = ('{"chain": "best", "input": "shots/sharp.####.exr", "camera": "shots/camera.json", "frame": 2}')
IMAGE = "GET /v1/image?input=shots/sharp.%23%23%23%23.exr&frame=2&side=4096"
# Its reply is an EXR of 3840 x 2160 pixels.
LARGE_PREVIEW = '{"chain": "paper", "input": "large/sharp.####.exr", "camera": "large/camera.json", "frame": 1}'
HUGE_IMAGE = "/v1/image?input=huge.%23%23%23%23.exr&frame=1&side=320"
HUGE_SIDE = 16384


def keys(count, entry, end=""):
    return "".join(f"{entry.format(i)}{end if i + 1 < count else ''}" for i in range(count))


# About a megabyte each, wide in one place; wide.json is a camera file of 60,000 keys.
WIDE_BODIES = [
    ("/v1/jobs", "{" + keys(80_000, '"k{}": 1', ",") + "}"),
    ("/v1/jobs", '{"chain": "fast", "output": "out/w.####.exr", "input": "color=' + "," * 1_000_000 + '"}'),
    ("/v1/jobs", '{"chain": "fast", "input": "shots/sharp.####.exr", "output": "out/w.####.exr", "frames": "'
     + keys(100_000, "1-500000", ",") + '"}'),
    ("/v1/chain/check", '{"text": "' + keys(70_000, "k{}: 1\\n") + '"}'),
    ("/v1/chain/check", '{"text": "[' + "a:," * 300_000 + 'a]"}'),
    ("/v1/plan", '{"chain": "fast", "input": "shots/sharp.####.exr", "camera": "wide.json"}'),
]


class Flood:
    """Connections that send one request after the other, while the context is open."""

    def __init__(self, port, count, texts, addresses=("127.0.0.1",), once=False):
        self.port, self.count, self.addresses, self.once = port, count, addresses, once
        self.texts = texts if isinstance(texts, list) else [texts]
        self.going, self.sockets, self.lock = True, [], threading.Lock()
        self.threads = [threading.Thread(target=self.run, args=(i,), daemon=True)
                        for i in range(1 if once else count)]

    def connect(self, i):
        client = socket.create_connection(("127.0.0.1", self.port), PATIENCE_S,
                                          source_address=(self.addresses[i % len(self.addresses)], 0))
        with self.lock:
            self.sockets.append(client)
        client.sendall(self.texts[i % len(self.texts)])
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
                    client.sendall(self.texts[number % len(self.texts)])
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


class Memory:
    """The largest resident memory of the service, and of it with its children, in MiB."""

    def __init__(self, process):
        self.process, self.own, self.all, self.ends = process, 0, 0, threading.Event()
        self.thread = threading.Thread(target=self.watch, daemon=True)

    @staticmethod
    def resident(process):
        try:
            text = pathlib.Path(f"/proc/{process}/status").read_text("ascii")
            return int(re.search(r"VmRSS:\s+(\d+)", text)[1]) / 1024
        except (OSError, TypeError):
            return 0  # it has ended

    def watch(self):
        while not self.ends.wait(0.05):
            own = self.resident(self.process)
            children = [file.read_text("ascii").split()
                        for file in pathlib.Path(f"/proc/{self.process}/task").glob("*/children")]
            self.own = max(self.own, own)
            self.all = max(self.all, own + sum(self.resident(one) for some in children for one in some))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.ends.set()
        self.thread.join()


class HugeImage:
    """One request for the huge image while the context is open; then its duration and status."""

    def __init__(self, server):
        self.server, self.thread = server, threading.Thread(target=self.ask)
        self.seconds, self.status = 0, 0

    def ask(self):
        start = time.monotonic()
        self.status, _, body = self.server.ask("GET", HUGE_IMAGE, timeout=PATIENCE_S,
                                               headers={"Authorization": "Bearer " + "a" * 16})
        self.seconds = time.monotonic() - start
        if self.status != 200:
            print(body[:300])

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.thread.join()
        print(f"huge image: status {self.status}, {self.seconds:.1f} s")


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
        subprocess.run([options.program, "scene", "wheels", "-o", str(root / "large"), "--frames", "1",
                        "--size", "3840x2160", "-q"], check=True)
        if shutil.which("oiiotool"):
            subprocess.run(["oiiotool", "--pattern", "fill:topleft=0,0,0:bottomright=1,0.5,0.25",
                            f"{HUGE_SIDE}x{HUGE_SIDE}", "3", "-d", "half", "-o", str(root / "huge.0001.exr")],
                           check=True)
        (root / "out").mkdir()
        (root / "wide.json").write_text("{" + keys(60_000, '"k{}": 1', ",") + "}")
        (root / "users").write_text(USERS)
        server = Server([options.program, "serve", "--root", folder, "--store", str(root / "jobs.sqlite"),
                         "--port", "0", "--users", str(root / "users"), "--device", "software"])
        auth = {"Authorization": "Bearer " + "b" * 16}
        server.ask("POST", "/v1/jobs", {"chain": "fast", "input": "shots/sharp.####.exr", "frames": "2",
                                        "camera": "shots/camera.json", "output": "out/a.####.exr"}, auth)
        while b'"state":"done"' not in server.ask("GET", "/v1/jobs/1", headers=auth)[2].replace(b" ", b""):
            time.sleep(0.2)
        wide = [request(f"POST {target}", "ann", body) for target, body in WIDE_BODIES]
        floods = {
            "none": None,
            "300 x GET /readyz": (300, request("GET /readyz")),
            "256 x image": (256, request(IMAGE, "ann")),
            "64 x preview": (64, request("POST /v1/preview", "ann", PREVIEW)),
            "300 x list": (300, request("GET /v1/jobs", "ann")),
            "4096 half headers": (4096, b"GET /v1/jobs HTTP/1.1\r\nHost: loc", ("127.0.0.2", "127.0.0.3"), True),
            "100 slow readers": (100, request("POST /v1/preview", "ann", LARGE_PREVIEW, "image/x-exr"),
                                 ("127.0.0.2", "127.0.0.3"), True),
            "500 unread streams": (500, request("GET /v1/events?after=0", "ann"), ("127.0.0.1",), True),
            "6 wide bodies": (6, wide),
            "40 wide bodies": (40, wide),
            "image of 16384": HugeImage(server),
        }
        if not shutil.which("oiiotool"):
            del floods["image of 16384"]
        for name, flood in floods.items():
            if options.only and not any(word in name for word in options.only):
                continue
            flooding = (flood if isinstance(flood, HugeImage) else
                        Flood(server.port, *flood) if flood else contextlib.nullcontext())
            with Memory(server.process.pid) as memory, flooding:
                for what, target in [("list", "/v1/jobs?limit=5"), ("thumbnail", "/v1/jobs/1/thumbnail.png")]:
                    times, refused = measure(server, target, options.seconds)
                    print(f"{name:20} {what:10} n {len(times):4}  median {times[len(times) // 2]:7.3f} s  "
                          f"99 % {times[int(0.99 * len(times))]:7.3f} s  not 200: {refused}", flush=True)
            print(f"{name:20} memory {memory.own:5.0f} MiB, with all processes {memory.all:5.0f}", flush=True)
        server.stop()


if __name__ == "__main__":
    main()
