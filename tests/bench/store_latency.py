"""Latency of each route of `postchain serve` with a large store: 2000 ended jobs of 1 MiB.

usage: store_latency.py POSTCHAIN [--jobs N] [--kib N] [--repeats N] [--beside N]

The rows are written into an empty store of the program. `--beside`: clients that search without a pause
meanwhile. Prints median and largest time of each route in milliseconds."""
import argparse
import json
import pathlib
import sqlite3
import statistics
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "service"))
from server import Server, make_scene, serve_command, wait_until  # noqa: E402


def fill(path, jobs, kib):
    """Ended jobs with one frame and two events each."""
    with sqlite3.connect(path) as store:
        apart = store.execute("SELECT 1 FROM sqlite_master WHERE name = 'requests'").fetchone()
        for number in range(1, jobs + 1):
            about = {"input": f"shots/s{number:04}/sharp.####.exr", "chain": "balanced",
                     "output": f"out/s{number:04}.####.exr"}
            body = json.dumps({"kind": "run", **about, "chain_text": "#" * (kib * 1024)})
            row = {"id": number, "kind": "run", "state": "done", "priority": 0, "key": "",
                   "created_ms": 1_700_000_000_000 + number, "started_ms": 1_700_000_000_001 + number,
                   "ended_ms": 1_700_000_000_002 + number, "frames": 1, "done": 1, "bytes": 1000,
                   "about": json.dumps(about)}
            row |= {"names": " ".join(about.values()), "ended_event": 2 * number} if apart else {"body": body}
            store.execute(f"INSERT INTO jobs({', '.join(row)}) VALUES({', '.join('?' * len(row))})",
                          list(row.values()))
            if apart:
                store.execute("INSERT INTO requests VALUES(?, ?)", (number, body))
            store.execute("INSERT INTO frames(job, place, frame, state, output) VALUES(?, 0, 1, 'written', ?)",
                          (number, about["output"].replace("####", "0001")))
            for kind in ("queued", "done"):
                store.execute("INSERT INTO events(job, time_ms, type, data) VALUES(?, ?, ?, '{}')",
                              (number, row["ended_ms"], kind))
    store.close()


def measure(server, options):
    middle = options.jobs // 2
    times = {}

    def timed(name, method, target, body=None, good=(200, 202, 204)):
        begin = time.monotonic()
        status, _, answer = server.ask(method, target, body)
        times.setdefault(name, []).append((time.monotonic() - begin) * 1e3)
        if status not in good:
            raise SystemExit(f"{name}: {status} {answer[:300]}")
        return answer

    reads = {"GET /v1/jobs": "/v1/jobs", "GET /v1/jobs?limit=500": "/v1/jobs?limit=500",
             "GET /v1/jobs?state=failed": "/v1/jobs?state=failed",
             "GET /v1/jobs?owner=nobody": "/v1/jobs?owner=nobody",
             "GET /v1/jobs?search= of one": f"/v1/jobs?search=s{middle:04}",
             "GET /v1/jobs?search= of none": "/v1/jobs?search=absent",
             "GET /v1/jobs/{id}": f"/v1/jobs/{middle}",
             "GET /v1/jobs/{id}/frames": f"/v1/jobs/{middle}/frames",
             "GET /v1/jobs/{id}/frames/{n}": f"/v1/jobs/{middle}/frames/1",
             "GET /v1/jobs/{id}/events": f"/v1/jobs/{middle}/events",
             "GET /metrics": "/metrics", "GET /readyz": "/readyz"}
    for _ in range(options.repeats):
        for name, target in reads.items():
            timed(name, "GET", target, good=(200, 404))
    for n in range(options.repeats):
        body = {"chain": "paper", "input": "shots/sharp.####.exr", "camera": "shots/camera.json",
                "output": f"out/new{n}.####.exr", "mkdir": True, "priority": 1}
        job = json.loads(timed("POST /v1/jobs", "POST", "/v1/jobs", body))["id"]
        timed("PATCH /v1/jobs/{id}", "PATCH", f"/v1/jobs/{job}", {"priority": 2})
        timed("DELETE /v1/jobs/{id}", "DELETE", f"/v1/jobs/{job}")
        timed("POST /v1/jobs/{id}/retry", "POST", f"/v1/jobs/{job}/retry")
        server.ask("DELETE", f"/v1/jobs/{job}")
        # Its process may end a frame first.
        wait_until(lambda: b'"id"' in timed("DELETE /v1/jobs/{id}/record", "DELETE", f"/v1/jobs/{job}/record",
                                             good=(200, 409)))
    return times


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("postchain")
    arguments.add_argument("--jobs", type=int, default=2000)
    arguments.add_argument("--kib", type=int, default=1024)
    arguments.add_argument("--repeats", type=int, default=9)
    arguments.add_argument("--beside", type=int, default=0)
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        make_scene(options.postchain, root / "shots", "1-2", "64x36")
        command = serve_command(options.postchain, root, "--keep-jobs", "1000000")
        Server(command).stop()
        fill(root / "jobs.sqlite", options.jobs, options.kib)
        begin = time.monotonic()
        server = Server(command)
        print(f"start: {time.monotonic() - begin:.1f} s")
        ends = threading.Event()

        def search():
            while not ends.is_set():
                server.ask("GET", "/v1/jobs?search=absent")

        clients = [threading.Thread(target=search) for _ in range(options.beside)]
        for client in clients:
            client.start()
        times = measure(server, options)
        ends.set()
        for client in clients:
            client.join()
        server.stop()
    for name, of in times.items():
        print(f"| `{name}` | {statistics.median(of):.1f} | {max(of):.1f} |")


if __name__ == "__main__":
    main()
