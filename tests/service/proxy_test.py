"""The service behind nginx and Caddy, by the recipes of tools/packaging/service: page, requests,
events as they happen, downloads. Skips a proxy that is not installed.

usage: proxy_test.py SERVE_FAKE"""
import json
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from server import PATIENCE_S, Server, wait_until  # noqa: E402
from skips import skip, skipped  # noqa: E402

PROGRAM = None
RECIPES = pathlib.Path(__file__).resolve().parents[2] / "tools/packaging/service"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def found(program):
    return shutil.which(program, path="/usr/sbin:/usr/bin:/sbin:/bin")


class Behind:
    """Tests of both."""

    def setUp(self):
        if not found(self.program):
            self.skipTest(f"{self.program} is not installed")
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.server = Server([PROGRAM, "trust_own=1", "base=1", "heartbeat=600000"])
        self.addCleanup(self.server.stop)
        self.port = free_port()
        self.proxy = subprocess.Popen(self.command(), stdout=subprocess.DEVNULL)
        self.addCleanup(self.stop)
        wait_until(self.listens)

    def listens(self):
        with socket.socket() as client:
            if client.connect_ex(("127.0.0.1", self.port)) == 0:
                return True
        self.assertIsNone(self.proxy.poll(), "the proxy has ended")
        return False

    def stop(self):
        self.proxy.terminate()
        self.proxy.wait(timeout=30)

    def recipe(self, name):
        text = (RECIPES / name).read_text().replace("/postchain", "/base")
        self.assertEqual(text.count("127.0.0.1:8080"), 1)
        return text.replace("127.0.0.1:8080", f"127.0.0.1:{self.server.port}")

    def get(self, path, headers=None, body=None):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", body,
                                         headers or {})
        return urllib.request.urlopen(request, timeout=PATIENCE_S)

    def test_page_requests_and_downloads(self):
        page = self.get("/base/").read().decode()
        # Every file that the page names, and every address in its script, is below the page.
        script = self.get("/base/page/main.js").read().decode()
        for name in re.findall(r'(?:href|src)="([^"#]+)"', page):
            self.assertEqual(self.get("/base/" + name).status, 200, name)
        self.assertEqual(re.findall(r'["`]/(?:v1|page|readyz|openapi)', page + script), [])
        # As a browser sends it, with the port of the proxy.
        made = self.get("/base/v1/jobs", {"Content-Type": "application/json",
                                          "Origin": f"http://127.0.0.1:{self.port}",
                                          "Sec-Fetch-Site": "same-origin"}, b"{}")
        self.assertGreater(len(made.headers["X-Request-Id"]), 30, "is that of the proxy")
        self.assertEqual((made.status, made.headers["Location"]), (202, "jobs/j1"))
        self.assertEqual(self.get("/base/v1/" + made.headers["Location"]).status, 200)
        data = self.get("/base/v1/jobs/j1/frames/2/output").read()
        self.assertEqual(data, b"2" * 600_000)
        self.assertEqual(self.get("/base/v1/jobs/j1/report/index.html").status, 200)

    def test_events_come_as_they_happen(self):
        """The job waits until its first event has come: a buffer would keep it."""
        self.get("/base/v1/jobs", {"Content-Type": "application/json"}, b"{}")
        types = []
        with self.get("/base/v1/jobs/j1/events") as events:
            for line in events:
                if line.startswith(b"data: "):
                    types.append(json.loads(line[6:])["type"])
                    if types == ["queued"]:
                        self.server.ask("DELETE", "/base/v1/jobs/j1")
        self.assertEqual(types, ["queued", "canceled"])


class Nginx(Behind, unittest.TestCase):
    program = "nginx"

    def command(self):
        folders = "".join(f"    {kind}_temp_path {self.path}/{kind};\n"
                          for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        (self.path / "nginx.conf").write_text(
            f"daemon off;\nmaster_process off;\npid {self.path}/pid;\nerror_log stderr;\n"
            "events { }\nhttp {\n    access_log off;\n" + folders +
            "    limit_conn_zone $binary_remote_addr zone=postchain:10m;\n" +
            f"    server {{\n        listen 127.0.0.1:{self.port};\n" + self.recipe("nginx.conf") +
            "    }\n}\n")
        return [found("nginx"), "-e", "stderr", "-c", str(self.path / "nginx.conf")]


class Caddy(Behind, unittest.TestCase):
    program = "caddy"

    def command(self):
        (self.path / "Caddyfile").write_text(
            "{\n    admin off\n    auto_https off\n}\n"
            f"http://127.0.0.1:{self.port} {{\n" + self.recipe("Caddyfile") + "}\n")
        return ["caddy", "run", "--adapter", "caddyfile", "--config", str(self.path / "Caddyfile")]


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    missing = {program: package for program, package in (("nginx", "nginx-light"), ("caddy", "caddy"))
               if not found(program)}
    if missing:
        (skip if len(missing) == 2 else skipped)(
            f"the service behind {' and '.join(missing)}: not installed", *missing.values())
    unittest.main()
