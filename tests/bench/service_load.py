"""The service under load: clients that poll and clients that listen, while jobs run; lost events,
failed requests, and the rate of frames against the same jobs without clients, in one run.

usage: service_load.py POSTCHAIN [--pollers N] [--listeners N] [--jobs N] [--frames N] [--json]

Both halves run the same jobs on one process, alternating (quiet, loaded, quiet, loaded), so that the
ratio does not depend on other load."""
import argparse
import asyncio
import datetime
import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from server import Server  # noqa: E402

LAST_EVENT_S = 60  # that the last event may take to all listeners


class Clients:
    """Listeners and pollers, in one thread, while the context is open."""

    def __init__(self, server, options):
        self.port, self.options = server.port, options
        self.seen = [[] for _ in range(options.listeners)]  # ids of events
        self.times, self.failed, self.closed = [], 0, 0  # of requests, seconds; requests; listeners
        self.connected, self.polling = threading.Barrier(2), True
        self.thread = threading.Thread(target=lambda: asyncio.run(self.run()))

    def __enter__(self):
        self.thread.start()
        self.connected.wait()
        return self

    def __exit__(self, *_):
        self.polling = False
        self.thread.join()

    async def request(self, line):
        """(reader, writer) of a connection that has sent it."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        writer.write(f"GET {line} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        return reader, writer

    async def listen(self, reader, ids):
        try:
            while True:
                event = await reader.readuntil(b"\n\n")
                if event.startswith(b"id: "):
                    ids.append(int(event[4:event.index(b"\n")]))
        except asyncio.IncompleteReadError:
            self.closed += 1

    async def poll(self, number):
        line = "/v1/jobs?limit=5"
        await asyncio.sleep(self.options.pause * number / self.options.pollers)
        start = time.monotonic()
        reader, writer = await self.request(line)
        try:
            while self.polling:
                head = (await reader.readuntil(b"\r\n\r\n")).lower()
                await reader.readexactly(int(head.split(b"content-length: ")[1].split(b"\r\n")[0]))
                self.failed += not head.startswith(b"http/1.1 200")
                self.times.append(time.monotonic() - start)
                await asyncio.sleep(self.options.pause)
                start = time.monotonic()
                writer.write(f"GET {line} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        except asyncio.IncompleteReadError:
            self.failed += 1
        writer.close()

    async def run(self):
        connections = [await self.request("/v1/events") for _ in self.seen]
        for reader, _ in connections:
            head = await reader.readuntil(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 200"), head
        listeners = [asyncio.create_task(self.listen(reader, ids))
                     for (reader, _), ids in zip(connections, self.seen)]
        self.connected.wait()
        await asyncio.gather(*(self.poll(i) for i in range(self.options.pollers)))
        end = time.monotonic() + LAST_EVENT_S
        while len({ids[-1] if ids else 0 for ids in self.seen}) > 1 and time.monotonic() < end:
            await asyncio.sleep(0.1)
        for listener in listeners:
            listener.cancel()
        for _, writer in connections:
            writer.close()

    def lost(self):
        """Events that one listener has received and another has not; ids have no gaps."""
        received = {number for ids in self.seen for number in ids}
        expected = range(min(received, default=0), max(received, default=-1) + 1)
        return sum(len(expected) - len(set(ids)) for ids in self.seen)


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
    ended, started = ([datetime.datetime.fromisoformat(job[key]) for job in done] for key in ("ended", "started"))
    return sum(job["done"] for job in done) / (max(ended) - min(started)).total_seconds()


def measure(server, options):
    """Values by their names."""
    run_jobs(server, 1, "warm")
    quiet, loaded, result, rounds = [], [], {}, []
    for k in range(options.rounds):
        quiet.append(run_jobs(server, options.jobs, f"quiet{k}"))
        with Clients(server, options) as clients:
            loaded.append(run_jobs(server, options.jobs, f"loaded{k}"))
            result["threads"], result["memory_mib"] = server.threads(), server.memory_kib() >> 10
        rounds.append(clients)
    times = sorted(seconds for one in rounds for seconds in one.times)
    lists = [ids for one in rounds for ids in one.seen]
    return result | {
        "listeners": options.listeners, "pollers": options.pollers,
        "events_received": sum(map(len, lists)), "events_lost": sum(one.lost() for one in rounds),
        "events_twice": sum(len(ids) - len(set(ids)) for ids in lists),
        "listeners_closed": sum(one.closed for one in rounds),
        "requests": len(times), "requests_failed": sum(one.failed for one in rounds),
        "request_median_ms": 1e3 * statistics.median(times), "request_p99_ms": 1e3 * times[int(0.99 * len(times))],
        "frames_per_s_quiet": quiet, "frames_per_s_loaded": loaded,
        "ratio": statistics.median(loaded) / statistics.median(quiet)}


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
        result = measure(server, options)
        result["exit_code"] = server.stop()
    if options.json:
        print(json.dumps(result))
    else:
        for key, value in result.items():
            print(f"{key:20} {value}")
    faults = ("events_lost", "events_twice", "listeners_closed", "requests_failed")
    return 1 if any(result[key] for key in faults) else 0


if __name__ == "__main__":
    sys.exit(main())
