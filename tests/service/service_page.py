"""Shared by the tests of the page: a service with frames, a browser, and the actions of a user."""
import os
import pathlib
import sys
import tempfile
import unittest

for folder in ("page", "command"):
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / folder))
from browser import Browser, SOFTWARE_GL  # noqa: E402
from server import Server, make_scene, serve_command  # noqa: E402

PROGRAM = os.path.abspath(sys.argv[1])
TAB, ENTER, DOWN, ALT = "\ue004", "\ue007", "\ue015", "\ue00a"
SHOT = "shot=shots/sharp.%23%23%23%23.exr&camera=shots/camera.json"
SHOWN = ("postchain.viewer?.shown?.image && "
         "document.getElementById('canvas').getAttribute('aria-busy') !== 'true'")


class OnTheService(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.path = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        make_scene(PROGRAM, cls.path / "shots", "1-3", "160x90")
        (cls.path / "broken").mkdir()
        for frame in (1, 2, 3):
            data = (cls.path / f"shots/sharp.000{frame}.exr").read_bytes()
            (cls.path / f"broken/f.000{frame}.exr").write_bytes(
                data[:len(data) // 2] if frame == 2 else data)
        (cls.path / "out").mkdir()
        cls.server = Server(serve_command(PROGRAM, cls.path))
        cls.base = f"http://127.0.0.1:{cls.server.port}/"
        cls.browser = Browser(SOFTWARE_GL)
        cls.browser.call("POST", "/timeouts", {"script": 55_000})  # shorter than call()'s own
        cls.browser.size(1280, 900)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        assert cls.server.stop() == 143

    def setUp(self):
        self.browser.errors()  # of the former test
        self.browser.size(1280, 900)
        self.browser.scheme("light")

    def tearDown(self):
        self.assertEqual(self.browser.errors(requests=False), [])

    def open(self, state=""):
        self.browser.open(self.base + "#" + state)
        self.browser.wait("globalThis.postchain?.viewer && document.querySelector('.entry')")

    def open_anew(self, state=""):
        """Without the chains of former visits."""
        self.open(state)
        self.browser.run("localStorage.clear();")
        self.open(state)

    def open_shot(self, more=""):
        self.open_anew(SHOT + more)
        self.browser.wait(f"{SHOWN} && postchain.model.subject")

    def open_from_the_folders(self):
        self.open_anew()
        self.click("[data-folder=shots]")
        self.click("[data-path='shots/sharp.####.exr']")
        self.browser.wait(f"{SHOWN} && postchain.model.subject")

    def long_shot(self):
        """60 frames."""
        (self.path / "long").mkdir(exist_ok=True)
        for frame in range(1, 61):
            (self.path / f"long/f.{frame:04}.exr").write_bytes(
                (self.path / f"shots/sharp.000{1 + frame % 3}.exr").read_bytes())
        return "long/f.####.exr"

    def click(self, selector):
        self.browser.wait("document.querySelector(args[0])?.checkVisibility()", selector)
        self.browser.run("document.querySelector(args[0]).click();", selector)

    def press(self, text):
        self.browser.wait("[...document.querySelectorAll('button')].some((b) => "
                          "b.textContent === args[0] && b.checkVisibility() && !b.disabled)", text)
        self.browser.run("[...document.querySelectorAll('button')].find((b) => "
                         "b.textContent === args[0] && b.checkVisibility()).click();", text)

    def text(self, selector):
        return self.browser.run("return document.querySelector(args[0])?.innerText ?? null;", selector)

    def wait_for_text(self, selector, expected):
        """For what the page draws with its next picture."""
        self.browser.wait("document.querySelector(args[0])?.innerText === args[1]", selector, expected)

    def state(self, key):
        return self.browser.run("return postchain.state.get(args[0]);", key)

    def focused(self):
        return self.browser.run("const e = document.activeElement; return e.id || e.dataset.frame || "
                                "e.dataset.path || e.dataset.folder || e.className;")

    def choose(self, chain):
        """A shipped chain, or a file of the folder."""
        self.browser.wait("[...document.getElementById('load').options].some((one) => one.value === args[0])",
                          chain)
        self.browser.run("""
            const box = document.getElementById("load");
            box.value = args[0];
            box.dispatchEvent(new Event("change"));""", chain)

    def is_hidden(self, element):
        return self.browser.run("return document.getElementById(args[0]).hidden;", element)

    def values(self, key, other=None):
        """In the middle of the frame, as soon as they are there and not `other`."""
        return self.browser.wait(
            f"{SHOWN} && (() => {{"
            "    const rgb = postchain.viewer.values(postchain.model.source(args[0]), {x: 80, y: 45})?.rgb;"
            "    return rgb && JSON.stringify([...rgb]) !== JSON.stringify(args[1]) && [...rgb];"
            "})()", key, other)

    def place(self, x, y):
        """A pixel of the frame, in the window."""
        return self.browser.run("""
            const box = document.getElementById("canvas").getBoundingClientRect();
            const [x, y] = postchain.viewer.from_picture(args[0] + 0.5, args[1] + 0.5);
            return [box.left + x, box.top + y];""", x, y)

    def submit(self, **body):
        return self.server.submit({
            "input": "shots/sharp.####.exr", "camera": "shots/camera.json", "chain": "fast",
            "on_existing": "overwrite", **body})

    def wait_for(self, state="done"):
        """The shown job's state."""
        self.browser.wait("document.querySelector(`#job:not([hidden]) .state.${args[0]}`)", state)

    def open_job(self, job, state="done"):
        self.open(f"job={job}")
        self.wait_for(state)


def run():
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
