"""What one client can take from the others: waiting requests, threads, connections. Clients are told apart
by X-Forwarded-For, as behind a proxy, or by their own addresses.

usage: isolation_test.py SERVE_FAKE"""
import select
import socket
import time
import unittest

from attacked import Attacked, GET
from server import PATIENCE_S, parse, read_all, statuses, wait_until

AT_ONCE_S = 5  # for a request that waits for nothing, on a busy machine


class Clients(Attacked):
    def previews_of(self, addresses):
        return [client for address in addresses for client in self.previews(1, f"X-Forwarded-For: {address}\r\n")]

    def ask_as(self, address, target, timeout=PATIENCE_S):
        return self.server.ask("GET", target, headers={"X-Forwarded-For": address}, timeout=timeout)[0]

    def waiting(self):
        """Without the request that asks."""
        return self.metric("http_waiting_requests") - 1


class Waiting(Clients):
    settings = ["trust_own=1", "max_waiting=12", "picture=600000"]

    def test_a_flood_leaves_places_and_threads(self):
        flood = self.previews_of(["192.0.2.1"] * 30)
        # Another address takes the places of the newest ones, and is served at once.
        for target in ("/v1/jobs", "/v1/browse?folder=x", "/v1/plan", "/healthz", "/readyz"):
            start = time.monotonic()
            self.assertIn(self.ask_as("192.0.2.2", target), (200, 405), target)
            self.assertLess(time.monotonic() - start, AT_ONCE_S, target)
        # The flood itself gets 429: for those over the limit, and for those that made way.
        refused = [client for client in flood if self.answered(client)]
        self.assertGreaterEqual(len(refused), 18)
        for client in refused:
            status, headers, _ = parse(read_all(client))
            self.assertEqual((status, headers["retry-after"]), (429, "1"))
        for client in flood:
            client.close()
        wait_until(lambda: self.waiting() == 0)

    @staticmethod
    def answered(client):
        client.settimeout(0.2)
        try:
            return bool(client.recv(1, socket.MSG_PEEK))
        except TimeoutError:
            return False
        finally:
            client.settimeout(PATIENCE_S)


class Networks(Clients):
    settings = ["trust_own=1", "max_waiting=4", "picture=600000"]

    def test_an_ipv6_network_is_one_client(self):
        flood = self.previews_of(f"2001:db8::{i:x}" for i in range(1, 5))
        # Its other addresses have no places of their own; those of another network have.
        wait_until(lambda: self.ask_as("2001:db8::ffff", "/v1/jobs") == 429)
        self.assertEqual(self.ask_as("2001:db8:0:1::1", "/v1/jobs"), 200)
        for client in flood:
            client.close()


class Departed(Clients):
    settings = ["picture=1000"]

    def test_work_of_clients_that_have_left_is_dropped(self):
        clients = [self.send("GET /v1/browse?folder=slow HTTP/1.1\r\nHost: localhost\r\n") for _ in range(40)]
        wait_until(lambda: self.metric("http_waiting_requests") >= 40)
        start = time.monotonic()
        for client in clients:
            client.close()
        wait_until(lambda: self.waiting() == 0)
        self.assertEqual(self.server.ask("GET", "/v1/browse?folder=x")[0], 200)
        self.assertLess(time.monotonic() - start, AT_ONCE_S)


class Endless(Clients):
    settings = ["trust_own=1", "working=1000"]

    def endless(self):
        return self.send("GET /v1/browse?folder=endless HTTP/1.1\r\nHost: localhost\r\n")

    def test_work_that_was_answered_503_ends(self):
        clients = [self.endless() for _ in range(40)]
        for client in clients:
            status, headers, body = parse(read_all(client))
            self.assertEqual((status, headers["retry-after"]), (503, "60"))
            self.assertIn(b"took longer than 1 s", body)
        # Every thread is free again.
        self.assertEqual(self.server.ask("GET", "/v1/browse?folder=x")[0], 200)


class Late(Clients):
    settings = ["working=1000", "picture=1500"]

    def test_an_answer_after_503_is_not_of_the_next_request(self):
        """The first request's answer comes half a second after its 503, while the second is under way."""
        with self.send("GET /v1/browse?folder=slow HTTP/1.1\r\nHost: localhost\r\n") as client:
            self.assertEqual(client.recv(12), b"HTTP/1.1 503")
            client.sendall(b"GET /v1/browse?folder=endless HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            rest = read_all(client)
            self.assertEqual(statuses(rest), [503], rest)


class Busy(Clients):
    settings = ["trust_own=1"]

    def test_it_is_not_ready_while_every_thread_is_busy(self):
        head = "GET /v1/browse?folder=endless HTTP/1.1\r\nHost: localhost\r\nX-Forwarded-For: 192.0.2."
        clients = [self.send(f"{head}{i}\r\n") for i in range(40)]
        wait_until(lambda: self.server.ask("GET", "/readyz")[0] == 503)
        why = self.server.get("/readyz")["why"]
        self.assertRegex(why, r"every thread of requests is busy, and the others have waited for 1\d s")
        for client in clients:
            client.close()
        wait_until(lambda: self.server.ask("GET", "/readyz")[0] == 200)


class Disks(Clients):
    settings = ["trust_own=1"]
    FILES = ["GET /v1/browse", "GET /v1/chains", "GET /v1/image?input=in.exr&frame=1", "POST /v1/plan", "POST /v1/preview",
             "POST /v1/jobs", "POST /v1/jobs/1/retry", "GET /v1/jobs/1/thumbnail.png",
             "GET /v1/jobs/1/report/index.html", "GET /v1/jobs/1/frames/1", "GET /v1/jobs/1/frames/1/output",
             "GET /v1/jobs/1/frames/1/before.png", "GET /v1/jobs/1/frames/1/after.png"]
    OTHERS = ["GET /v1/jobs", "GET /v1/jobs/1", "GET /v1/jobs/1/frames", "PATCH /v1/jobs/1", "DELETE /v1/jobs/1",
              "DELETE /v1/jobs/1/record", "POST /v1/chain/check", "GET /v1/user", "GET /healthz", "GET /readyz",
              "GET /metrics"]

    def sent(self, request, address):
        body = "{}" if request[0] == "P" and not request.endswith("retry") else ""
        return self.send(f"{request} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nX-Forwarded-For: {address}\r\n"
                         f"Content-Length: {len(body)}\r\n" + ("Content-Type: application/json\r\n" if body else ""),
                         body=body)

    def test_only_requests_that_read_files_wait_for_disks(self):
        clients = [self.sent("GET /v1/browse?folder=endless", f"192.0.2.{i}") for i in range(40)]
        wait_until(lambda: self.waiting() >= 40)
        waits = {self.sent(request, f"198.51.100.{i}"): request for i, request in enumerate(self.FILES)}
        for request in self.OTHERS:
            with self.sent(request, "203.0.113.1") as client:
                self.assertTrue(statuses(read_all(client)), request)
        answered, _, _ = select.select(list(waits), [], [], 0.5)
        self.assertEqual([waits[client] for client in answered], [])
        for client in [*clients, *waits]:
            client.close()


class Connections(Attacked):
    settings = ["max_connections=40", "max_connections_per_address=20"]

    def test_half_sent_headers_keep_nobody_out(self):
        with self.send(GET) as served:
            self.assertIn(b" 200 ", served.recv(100000))
            half = [self.send("GET /v1/jobs HTTP/1.1\r\nHost: loc", address)
                    for address in ("127.0.0.2", "127.0.0.3") for _ in range(60)]
            for target in ("/healthz", "/readyz", "/v1/jobs") * 5:
                self.assertEqual(self.server.ask("GET", target)[0], 200, target)
            self.assertLessEqual(self.metric("http_connections"), 41)
            # A connection that was served stays.
            served.sendall(GET.encode() + b"\r\n")
            self.assertIn(b" 200 ", served.recv(100000))
        for client in half:
            client.close()


class ConnectionsOfAClient(Attacked):
    settings = ["max_connections_per_address=3"]
    answers = [200, 200, 200, 429, 429]

    def test_are_limited(self):
        clients, answers = [], []
        for _ in self.answers:
            clients.append(self.send(GET, "127.0.0.2"))
            answers += statuses(clients[-1].recv(100000))
        for client in clients:
            client.close()
        self.assertEqual(answers, self.answers)


class ConnectionsOfAProxy(ConnectionsOfAClient):
    settings = ConnectionsOfAClient.settings + ["trust_own=1"]
    answers = [200] * 5


class Strangers(Attacked):
    users = {"ann": "1234567890123456"}
    settings = ["max_connections=40", "max_connections_per_address=40"]
    known = {"Authorization": "Bearer 1234567890123456"}

    def test_clients_without_a_token_make_way_for_those_with_one(self):
        strangers = [self.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n") for _ in range(60)]
        for _ in range(5):
            self.assertEqual(self.server.ask("GET", "/v1/jobs", headers=self.known)[0], 200)
        for client in strangers:
            client.close()

    def test_health_and_token_are_answered_when_it_is_full(self):
        ask = GET + "Authorization: Bearer 1234567890123456\r\n"
        held = [self.send(ask, address) for address in ("127.0.0.2", "127.0.0.3") for _ in range(20)]
        for client in held:
            self.assertIn(b" 200 ", client.recv(100000))
        for target in ("/healthz", "/readyz", "/v1/jobs"):
            self.assertEqual(self.server.ask("GET", target, headers=self.known)[0], 200, target)
        for target in ("/healthz", "/readyz"):
            self.assertEqual(self.server.ask("GET", target)[0], 200, target)
        with self.send(ask) as over:
            self.assertIn(b"Connection: close", over.recv(100000))
        for client in held:
            client.sendall(ask.encode() + b"\r\n")
            self.assertIn(b" 200 ", client.recv(100000))
            client.close()


if __name__ == "__main__":
    unittest.main()
