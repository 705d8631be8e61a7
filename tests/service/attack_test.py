"""Hostile requests over raw sockets. After each, the next client is served.

usage: attack_test.py SERVE_FAKE"""
import http.client
import json
import os
import signal
import time
import unittest

from attacked import Attacked, GET, POST, PROGRAM
from server import Events, parse, read_all, statuses, wait_until


CHUNKED = POST + "Transfer-Encoding: chunked\r\n"
LAST = "\r\n0\r\n\r\n"
# What the beginning of a request has, the statuses, and the beginnings.
BEGINNINGS = {
    "length and chunked": ({400}, [CHUNKED + "Content-Length: 4\r\n" + LAST,
                                   POST + "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n" + LAST]),
    "two lengths": ({400}, [POST + f"Content-Length: 2\r\nContent-Length: {length}\r\n\r\n{{}}"
                            for length in (2, 60)]),
    "a length that is no number": ({400, 413}, [
        POST + f"Content-Length: {length}\r\n\r\n{{}}" for length in [
            "+2", "-1", "0x2", "2, 2", "2;", "1e1", "", "99999999999999999999", "\xb2"]]),
    "a coding": ({400, 501}, [
        POST + f"Transfer-Encoding: {coding}\r\n" + LAST for coding in [
            "gzip", "gzip, chunked", "chunked, chunked", "xchunked", "chunked;q=1", "identity",
            "\x0bchunked", "chunked\r\nTransfer-Encoding: gzip"]]),
    "chunked in 1.0": ({400}, [CHUNKED.replace("1.1", "1.0") + LAST]),
    "a space before a colon": ({400}, [POST + "Content-Length : 60\r\n\r\n",
                                       POST + "Transfer-Encoding : chunked\r\n" + LAST]),
    "line feeds alone": ({400, 505}, [GET.replace("\r\n", "\n") + "\n",
                                      GET + "X: a\nContent-Length: 5\r\n\r\n"]),
    "a control character": ({400}, [
        GET + text + "\r\n\r\n" for text in ["X: a\0b", "X\0: a", "X: a\rb", "X y: a", ": a", "X"]]),
    "a chunk": ({400, 413}, [CHUNKED + "\r\n" + chunks for chunks in [
        "2\n{}\r\n0\r\n\r\n", "0x2\r\n{}\r\n0\r\n\r\n", "-2\r\n{}\r\n0\r\n\r\n",
        "fffffffffffffffff\r\n{}", "2\r\n{}XX0\r\n\r\n", "\r\n{}\r\n0\r\n\r\n"]]),
    "a body where none is taken": ({413}, [GET + "Content-Length: 80\r\n\r\n",
                                           GET + "Transfer-Encoding: chunked\r\n\r\n"]),
}


class Smuggling(Attacked):
    """RFC 9112, 11.2: two readers must not see two different requests."""

    def test_no_part_of_a_request_is_another(self):
        for what, (expected, beginnings) in BEGINNINGS.items():
            for beginning in beginnings:
                with self.subTest(what, beginning=beginning):
                    before = self.jobs()
                    self.refused(beginning + POST + "Content-Length: 2\r\n\r\n{}", *expected)
                    self.assertEqual(self.jobs(), before, "a hidden request was run")

    def test_pipelined_requests_are_answered_in_order(self):
        raw = (GET + "\r\n") * 3 + "GET /nowhere HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        self.assertEqual(statuses(self.server.send(raw.encode())), [200, 200, 200, 404])


class Shapes(Attacked):
    def test_requests_of_wrong_forms(self):
        close = "\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        for raw in [line + close for line in [
                        "GET  / HTTP/1.1", "GET / HTTP/1.1 x", "GET / HTTP/9.9", "GET / HTTP/2.0",
                        "GET /", "G\tT / HTTP/1.1", "GET \x01 HTTP/1.1", "\x16\x03\x01\x02\x00",
                        "GET / http/1.1", "/ HTTP/1.1", "PRI * HTTP/2.0",
                        "CONNECT example.org:443 HTTP/1.1"]] + [
                    f"GET {target} HTTP/1.1{close}" for target in ["*", "ftp://localhost/", "/v1/jobs/%2e%2e/x"]] + [
                    GET + f"{name}: a\r\n{name}: b\r\nConnection: close\r\n\r\n" for name in [
                        "Host", "Authorization", "Origin", "Idempotency-Key"]] + [
                    "GET / HTTP/1.1\r\nConnection: close\r\n\r\n", "GET / HTTP/1.0\r\n\r\n",
                    POST + "Content-Length: 2\r\nExpect: 200-ok\r\n\r\n"]:
            with self.subTest(raw):
                self.refused(raw, 400, 505)

    def test_an_expectation_that_is_refused_ends_the_connection(self):
        """Its body would be read as the next request."""
        body = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        head = f"{POST}Content-Length: {len(body)}\r\nExpect: 200-ok\r\n\r\n".encode()
        self.refused(head + body, 400)

    def test_queries(self):
        for target, values in {
                "jobs?limit=": ["0", "-1", "", "501", "1x", "99999999999999999999"],
                "jobs?": ["unknown=1", "states=done", "state=finished", "before=x", "before=0"],
                "events?after=": ["x", "-1", "1.5", "99999999999999999999", "0x10"],
                "image": ["", "?frame=x&input=a.exr", "?frame=1&side=0", "?frame=1&side=4097", "?frame=1&type=gif"],
                "jobs/j1/thumbnail.png?side=": ["4097", "1x"], "browse?": ["path=."],
                "chains?": ["name=fast"],
                "jobs/j1/report/index.html?": ["picture=x", "pictures=all"]}.items():
            for value in values:
                self.assertEqual(self.server.ask("GET", f"/v1/{target}{value}")[0], 400, target + value)
        job = self.server.submit({})
        for target in ("frames/x", "frames/2147483648/output", "frames/1.5/after.png",
                       "report/shortened.json?picture=image-1", "report/shortened.json?pictures=apart"):
            self.assertEqual(self.server.ask("GET", f"/v1/jobs/{job}/{target}")[0], 404, target)
        for target in ("jobs?limit=500", "image?input=a.exr&frame=1&side=4096&type=values"):
            self.assertEqual(self.server.ask("GET", "/v1/" + target)[0], 200, target)

    def test_methods(self):
        for method, target, allowed in [
                ("PUT", "/v1/jobs", {"GET", "HEAD", "POST"}), ("POST", "/", {"GET", "HEAD"}),
                ("GET", "/v1/plan", {"POST"}), ("HEAD", "/v1/events", {"GET"}),
                ("TRACE", "/v1/jobs", {"GET", "HEAD", "POST"}),
                ("PUT", "/v1/jobs/j1", {"GET", "HEAD", "PATCH", "DELETE"}),
                ("XYZZY", "/healthz", {"GET", "HEAD"})]:
            status, headers, _ = self.server.ask(method, target)
            self.assertEqual(status, 405, method + target)
            self.assertEqual(set(headers["allow"].split(", ")), allowed, method + target)

    def test_head(self):
        body = self.server.ask("GET", "/v1/passes")[2]
        status, headers, none = self.server.ask("HEAD", "/v1/passes")
        self.assertEqual((status, none, headers["content-length"]), (200, b"", str(len(body))))

    def test_media_types(self):
        for headers, status in [
                *(({"Content-Type": kind}, 415) for kind in [
                    None, "text/plain", "application/x-www-form-urlencoded", "application/jsonx",
                    "multipart/form-data"]),
                ({"Content-Encoding": "gzip"}, 415),
                ({"Content-Type": "Application/JSON; charset=utf-8"}, 202)]:
            self.assertEqual(self.server.ask("POST", "/v1/jobs", "{}", headers)[0], status, headers)
        for accept, expected in [(None, "image/png"), ("*/*", "image/png"),
                                 ("image/x-exr", "image/x-exr")]:
            _, headers, _ = self.server.ask("POST", "/v1/preview", {}, {"Accept": accept})
            self.assertEqual(headers["content-type"], expected)

    def test_no_json(self):
        status, headers, text = self.server.ask("POST", "/v1/jobs", "x")
        self.assertEqual((status, headers["content-type"]), (422, "application/problem+json"))
        self.assertTrue(json.loads(text)["errors"])

    def test_an_empty_key(self):
        self.assertEqual(self.server.ask("POST", "/v1/jobs", {}, {"Idempotency-Key": ""})[0], 400)

    def test_expect(self):
        with self.server.connect() as client:
            client.sendall((POST + "Content-Length: 2\r\nExpect: 100-continue\r\n"
                            "Connection: close\r\n\r\n").encode())
            self.assertEqual(client.recv(100), b"HTTP/1.1 100 Continue\r\n\r\n")
            client.sendall(b"{}")
            self.assertEqual(parse(read_all(client))[0], 202)

    def test_no_answer_shows_this_machine(self):
        """No path, no stack, no name of a program or version in a header."""
        for target in ["/x", "/v1/jobs/nope", "/v1/jobs/j1/report/nope", "/%"]:
            _, headers, body = self.server.ask("GET", target)
            self.assertNotRegex(body.decode(), r"/(home|root|tmp|work|usr|build)|\.cpp|0x[0-9a-f]{6}")
            self.assertNotIn("server", headers)

    def test_security_headers(self):
        self.server.ask("POST", "/v1/jobs", {})
        policies = {}
        for target in ["/", "/v1/jobs", "/nowhere", "/v1/jobs/j1/report/index.html"]:
            _, headers, _ = self.server.ask("GET", target)
            self.assertEqual(headers["x-content-type-options"], "nosniff")
            self.assertEqual(headers["referrer-policy"], "no-referrer")
            self.assertNotIn("access-control-allow-origin", headers)
            policies[target] = headers["content-security-policy"]
            for word in ("default-src 'none'", "frame-ancestors"):
                self.assertIn(word, policies[target])
        self.assertNotIn("unsafe", policies["/"])
        self.assertIn("sandbox", policies["/v1/jobs/j1/report/index.html"])
        self.assertNotIn("allow-same-origin", policies["/v1/jobs/j1/report/index.html"])


class OtherSites(Attacked):
    """Requests of a browser with a hostile page."""

    def test_names_that_point_here(self):
        for expected, hosts in [
                ((400, 421), ["evil.example", "evil.example:80", "localhost.evil.example",
                              "127.0.0.1.nip.io", "localhost@evil.example", "0x7f000001",
                              "[::1].evil.example", "", " ", "a b", "[::1", "localhost:x", ":80"]),
                ((200,), ["localhost", "LOCALHOST:1", "127.0.0.1", "[::1]:8080", "10.1.2.3"])]:
            for host in hosts:
                self.assertIn(self.server.ask("GET", "/v1/jobs", headers={"Host": host})[0], expected, host)
                if " " in host:
                    continue
                # RFC 9112, 3.2.2: the address of a target counts in place of Host.
                other = "evil.example" if expected == (200,) else "localhost"
                status = self.server.ask("GET", f"HTTP://{host}/v1/jobs?limit=5", headers={"Host": other})[0]
                self.assertIn(status, expected, host)
        self.assertEqual(self.server.ask("GET", "https://localhost")[0], 200)

    def test_origins(self):
        before = self.jobs()
        for origin in ["http://evil.example", "null", "", "http://127.0.0.1", "http://localhost:1",
                       "file://", "http://127.0.0.1:%d.evil.example" % self.server.port]:
            for method, body in [("POST", {}), ("GET", None)]:
                self.assertEqual(self.server.ask(method, "/v1/jobs", body, {"Origin": origin})[0], 403,
                                 origin)
        self.assertEqual(self.jobs(), before)
        own = f"http://127.0.0.1:{self.server.port}"
        self.assertEqual(self.server.ask("POST", "/v1/jobs", {}, {"Origin": own})[0], 202)

    def test_requests_without_origin(self):
        for site in ["cross-site", "same-site"]:
            headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors"}
            self.assertEqual(self.server.ask("GET", "/v1/jobs", None, headers)[0], 403)
            headers["Sec-Fetch-Mode"] = "navigate"
            self.assertEqual(self.server.ask("GET", "/", None, headers)[0], 200)
            self.assertEqual(self.server.ask("POST", "/v1/jobs/j1/retry", None, headers)[0], 403)


class Sizes(Attacked):
    def test_what_is_too_long(self):
        chunked = POST + "Transfer-Encoding: chunked\r\n\r\n"
        body = "x" * (1024 * 1024 + 1)
        for what, raw, status in [
                ("header", GET + "X: " + "a" * 20000 + "\r\n\r\n", 431),
                ("headers", GET + "".join(f"X{i}: a\r\n" for i in range(5000)) + "\r\n", 431),
                ("target", "GET /" + "a" * 5000 + " HTTP/1.1\r\nHost: localhost\r\n\r\n", 414),
                ("request line", "GET /" + "a" * 100000, 431),
                ("length", POST + "Content-Length: 1048577\r\n\r\n", 413),
                ("length of 64 bits", POST + "Content-Length: 18446744073709551615\r\n\r\n", 413),
                ("body", POST + f"Content-Length: {len(body)}\r\n\r\n" + body, 413),
                ("chunks", chunked + ("10000\r\n" + "x" * 65536 + "\r\n") * 17, 413),
                ("extension of a chunk", chunked + "2;" + "x" * 200000, 400)]:
            with self.subTest(what):
                self.refused(raw, status)

    def test_a_refusal_reaches_a_client_that_is_still_sending(self):
        client = self.server.connect()
        client.sendall((POST + "Content-Length: 2000000\r\n\r\n").encode())
        for _ in range(3):  # the reply was sent before the first of them
            time.sleep(0.1)
            client.sendall(b"x" * 100000)
        self.assertEqual(statuses(read_all(client)), [413])

    def test_memory_does_not_follow_the_length_that_is_claimed(self):
        before = self.server.memory_kib()
        held = []
        for _ in range(100):
            client = self.server.connect()
            client.sendall((POST + "Content-Length: 1048576\r\n\r\n{").encode())
            held.append(client)
        wait_until(lambda: self.metric("http_connections") > 100)
        self.assertLess(self.server.memory_kib() - before, 50_000)
        for client in held:
            client.close()


class Files(Attacked):
    settings = ["header=600000"]  # no deadline ends what hangs

    def test_downloads(self):
        status, headers, _ = self.server.ask("POST", "/v1/jobs", {})
        self.assertEqual((status, headers["location"][:6]), (202, "jobs/j"))
        target = "/v1/jobs/j1/frames/3/output"
        status, headers, data = self.server.ask("GET", target)
        self.assertEqual((status, data), (200, b"3" * 900_000))
        self.assertIn('filename="o.3.exr"', headers["content-disposition"])
        status, headers, data = self.server.ask("HEAD", target)
        self.assertEqual((headers["content-length"], data), ("900000", b""))

    def test_a_file_that_was_shortened(self):
        """The length has been sent: the connection ends early, and no bytes are made up."""
        job = self.server.submit({})
        client = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=120)
        client.request("GET", f"/v1/jobs/{job}/report/shortened.json")
        reply = client.getresponse()
        self.assertEqual((reply.status, reply.headers["Content-Length"]), (200, "1000000"))
        with self.assertRaises(http.client.IncompleteRead):
            reply.read()
        client.close()

    def test_pictures_of_a_report(self):
        self.server.ask("POST", "/v1/jobs", {})
        target = "/v1/jobs/j1/report/index.html"
        self.assertEqual(self.server.ask("GET", target + "?picture=image-2")[0], 404)
        for query, kind, text in [("?picture=image-1", "text/plain", b"data:,x"),
                                  ("?pictures=apart", "text/html", b"<p>report</p>\n")]:
            status, headers, body = self.server.ask("GET", target + query)
            self.assertEqual([status, body], [200, text])
            self.assertTrue(headers["content-type"].startswith(kind), headers)
            self.assertIn("sandbox", headers["content-security-policy"])


class Waiting(Attacked):
    settings = ["max_waiting=8", "picture=60000", "max_queue=3"]

    def test_a_full_queue_says_when_to_come_back(self):
        replies = [self.server.ask("POST", "/v1/jobs", {}) for _ in range(4)]
        self.assertEqual([(status, headers.get("retry-after")) for status, headers, _ in replies],
                         [(202, None)] * 3 + [(429, "7")])

    def test_readiness_does_not_wait(self):
        """Every place of a waiting request is taken: health and readiness are answered all the same."""
        clients = self.previews(8)
        wait_until(lambda: self.server.ask("GET", "/v1/jobs")[0] == 429)
        begun = time.monotonic()
        for target in ("/readyz", "/healthz") * 20:
            self.assertEqual(self.server.ask("GET", target)[0], 200, target)
        self.assertEqual(self.server.ask("GET", "/v1/jobs")[0], 429)
        self.assertLess(time.monotonic() - begun, 30)  # before the first preview has ended
        for client in clients:
            client.close()


class SlowReaders(Attacked):
    settings = ["picture_bytes=8000000", "max_unsent=32000000", "picture=0"]

    def test_unread_replies_are_bounded(self):
        """20 clients that ask for a picture of 8 MB each and do not read it."""
        clients = self.previews(20)
        wait_until(lambda: self.metric(r'http_replies_total\{status="503"\}') >= 18)
        # Half of the budget, for one address.
        self.assertEqual(self.metric("http_unsent_bytes"), 16_000_000)
        # Small replies are sent, and large ones to a client that reads, when the others are gone.
        self.assertEqual(self.server.ask("GET", "/v1/jobs")[0], 200)
        for client in clients:
            client.close()
        wait_until(lambda: self.metric("http_unsent_bytes") == 0)
        status, _, body = self.server.ask("POST", "/v1/preview", {})
        self.assertEqual((status, len(body)), (200, 8_000_000))


class Pages(Attacked):
    settings = ["frame=1"]

    def test_lists_are_short(self):
        job = self.server.submit({"padding": "x" * 500_000})
        listed = self.server.get("/v1/jobs")["jobs"][0]
        self.assertNotIn("request", listed)
        self.assertEqual(len(self.server.get(f"/v1/jobs/{job}")["request"]["padding"]), 500_000)

    def test_jobs_come_in_pages(self):
        while len(self.server.get("/v1/jobs")["jobs"]) < 3:
            self.server.submit({})
        ids = [one["id"] for one in self.server.get("/v1/jobs")["jobs"]]
        for limit, shown, next_ in [(len(ids) - 1, ids[:-1], ids[-2]), (len(ids), ids, None),
                                    (len(ids) + 1, ids, None)]:
            page = self.server.get(f"/v1/jobs?limit={limit}")
            self.assertEqual(([one["id"] for one in page["jobs"]], page["next"]), (shown, next_))

    def test_frames_come_in_pages(self):
        job = self.server.submit({})
        self.server.ended(job)
        pages = [self.server.get(f"/v1/jobs/{job}/frames?limit=3&from={start}") for start in (0, 3)]
        self.assertEqual([[one["frame"] for one in page["frames"]] for page in pages], [[1, 2, 3], [4]])
        self.assertEqual([page["next"] for page in pages], [3, None])
        for query in ("limit=0", "limit=5001", "limit=x", "from=-1"):
            self.assertEqual(self.server.ask("GET", f"/v1/jobs/{job}/frames?{query}")[0], 400, query)


class RequestIds(Attacked):
    def test_in_reply_and_error(self):
        found = set()
        for target, status in [("/v1/jobs", 200), ("/nowhere", 404), ("/v1/jobs/none", 404),
                               ("/healthz", 200), ("/v1/jobs?limit=0", 400)]:
            got, headers, body = self.server.ask("GET", target)
            self.assertEqual(got, status)
            found.add(headers["x-request-id"])
            if status >= 400:
                self.assertEqual(json.loads(body)["request_id"], headers["x-request-id"])
        self.assertEqual(len(found), 5)

    def test_of_a_client_is_not_believed(self):
        given = {"X-Request-Id": "mine"}
        self.assertNotEqual(self.server.ask("GET", "/healthz", None, given)[1]["x-request-id"], "mine")


class RequestIdsOfProxies(Attacked):
    settings = ["trust_own=1"]

    def test_of_a_proxy(self):
        for given, taken in [("abc-1", True), ("", False), ("a b", False), ("x" * 65, False), ("<a>", False)]:
            headers = self.server.ask("GET", "/healthz", None, {"X-Request-Id": given})[1]
            self.assertEqual(headers["x-request-id"] == given, taken, given)


class Others(Attacked):
    """A client knows events that the store does not: an older copy was put back."""

    def test_after_an_event_of_another_store(self):
        job = self.server.submit({})
        listener = Events(self.server, last=4711)
        self.server.ask("DELETE", f"/v1/jobs/{job}")
        number, event = listener.next()
        self.assertEqual((number, event["type"]), (2, "canceled"))
        listener.close()
        self.assertEqual(self.server.ask("GET", f"/v1/jobs/{job}/events?after=2")[0], 204)


class Followed(Attacked):
    def test_a_job_that_runs_has_more_events(self):
        """Also for a client that has all of those until now."""
        job = self.server.submit({})
        listener = Events(self.server, f"/v1/jobs/{job}/events")
        number, event = listener.next()
        self.assertEqual(event["type"], "queued")
        waiting = Events(self.server, f"/v1/jobs/{job}/events", last=number)
        self.server.ask("DELETE", f"/v1/jobs/{job}")
        for one in (listener, waiting):
            self.assertEqual(one.next()[1]["type"], "canceled")
            one.close()


class Restarted(Attacked):
    """The store has 100 events of before the start."""
    settings = ["past_events=100"]

    def test_past_events_are_for_clients_that_ask(self):
        listener = Events(self.server)
        self.server.submit({})
        self.assertEqual(listener.next()[0], 101)
        listener.close()
        again = Events(self.server, last=90)
        self.assertEqual([again.next()[0] for _ in range(11)], list(range(91, 102)))
        self.server.submit({})
        self.assertEqual(again.next()[0], 102, "once each")
        again.close()


class FewDescriptors(Attacked):
    """accept() fails for a while: the clients that are connected go on, the others come later."""
    command = ["sh", "-c", 'ulimit -n 48 && exec "$0"', PROGRAM]

    def test_more_clients_than_descriptors(self):
        first = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=120)
        first.connect()
        held = [self.server.connect() for _ in range(60)]
        descriptors = f"/proc/{self.server.process.pid}/fd"
        wait_until(lambda: len(os.listdir(descriptors)) == 48)
        first.request("GET", "/healthz")
        self.assertEqual(first.getresponse().status, 200)
        for client in [first, *held]:
            client.close()
        wait_until(lambda: len(os.listdir(descriptors)) < 40)


TOKEN = "1234567890123456789"
KNOWN = {"Authorization": "Bearer " + TOKEN}


class Token(Attacked):
    users = {"ann": TOKEN, "bob": "b" * 20}

    def test_nothing_without(self):
        for method, target in [("GET", "/v1/jobs"), ("POST", "/v1/jobs"), ("GET", "/v1/events"),
                               ("GET", "/metrics"), ("GET", "/openapi.json"), ("GET", "/nowhere"),
                               ("PUT", "/v1/jobs"), ("GET", "/v1/user"),
                               ("GET", "/v1/jobs/j1/report/index.html")]:
            status, headers, _ = self.server.ask(method, target)
            self.assertEqual((status, headers["www-authenticate"]), (401, "Bearer"), target)
        for target in ["/", "/healthz", "/readyz"]:
            self.assertEqual(self.server.ask("GET", target)[0], 200)
            self.assertEqual(self.server.ask("GET", target + "?x=1")[0], 400, target)
        # A kernel that confines less is told, and jobs run. Details need the token.
        state = self.server.get("/readyz")
        self.assertEqual((state["ready"], state["confined"]), (True, False))
        self.assertFalse(state.keys() & {"renderer", "why"})

    def test_the_right_one(self):
        known = {"Authorization": "bearer " + TOKEN}
        self.assertEqual(self.server.ask("GET", "/nowhere", None, known)[0], 404)
        self.assertEqual(self.server.get("/openapi.json", known)["security"], [{"token": []}])

    def test_wrong_ones(self):
        for value in ["", "Bearer", "Bearer ", "Bearer x", "Bearer " + TOKEN[:-1], f"Bearer {TOKEN}0",
                      "Bearer " + TOKEN * 2, "Basic " + TOKEN, TOKEN, "Bearer  " + TOKEN,
                      f"Bearer {TOKEN}, Bearer x"]:
            self.assertEqual(self.server.ask("GET", "/v1/jobs", None, {"Authorization": value})[0], 401, value)
        self.assertEqual(self.server.ask("GET", "/v1/jobs", None, {"X-Remote-User": "ann"})[0], 401)

    def test_changes_and_failed_log_ins_are_logged(self):
        def audited():
            return [json.JSONDecoder().raw_decode(line)[0] for line in self.server.stderr]
        job = self.server.submit({}, KNOWN)
        replies = [self.server.ask(method, f"/v1/jobs/{job}{more}", None, KNOWN)
                   for method, more in [("DELETE", ""), ("DELETE", ""), ("POST", "/retry"),
                                        ("DELETE", "/record"), ("GET", "")]]
        wrong = self.server.ask("GET", "/v1/jobs", None, {"Authorization": "Bearer wrong"})
        self.server.ask("GET", "/v1/jobs")  # no log-in
        wait_until(lambda: any(line.get("request") == wrong[1]["x-request-id"] for line in audited()))
        of_job = [line for line in audited() if line.get("job") == job]
        self.assertEqual([(line["action"], line["status"], line["user"]) for line in of_job],
                         [("cancelJob", 200, "ann"), ("cancelJob", 409, "ann"), ("retryJob", 200, "ann"),
                          ("forgetJob", 200, "ann")])
        self.assertEqual([line["request"] for line in of_job],
                         [reply[1]["x-request-id"] for reply in replies[:4]])
        failed = next(line for line in audited() if line["request"] == wrong[1]["x-request-id"])
        self.assertEqual((failed["action"], failed["address"]), ("logIn", "127.0.0.1"))
        self.assertNotIn(TOKEN, "".join(self.server.stderr))

    def test_body_of_a_stranger_is_not_read(self):
        raw = POST + "Content-Length: 1000000\r\n\r\n"
        self.refused(raw, 401)


class Removed(Attacked):
    """Users who are removed while they are served: one by a token, one by a proxy."""
    users = {"ann": "a" * 20, "bob": "b" * 20, "ops": "o" * 20}
    settings = ["trust_own=1", "user_header=X-Remote-User"]

    def test_streams_and_requests_end(self):
        known = [{"Authorization": "Bearer " + "a" * 20}, {"X-Remote-User": "bob"}, {"X-Remote-User": "ops"}]
        streams = [Events(self.server, headers=one) for one in known]
        line = "GET /v1/browse?folder=endless HTTP/1.1\r\nHost: localhost\r\n"
        waiting = [self.send(line + "".join(f"{key}: {value}\r\n" for key, value in one.items())) for one in known]
        wait_until(lambda: json.loads(self.server.ask("GET", "/v1/user", None, known[2])[2])["user"] == "ops")
        self.write_users({"ann": "n" * 20, "ops": "o" * 20})
        self.server.process.send_signal(signal.SIGHUP)
        for client in (waiting[0], waiting[1]):
            self.assertEqual(read_all(client), b"")
        for stream in streams[:2]:
            self.assertIsNone(stream.next())
        self.assertEqual([self.server.ask("GET", "/v1/user", None, one)[0] for one in known], [401, 403, 200])
        with self.assertRaises(TimeoutError):
            streams[2].next(1)
        for client in [*streams, *waiting]:
            client.close()


if __name__ == "__main__":
    unittest.main()
