"""Shared by the tests of the report page: the reports of fixture.cpp, their formulas, and a browser. The
first argument of the program is page_fixture."""
import atexit
import math
import pathlib
import subprocess
import sys
import tempfile
import urllib.parse

from browser import Browser

WIDTH, HEIGHT, ZOOM = 96, 64, 6
FRAMES = [1001, 1002]
MADE = tempfile.TemporaryDirectory(prefix="postchain-page-")
atexit.register(MADE.cleanup)
FOLDER = pathlib.Path(MADE.name) / "a report"
FOLDER.mkdir()
subprocess.run([sys.argv.pop(1), str(FOLDER)], check=True)


def variant(v, x, y, frame=1001):
    return [(x + 0.5) / WIDTH * 2 ** v * (1 if frame == 1001 else 0.5), (y + 0.5) / HEIGHT,
            (v + 1) / 4]


def truth(x, y, frame=1001):
    r, g, b = variant(0, x, y, frame)
    return [r, 2 * g, b]


def shown(rgb, ev=0):
    """(x/(1+x))^(1/2.2) of the exposed values, 0..255."""
    exposed = [max(v, 0) * 2 ** ev for v in rgb]
    return [255 * (v / (1 + v)) ** (1 / 2.2) for v in exposed]


def srgb(rgb):
    limited = [min(max(v, 0), 1) for v in rgb]
    return [255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055)
            for v in limited]


# magma at 0, 0.25, 0.5, 0.75, 1, of matplotlib.cm.magma (indices 0, 64, 128, 191, 255).
MAGMA = {0: (0, 0, 4), 64: (81, 18, 124), 128: (183, 55, 121), 191: (252, 137, 97),
         255: (252, 253, 191)}


class OnThePage:
    """With the flags of a browser."""

    flags = None

    @classmethod
    def setUpClass(cls):
        cls.browser = Browser(cls.flags)
        cls.browser.size(1440, 900)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def setUp(self):
        self.browser.scheme("light")
        self.browser.mouse((2, 2))
        self.open(f"zoom={ZOOM}&x=48&y=32")

    def tearDown(self):
        self.assertEqual(self.browser.errors(), [])

    def open(self, state="", name="index.html"):
        address = "file://" + urllib.parse.quote(str(FOLDER / name))
        self.browser.open(f"{address}#{state}")
        self.browser.wait("globalThis.postchain")
        self.settle()
        self.box = self.box_of("#canvas")

    def box_of(self, selector, index=0):
        """Left, top, width and height."""
        return self.browser.run("const b = document.querySelectorAll(args[0])[args[1]].getBoundingClientRect();"
                                "return [b.left, b.top, b.width, b.height];", selector, index)

    def ask(self, expression, *arguments):
        return self.browser.run(f"return {expression};", *arguments)

    def texts(self, selector, kind="innerText"):
        return self.ask("[...document.querySelectorAll(args[0])].map((e) => e[args[1]])", selector, kind)

    def settle(self):
        self.browser.run("await postchain.settled();")

    def state(self, key):
        return self.ask("postchain.state.get(args[0])", key)

    def states(self, *keys):
        return [self.state(key) for key in keys]

    def place(self, x, y, center=(48, 32), zoom=ZOOM):
        """Place of the center of an image's pixel in the window; the canvas may have odd sides,
        hence half a device pixel."""
        left, top, width, height = self.box
        return (left + width / 2 + (x + 0.5 - center[0]) * zoom,
                top + height / 2 + (y + 0.5 - center[1]) * zoom)

    def screen(self, x, y, **view):
        self.settle()
        at = self.place(x, y, **view)
        return self.browser.pixel(math.floor(at[0]), math.floor(at[1]))

    def assert_color(self, got, expected, places=1.01):
        """A step of 8 bits: half floats and the GPU's powers."""
        for a, b in zip(got, expected):
            self.assertLessEqual(abs(a - b), places, f"{got} instead of {expected}")
