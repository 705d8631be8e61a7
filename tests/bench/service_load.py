"""The service under load: clients that poll and clients that listen, while jobs run; lost events,
failed requests, and the rate of frames against the same jobs without clients, in one run.

usage: service_load.py POSTCHAIN [--pollers N] [--listeners N] [--jobs N] [--frames N] [--json]

Both halves run the same jobs on one process, alternating (quiet, loaded, quiet, loaded), so that the
ratio does not depend on other load."""
import argparse
import json
import pathlib
import resource
import selectors
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from server import Server  # noqa: E402


class Listeners(threading.Thread):
    """All listeners in one thread; keeps the ids that each has received."""

    def __init__(self, server, count):
        super().__init__(daemon=True)
        self.selector = selectors.DefaultSelector()
        self.seen = [[] for _ in range(count)]
        self.rest = [b""] * count
        self.closed = 0
        self.running = True
        self.sockets = []
        for i in range(count):
            client = server.connect(30)
            client.sendall(b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.sockets.append(client)
        for i, client in enumerate(self.sockets):
            head = b""
            while b"\r\n\r\n" not in head:
                head += client.recv(4096)
            assert head.startswith(b"HTTP/1.1 200"), head
            client.setblocking(False)
            self.selector.register(client, selectors.EVENT_READ, i)

    def run(self):
        while self.running:
            for key, _ in self.selector.select(0.2):
                i = key.data
                data = key.fileobj.recv(65536)
                if not data:
                    self.closed += 1
                    self.selector.unregister(key.fileobj)
                    continue
                *texts, self.rest[i] = (self.rest[i] + data).split(b"\n\n")
                self.seen[i] += [int(text[4:text.index(b"\n")]) for text in texts
                                 if text.startswith(b"id: ")]

    def end(self):
        self.running = False
        self.join()
        for client in self.sockets:
            client.close()


class Pollers(threading.Thread):
    """Each polls a job, with pauses; all in one thread."""

    REQUEST = b"GET /v1/jobs?limit=5 HTTP/1.1\r\nHost: localhost\r\n\r\n"

    def __init__(self, server, count, pause):
        super().__init__(daemon=True)
        self.pause = pause
        self.clients = [server.connect(30) for _ in range(count)]
        for client in self.clients:
            client.setblocking(False)
        self.running = True
        self.times, self.failed = [], 0

    def run(self):
        count = len(self.clients)
        selector = selectors.DefaultSelector()
        for i, client in enumerate(self.clients):
            selector.register(client, selectors.EVENT_READ, i)
        now = time.monotonic()
        due = [now + self.pause * i / count for i in range(count)]
        sent, buffers = [None] * count, [b""] * count
        while self.running or any(sent):
            now = time.monotonic()
            for i in range(count):
                if self.running and sent[i] is None and now >= due[i]:
                    self.clients[i].send(self.REQUEST)
                    sent[i] = now
            for key, _ in selector.select(0.005):
                i = key.data
                data = key.fileobj.recv(65536)
                if not data:
                    self.failed += 1
                    sent[i] = None
                    due[i] = float("inf")
                    selector.unregister(key.fileobj)
                    continue
                buffers[i] += data
                head, found, body = buffers[i].partition(b"\r\n\r\n")
                if not found:
                    continue
                length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
                if len(body) < length:
                    continue
                self.failed += not head.startswith(b"HTTP/1.1 200")
                self.times.append(time.monotonic() - sent[i])
                buffers[i], sent[i], due[i] = b"", None, time.monotonic() + self.pause

    def end(self):
        self.running = False
        self.join()
        for client in self.clients:
            client.close()


def run_jobs(server, jobs, name):
    """Frames per second of these jobs, by the service's own times."""
    ids = []
    for k in range(jobs):
        status, _, body = server.ask("POST", "/v1/jobs", {
            "chain": "balanced", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
            "output": f"out/{name}_{k}.####.exr"})
        assert status == 202, body
        ids.append(json.loads(body)["id"])
    while True:
        done = [json.loads(server.ask("GET", f"/v1/jobs/{i}", timeout=60)[2]) for i in ids]
        assert not any(job["state"] in ("failed", "canceled") for job in done), done
        if all(job["state"] == "done" for job in done):
            break
        time.sleep(0.5)
    stamp = lambda text: time.mktime(time.strptime(text[:19], "%Y-%m-%dT%H:%M:%S")) \
        + int(text[20:23]) / 1000
    took = max(stamp(job["ended"]) for job in done) - min(stamp(job["started"]) for job in done)
    return sum(job["done"] for job in done) / took


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--pollers", type=int, default=200)
    parser.add_argument("--pause", type=float, default=1, help="seconds between two polls of one client")
    parser.add_argument("--listeners", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        subprocess.run([options.program, "scene", "wheels", "-o", str(root / "shots"), "--frames",
                        f"1-{options.frames}", "--size", options.size, "-q"], check=True)
        (root / "out").mkdir()
        server = Server([options.program, "serve", "--root", folder, "--store",
                         str(root / "jobs.sqlite"), "--port", "0"])
        run_jobs(server, 1, "warm")
        quiet, loaded, result = [], [], {}
        times, failed, lost, twice, closed, seen = [], 0, 0, 0, 0, 0
        for k in range(options.rounds):
            quiet.append(run_jobs(server, options.jobs, f"quiet{k}"))
            listeners = Listeners(server, options.listeners)
            pollers = Pollers(server, options.pollers, options.pause)
            listeners.start()
            pollers.start()
            first = max_id(server)
            loaded.append(run_jobs(server, options.jobs, f"loaded{k}"))
            last = max_id(server)
            result["threads"], result["memory_mib"] = server.threads(), server.memory_kib() >> 10
            pollers.end()
            time.sleep(2)
            listeners.end()
            expected = set(range(first + 1, last + 1))
            for ids in listeners.seen:
                lost += len(expected - set(ids))
                twice += len(ids) - len(set(ids))
                seen += len(ids)
            closed += listeners.closed
            failed += pollers.failed
            times += pollers.times
        code = server.stop()
        times.sort()
        result |= {
            "listeners": options.listeners, "pollers": options.pollers,
            "events_received": seen, "events_lost": lost, "events_twice": twice,
            "listeners_closed": closed, "requests": len(times), "requests_failed": failed,
            "request_median_ms": 1e3 * statistics.median(times),
            "request_p99_ms": 1e3 * times[int(0.99 * len(times))],
            "frames_per_s_quiet": quiet, "frames_per_s_loaded": loaded,
            "ratio": statistics.median(loaded) / statistics.median(quiet), "exit_code": code}
    if options.json:
        print(json.dumps(result))
    else:
        for key, value in result.items():
            print(f"{key:20} {value}")
    return 0 if not (lost or twice or closed or failed) else 1


def max_id(server):
    """Id of the last event; ids have no gaps."""
    low, high = 0, 1 << 20
    while low < high:
        middle = (low + high) // 2
        with server.connect() as client:
            client.sendall(f"GET /v1/events?after={middle} HTTP/1.1\r\nHost: localhost\r\n\r\n"
                           .encode())
            client.settimeout(0.3)
            got = b""
            try:
                while b"\nid: " not in got and not got.startswith(b"id: "):
                    data = client.recv(65536)
                    if not data:
                        break
                    got += data
                    if b"id: " in got:
                        break
            except TimeoutError:
                pass
        if b"id: " in got:
            low = middle + 1
        else:
            high = middle
    return low


if __name__ == "__main__":
    sys.exit(main())
