"""Slow, silent and many clients, a disk that hangs, and listeners, while other clients are served.

usage: load_test.py SERVE_FAKE"""
import json
import socket
import struct
import time
import unittest

from attacked import Attacked, POST, PROGRAM
from server import Events, PATIENCE_S, Server, parse, read_all, wait_until

TYPES = ["queued", "started"] + ["frame"] * 4 + ["done"]  # events of a job


def open_after(client):
    """Whether the server has not closed the connection in time."""
    try:
        while client.recv(65536):
            pass
    except ConnectionResetError:
        pass
    except TimeoutError:
        return True
    return False


class Slow(Attacked):
    settings = ["header=2000", "body=2000", "write=2000", "heartbeat=300", "event_bytes=50000", "kept_events=10"]

    def drip(self, client, data):
        """Sends a byte every 0.1 s. Whether the server closes."""
        for i in range(10 * PATIENCE_S):
            try:
                client.sendall(data[i % len(data):][:1])
            except (BrokenPipeError, ConnectionResetError):
                return True
            time.sleep(0.1)
        return False

    def test_silence(self):
        with self.server.connect() as client:
            self.assertFalse(open_after(client))

    def test_header_and_body_in_drops(self):
        for begun, rest in [("", b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20),
                            (POST + "Content-Length: 1000\r\n\r\n", b"x")]:
            with self.server.connect() as client:
                client.sendall(begun.encode())
                self.assertTrue(self.drip(client, rest), begun)

    def test_listener_that_does_not_read_is_cut_off_and_can_resume(self):
        with self.server.connect() as client:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            client.sendall(b"GET /v1/events?after=0 HTTP/1.1\r\nHost: localhost\r\n\r\n")
            before = self.metric("http_cut_off_total")
            for _ in range(200):
                self.server.ask("POST", "/v1/jobs", {})
            wait_until(lambda: self.metric("http_cut_off_total") > before)
        # A client that reconnects gets all events.
        again = Events(self.server, "/v1/events?after=0")
        numbers = []
        while len(numbers) < 50:
            if number := again.next()[0]:  # not a heartbeat
                numbers.append(number)
        self.assertEqual(numbers, list(range(1, 51)))
        again.close()

    def test_heartbeat(self):
        listener = Events(self.server)
        self.assertEqual(listener.next(), ("", None))
        listener.close()

    def test_listener_that_talks(self):
        listener = Events(self.server)
        listener.client.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.assertFalse(open_after(listener.client))
        listener.close()


class Late(Attacked):
    """A request that hangs, as in a disk that does not answer, is answered."""
    settings = ["working=1000", "picture=5000"]

    def test_it_is_told(self):
        status, headers, body = self.server.ask("POST", "/v1/preview", {})
        self.assertEqual((status, headers["retry-after"]), (503, "60"))  # the picture comes too late
        self.assertIn("a disk may hang", json.loads(body)["detail"])

    def test_lists_do_not_wait_for_disks(self):
        clients = [self.send("GET /v1/browse?folder=slow HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n")
                   for _ in range(6)]
        for client in clients:
            self.assertEqual(parse(read_all(client))[0], 503)  # its thread still hangs
            client.close()
        wait_until(lambda: self.server.ask("GET", "/v1/jobs")[0] == 200)


class Crowds(Attacked):
    settings = ["max_connections=40", "max_connections_per_address=30", "max_waiting=4",
                "picture=600000"]

    def all_left(self):
        """No connection but this one."""
        return self.server.ask("GET", "/metrics")[0] == 200 and self.metric("http_connections") == 1

    def crowd(self, counts, target, status):
        """Connections of each address, with which the next client's request gets this status."""
        # Those that have sent no request would make way.
        held = [self.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n", f"127.0.0.{i}")
                for i, count in counts.items() for _ in range(count)]
        for client in held:
            self.assertIn(b"HTTP/1.1 200", client.recv(4096))
        wait_until(lambda: self.server.ask("GET", target)[0] == status)
        self.assertEqual(self.server.ask("GET", target)[1]["retry-after"], "5")
        # Further connections are closed without a reply, and nothing breaks.
        held += [socket.create_connection(("127.0.0.1", self.server.port), source_address=("127.0.0.3", 0))
                 for _ in range(300)]
        for client in held:
            client.close()
        wait_until(self.all_left)

    def test_connections_of_one_address(self):
        self.crowd({1: 30}, "/healthz", 429)

    def test_connections_in_all(self):
        self.crowd({1: 20, 2: 20}, "/v1/jobs", 503)

    def test_a_preview_ends_when_its_client_leaves(self):
        [client] = self.previews(1)
        wait_until(lambda: self.metric("http_waiting_requests") > 1)  # and this one
        client.close()
        wait_until(lambda: self.metric("fake_left") > 0)

    def test_clients_that_vanish(self):
        for _ in range(200):
            client = self.server.connect()
            client.sendall(b"POST /v1/preview HTTP/1.1\r\nHost: loc")
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
        wait_until(self.all_left)


class Following(Attacked):
    """Listeners get every event once, from memory and from the store."""
    settings = ["frame=3", "kept_events=20", "heartbeat=200"]

    def test_resume(self):
        for _ in range(10):
            self.server.ask("POST", "/v1/jobs", {})
        ids = [0]
        while ids[-1] < 70:  # 10 jobs of 7 events, most of them no longer in memory
            listener = Events(self.server, last=ids[-1])
            for _ in range(9):
                if ids[-1] < 70 and (number := listener.next()[0]):  # not a heartbeat
                    ids.append(number)
            listener.close()
        self.assertEqual(ids, list(range(71)))

    def test_a_job_s_own_events_end_with_it(self):
        job = self.server.submit({})
        listener = Events(self.server, f"/v1/jobs/{job}/events")
        found = listener.rest()
        self.assertEqual({event["job"] for _, event in found}, {job})
        listener.close()
        self.assertEqual([event["type"] for _, event in found], TYPES)
        status, _, body = self.server.ask("GET", f"/v1/jobs/{job}/events",
                                          headers={"Last-Event-ID": str(found[-1][0])})
        self.assertEqual((status, body), (204, b""))

    def test_many_listeners(self):
        threads = self.server.threads()
        listeners = [Events(self.server) for _ in range(200)]
        self.assertLessEqual(self.server.threads(), threads)
        job = self.server.submit({})
        for listener in listeners:
            types = []
            while not types or types[-1] != "done":
                got = listener.next()
                if got[1] and got[1]["job"] == job:
                    types.append(got[1]["type"])
            self.assertEqual(types, TYPES)
            listener.close()


class Draining(unittest.TestCase):
    def test_listeners_and_idle_clients_are_let_go(self):
        server = Server([PROGRAM, "picture=2000", "closing=600000"])
        listener, idle, busy = Events(server), server.connect(), server.connect()
        busy.sendall((POST.replace("jobs", "preview") + "Content-Length: 2\r\n\r\n{}").encode())
        wait_until(lambda: b"waiting_requests 2" in server.ask("GET", "/metrics")[2])
        start = time.monotonic()
        self.assertEqual(server.stop(), 0)
        self.assertLess(time.monotonic() - start, 60)
        self.assertIsNone(listener.next())
        status, headers, _ = parse(read_all(busy))
        self.assertEqual((status, headers["connection"]), (200, "close"))
        for client in (listener, idle, busy):
            client.close()


if __name__ == "__main__":
    unittest.main()
