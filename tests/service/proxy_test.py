"""The service behind nginx and Caddy, by the recipes of tools/packaging/service, which log people in: page,
requests, events as they happen, downloads, users, pages of other sites. Skips a proxy that is not installed.

usage: proxy_test.py SERVE_FAKE"""
import base64
import http.server
import json
import pathlib
import random
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
import urllib.error
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from server import PATIENCE_S, Server, token_hash, wait_until  # noqa: E402
from skips import skip, skipped  # noqa: E402

PROGRAM = None
TOKEN, PASSWORD = "f" * 20, "secret"
RECIPES = pathlib.Path(__file__).resolve().parents[2] / "tools/packaging/service"


def free_port():
    """Below the ports that the system gives to connections: one of those may be taken before the proxy listens."""
    while True:
        with socket.socket() as probe:
            port = random.randrange(10000, 30000)
            if probe.connect_ex(("127.0.0.1", port)) != 0:
                return port


def found(program):
    return shutil.which(program, path="/usr/sbin:/usr/bin:/sbin:/bin")


class SingleSignOn(http.server.BaseHTTPRequestHandler):
    """Knows who has logged in by a cookie."""

    def do_GET(self):
        login = re.search(r"login=(\w+)", self.headers["Cookie"] or "")
        self.send_response(200 if login else 401)
        if login:
            self.send_header("X-Auth-Request-User", login[1])
        self.end_headers()

    def log_message(self, *_):
        pass


class Behind:
    """Tests of both, with passwords."""

    def setUp(self):
        if not found(self.program):
            self.skipTest(f"{self.program} is not installed")
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        users = self.path / "users.yaml"
        users.write_text("postchain_users: 1\nusers:\n  ann: {}\n  ops: {admin: true}\n"
                         f"  farm: {{tokens: [{token_hash(TOKEN)}]}}\n")
        self.server = Server([PROGRAM, "trust_own=1", "heartbeat=600000", f"users={users}",
                              "user_header=X-Remote-User"])
        self.addCleanup(self.server.stop)
        self.log_in = self.enterContext(http.server.ThreadingHTTPServer(("127.0.0.1", 0), SingleSignOn))
        threading.Thread(target=self.log_in.serve_forever, daemon=True).start()
        self.addCleanup(self.log_in.shutdown)
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

    @staticmethod
    def logged_in(name):
        """What a browser sends of itself."""
        return {"Authorization": "Basic " + base64.b64encode(f"{name}:{PASSWORD}".encode()).decode()}

    def recipe(self, name):
        text = (RECIPES / name).read_text()
        self.assertEqual((text.count("127.0.0.1:8080"), text.count("127.0.0.1:4180")), (1, 1))
        return (text.replace("127.0.0.1:8080", f"127.0.0.1:{self.server.port}")
                .replace("127.0.0.1:4180", f"127.0.0.1:{self.log_in.server_port}"))

    @staticmethod
    def with_single_sign_on(recipe, *lines):
        """Without the recipe's lines of passwords, with those in place of them."""
        for line in lines:
            assert recipe.count(line) == 1, line
            recipe = recipe.replace(line, "")
        return recipe.replace("#|", "")

    def get(self, path, headers=None, body=None, user="ann"):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", body,
                                         (self.logged_in(user) if user else {}) | (headers or {}))
        return urllib.request.urlopen(request, timeout=PATIENCE_S)

    def status(self, *arguments, **more):
        try:
            return self.get(*arguments, **more).status
        except urllib.error.HTTPError as error:
            return error.code

    def test_page_requests_and_downloads(self):
        page = self.get("/postchain/").read().decode()
        self.assertEqual(self.get("/postchain").read().decode(), page)
        # Every file that the page names, and every address in its script, is below the page.
        script = self.get("/postchain/page/main.js").read().decode()
        for name in re.findall(r'(?:href|src)="([^"#]+)"', page):
            self.assertEqual(self.get("/postchain/" + name).status, 200, name)
        self.assertEqual(re.findall(r'["`]/(?:v1|page|readyz|openapi)', page + script), [])
        # As a browser sends it, with the port of the proxy.
        made = self.get("/postchain/v1/jobs", {"Content-Type": "application/json",
                                          "Origin": f"http://127.0.0.1:{self.port}",
                                          "Sec-Fetch-Site": "same-origin"}, b"{}")
        self.assertGreater(len(made.headers["X-Request-Id"]), 30, "is that of the proxy")
        self.assertEqual((made.status, made.headers["Location"]), (202, "jobs/j1"))
        self.assertEqual(self.get("/postchain/v1/" + made.headers["Location"]).status, 200)
        data = self.get("/postchain/v1/jobs/j1/frames/2/output").read()
        self.assertEqual(data, b"2" * 600_000)
        self.assertEqual(self.get("/postchain/v1/jobs/j1/report/index.html").status, 200)

    def test_events_come_as_they_happen(self):
        """The job waits until its first event has come: a buffer would keep it."""
        self.get("/postchain/v1/jobs", {"Content-Type": "application/json"}, b"{}")
        types = []
        with self.get("/postchain/v1/jobs/j1/events") as events:
            for line in events:
                if line.startswith(b"data: "):
                    types.append(json.loads(line[6:])["type"])
                    if types == ["queued"]:
                        self.server.ask("DELETE", "/v1/jobs/j1", None, {"X-Remote-User": "ops"})
        self.assertEqual(types, ["queued", "canceled"])

    def test_users(self):
        def user(**more):
            return json.loads(self.get("/postchain/v1/user", **more).read())["user"]
        token, claim = {"Authorization": f"Bearer {TOKEN}"}, {"X-Remote-User": "ops"}
        self.assertEqual([user(), user(user="ops"), user(headers=token, user=None)], ["ann", "ops", "farm"])
        self.assertEqual(self.status("/postchain/v1/user", user="eve"), 403, "is not in the file")
        # A client's own header counts for nothing.
        self.assertEqual([user(headers=claim), user(headers=claim | token, user=None)], ["ann", "farm"])
        for headers in ({}, claim, {"Authorization": "Bearer wrong"}, claim | {"Authorization": "Bearer wrong"}):
            for path in ("/postchain/v1/user", "/postchain/v1/jobs"):
                self.assertEqual(self.status(path, headers, user=None), 401, headers)

    def test_pages_of_other_sites_change_nothing(self):
        """A browser sends the password or the cookie by itself, from those too."""
        body = {"Content-Type": "application/json"}
        for headers in ({"Origin": "https://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"},
                        {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "navigate"},
                        {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"}):
            for path, more in (("/postchain/v1/jobs", body), ("/postchain/v1/jobs/j1/retry", {})):
                self.assertEqual(self.status(path, more | headers, b"{}" if more else b""), 403, headers)
        self.assertEqual(json.loads(self.get("/postchain/v1/jobs").read())["jobs"], [])
        link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
        self.assertEqual(self.status("/postchain/", link), 200)


class Nginx(Behind, unittest.TestCase):
    program = "nginx"

    def location(self):
        passwords = self.path / "passwords"
        passwords.write_text("".join(f"{name}:{{PLAIN}}{PASSWORD}\n" for name in ("ann", "ops", "eve")))
        return self.recipe("nginx.conf").replace("/etc/nginx/postchain.passwords", str(passwords))

    def command(self):
        folders = "".join(f"    {kind}_temp_path {self.path}/{kind};\n"
                          for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        location = self.location()
        of_http = "".join(line[1:] for line in location.splitlines(True) if re.match("#   (map|limit_conn_zone) ", line))
        (self.path / "nginx.conf").write_text(
            f"daemon off;\nmaster_process off;\npid {self.path}/pid;\nerror_log stderr;\n"
            "events { }\nhttp {\n    access_log off;\n" + folders + of_http +
            f"    server {{\n        listen 127.0.0.1:{self.port};\n" + location + "    }\n}\n")
        return [found("nginx"), "-e", "stderr", "-c", str(self.path / "nginx.conf")]


class Caddy(Behind, unittest.TestCase):
    program = "caddy"

    def site(self):
        hashed = subprocess.run(["caddy", "hash-password", "--plaintext", PASSWORD], check=True, capture_output=True,
                                text=True).stdout.strip()
        return self.recipe("Caddyfile").replace(
            "ann HASH", "\n".join(f"{name} {hashed}" for name in ("ann", "ops", "eve")))

    def command(self):
        (self.path / "Caddyfile").write_text(
            "{\n    admin off\n    auto_https off\n}\n"
            f"http://127.0.0.1:{self.port} {{\n" + self.site() + "}\n")
        return ["caddy", "run", "--adapter", "caddyfile", "--config", str(self.path / "Caddyfile")]


class SignedOn:
    @staticmethod
    def logged_in(name):
        return {"Cookie": f"login={name}"}


class NginxWithSingleSignOn(SignedOn, Nginx):
    def location(self):
        return self.with_single_sign_on(
            self.recipe("nginx.conf"), "    auth_basic $postchain_realm;\n",
            "    auth_basic_user_file /etc/nginx/postchain.passwords;\n",
            "    proxy_set_header X-Remote-User $remote_user;\n")


class CaddyWithSingleSignOn(SignedOn, Caddy):
    def site(self):
        return self.with_single_sign_on(
            self.recipe("Caddyfile"), "        basicauth @person {\n            ann HASH\n        }\n",
            "        request_header @person X-Remote-User {http.auth.user.id}\n")


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    missing = {program: package for program, package in (("nginx", "nginx-light"), ("caddy", "caddy"))
               if not found(program)}
    if missing:
        (skip if len(missing) == 2 else skipped)(
            f"the service behind {' and '.join(missing)}: not installed", *missing.values())
    unittest.main()
