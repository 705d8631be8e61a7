"""Headless Chromium through chromedriver's HTTP interface (W3C WebDriver), with Python's own
library alone."""
import base64
import contextlib
import json
import re
import shutil
import struct
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
import zlib

ARGUMENTS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-sync",
             "--force-device-scale-factor=1", "--hide-scrollbars"]
# WebGL2 without a GPU, and no WebGL at all.
SOFTWARE_GL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_GL = ["--disable-3d-apis"]
TIME_LIMIT_S = 300  # of a page's script; a busy machine may take long
SHIFT, SPACE, RIGHT = "\ue008", " ", "\ue014"


def rgb_of_png(data):
    """The color of a file of one 8-bit pixel, whose filter changes nothing, because it has no neighbor."""
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    return tuple(zlib.decompress(packed)[1:4])


class Browser:
    """One window; close() ends it and removes what it wrote."""

    def __init__(self, extra):
        self.folder = tempfile.mkdtemp(prefix="postchain-chromium-")
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL, text=True)
        for line in self.driver.stdout:
            found = re.search(r"on port (\d+)\.", line)
            if found:
                self.base = f"http://127.0.0.1:{found[1]}"
                break
        else:
            raise RuntimeError("chromedriver did not start")
        arguments = ARGUMENTS + [f"--user-data-dir={self.folder}"] + extra
        session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": {"args": arguments},
            "timeouts": {"script": 1000 * TIME_LIMIT_S, "pageLoad": 1000 * TIME_LIMIT_S},
            "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.base += f"/session/{session['sessionId']}"

    def close(self):
        try:
            self.call("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait()
            self.driver.stdout.close()
            shutil.rmtree(self.folder, ignore_errors=True)

    def call(self, method, path, body=None):
        request = urllib.request.Request(
            self.base + path, method=method, headers={"Content-Type": "application/json"},
            data=None if body is None else json.dumps(body).encode())
        try:
            with urllib.request.urlopen(request, timeout=TIME_LIMIT_S + 60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def open(self, address):
        self.call("POST", "/url", {"url": "about:blank"})  # else only the hash would change
        self.call("POST", "/url", {"url": address})

    def run(self, script, *arguments):
        """The value of the body of an async function."""
        text = ("const done = arguments[arguments.length - 1];"
                f"(async (...args) => {{ {script} }})(...arguments)"
                ".then((v) => done([v]), (e) => done(String(e.stack)));")
        value = self.call("POST", "/execute/async", {"script": text, "args": list(arguments)})
        if not isinstance(value, list):
            raise AssertionError(value)
        return value[0]

    def wait(self, script, *arguments, seconds=120):
        """The first true value of an expression: True for an object, which need not be one that JSON can hold.
        It is evaluated at once: a page that goes to another would never end run()'s function."""
        body = {"script": f"const args = [...arguments]; const value = {script};"
                          "return value instanceof Object && !Array.isArray(value) ? true : value;",
                "args": list(arguments)}
        end = time.monotonic() + seconds
        while True:
            try:
                value, fault = self.call("POST", "/execute/sync", body), "false"
            except RuntimeError as error:  # also of a page that is not there yet
                value, fault = None, str(error)
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"never: {script}: {fault}")
            time.sleep(0.02)

    def command(self, name, **parameters):
        """A command of the DevTools protocol."""
        return self.call("POST", "/goog/cdp/execute", {"cmd": name, "params": parameters})

    @contextlib.contextmanager
    def inside(self, selector):
        """Calls go to the page in this frame."""
        self.wait("document.querySelector(args[0])", selector)
        frame = self.call("POST", "/element", {"using": "css selector", "value": selector})
        self.call("POST", "/frame", {"id": frame})
        try:
            yield
        finally:
            self.call("POST", "/frame", {"id": None})

    def size(self, width, height):
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height,
                     deviceScaleFactor=1, mobile=False)

    def scheme(self, name):
        self.command("Emulation.setEmulatedMedia",
                     features=[{"name": "prefers-color-scheme", "value": name}])

    def pixel(self, x, y):
        """RGB on the screen, CSS pixels from the window's corner."""
        left, top = self.run("return [scrollX, scrollY];")
        shot = self.command("Page.captureScreenshot", format="png", clip={
            "x": x + left, "y": y + top, "width": 1, "height": 1, "scale": 1})
        return rgb_of_png(base64.b64decode(shot["data"]))

    def keys(self, *events):
        """("down", key), ("up", key) or a key to press."""
        actions = []
        for event in events:
            if isinstance(event, str):
                actions += [{"type": "keyDown", "value": event}, {"type": "keyUp", "value": event}]
            else:
                actions.append({"type": f"key{event[0].title()}", "value": event[1]})
        self.call("POST", "/actions", {"actions": [{"type": "key", "id": "k", "actions": actions}]})

    def mouse(self, *events):
        """(x, y): move there; "down", "up"."""
        actions = []
        for event in events:
            if event in ("down", "up"):
                actions.append({"type": f"pointer{event.title()}", "button": 0})
            else:
                actions.append({"type": "pointerMove", "x": round(event[0]), "y": round(event[1]),
                                "duration": 0})
        self.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "m",
                                                    "actions": actions}]})

    def wheel(self, x, y, delta):
        self.call("POST", "/actions", {"actions": [{"type": "wheel", "id": "w", "actions": [
            {"type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": delta,
             "duration": 0}]}]})

    def errors(self, requests=True):
        """The console's errors since the last call. requests: also those of requests that failed."""
        return [entry["message"] for entry in self.call("POST", "/se/log", {"type": "browser"})
                if entry["level"] == "SEVERE" and (requests or entry["source"] != "network")]
