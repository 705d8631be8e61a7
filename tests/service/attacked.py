"""Shared by the tests of hostile clients: a server over a fake service (serve_fake), so that nothing but
HTTP is tested. The first argument of the program is serve_fake."""
import json
import pathlib
import re
import socket
import sys
import tempfile
import unittest

from server import PATIENCE_S, Server, parse, statuses, token_hash

PROGRAM = sys.argv.pop(1)
GET = "GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n"
POST = "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


class Attacked(unittest.TestCase):
    command = [PROGRAM]
    settings = []
    users = {}  # tokens by name

    @classmethod
    def setUpClass(cls):
        users = []
        if cls.users:
            cls.path = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "users.yaml"
            cls.write_users(cls.users)
            users = [f"users={cls.path}"]
        cls.server = Server(cls.command + users + cls.settings)

    @classmethod
    def write_users(cls, users):
        cls.path.write_text("postchain_users: 1\nusers:\n" + "".join(
            f"  {name}: {{tokens: [{token_hash(token)}]}}\n" for name, token in users.items()))

    @classmethod
    def tearDownClass(cls):
        code = cls.server.stop()
        assert code == 0, (code, cls.server.stderr)

    def tearDown(self):
        """After each attack the next client is served."""
        status, _, body = self.server.ask("GET", "/healthz")
        self.assertEqual((status, json.loads(body)), (200, {"status": "ok"}))

    def metric(self, name):
        """0 before its first value."""
        text = self.server.ask("GET", "/metrics")[2].decode()
        found = re.search(rf"^postchain_{name} (\S+)", text, re.M)
        return float(found[1]) if found else 0

    def refused(self, raw, *expected):
        """Exactly one reply, with one of these statuses: no part of `raw` became another request."""
        answer = self.server.send(raw.encode("latin1") if isinstance(raw, str) else raw)
        self.assertEqual(len(statuses(answer)), 1, answer)
        self.assertIn(statuses(answer)[0], expected, answer)
        status, headers, body = parse(answer)
        self.assertEqual(headers["content-type"], "application/problem+json")
        self.assertEqual(json.loads(body)["status"], status)
        return headers, json.loads(body)

    def send(self, head, address="127.0.0.1", body=""):
        """A client of this address that has sent the lines of a head, and waits."""
        client = socket.create_connection(("127.0.0.1", self.server.port), PATIENCE_S, source_address=(address, 0))
        client.sendall((head + "\r\n" + body).encode())
        return client

    def previews(self, count, more=""):
        """Clients that have sent a preview each."""
        return [self.send("POST /v1/preview HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                          f"Content-Type: application/json\r\nContent-Length: 2\r\n{more}", body="{}")
                for _ in range(count)]

    def jobs(self):
        return len(json.loads(self.server.ask("GET", "/v1/jobs?limit=500")[2])["jobs"])
