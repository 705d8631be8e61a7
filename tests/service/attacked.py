"""Shared by the tests of hostile clients: a server over a fake service (serve_fake), so that nothing but
HTTP is tested. The first argument of the program is serve_fake."""
import json
import re
import sys
import unittest

from server import Server, parse, statuses

PROGRAM = sys.argv.pop(1)
GET = "GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n"
POST = "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


class Attacked(unittest.TestCase):
    command = [PROGRAM]
    settings = []

    @classmethod
    def setUpClass(cls):
        cls.server = Server(cls.command + cls.settings)

    @classmethod
    def tearDownClass(cls):
        code = cls.server.stop()
        assert code == 0, (code, cls.server.stderr)

    def tearDown(self):
        """After each attack the next client is served."""
        status, _, body = self.server.ask("GET", "/healthz")
        self.assertEqual((status, json.loads(body)), (200, {"status": "ok"}))

    def metric(self, name):
        text = self.server.ask("GET", "/metrics")[2].decode()
        return int(re.search(rf"^postchain_{name} (\d+)", text, re.M)[1])

    def refused(self, raw, *expected):
        """Exactly one reply, with one of these statuses: no part of `raw` became another request."""
        answer = self.server.send(raw.encode("latin1") if isinstance(raw, str) else raw)
        self.assertEqual(len(statuses(answer)), 1, answer)
        self.assertIn(statuses(answer)[0], expected, answer)
        status, headers, body = parse(answer)
        self.assertEqual(headers["content-type"], "application/problem+json")
        self.assertEqual(json.loads(body)["status"], status)
        return headers, json.loads(body)

    def previews(self, count):
        """Clients that have sent a preview each, and wait."""
        clients = [self.server.connect() for _ in range(count)]
        for client in clients:
            client.sendall(b"POST /v1/preview HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                           b"Content-Type: application/json\r\nContent-Length: 2\r\n\r\n{}")
        return clients

    def jobs(self):
        return len(json.loads(self.server.ask("GET", "/v1/jobs?limit=500")[2])["jobs"])
