"""postchain blind as a command, and its page in a browser.

usage: blind_test.py POSTCHAIN"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "page"))
from browser import Browser  # noqa: E402

POSTCHAIN = sys.argv.pop(1)
SIDES = ["plain", "streaks", "circles"]
HEADER = "comparison,observer,trial,choice,seconds\n"


class Blind(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.scene("in", "48x27", "1-4")
        cls.sides = [f"plain={cls.folder}/in/sharp.####.exr", f"streaks={cls.folder}/in/mb.####.exr",
                     f"circles={cls.folder}/in/dof.####.exr"]

    @classmethod
    def scene(cls, name, size, frames):
        subprocess.run([POSTCHAIN, "scene", "wheels", "-o", cls.folder / name, "--size", size,
                        "--frames", frames, "--truth-samples", "2"], check=True, capture_output=True)

    def blind(self, *words, code=0):
        done = subprocess.run([POSTCHAIN, "blind", *map(str, words)], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout if code == 0 else done.stderr

    def comparison(self, name, *more):
        """The data of a new page, and its key."""
        out = self.folder / name
        self.blind(*self.sides, "-o", out, *more)
        page = (out / "index.html").read_text("utf8")
        data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.S)[1])
        return page, data, json.loads((out / "key.json").read_text("utf8"))

    def test_page_and_key(self):
        page, data, key = self.comparison("one", "--truth", self.folder / "in/both.####.exr", "--frames", "1-2")
        self.assertEqual(len(key["trials"]), 6)
        self.assertEqual(len(data["images"]), 8)
        for name in SIDES + ["sharp", "mb.", "dof"]:
            self.assertNotIn(f'"{name}', page)
        _, _, other = self.comparison("other", "--seed", "2")
        self.assertNotEqual(other["comparison"], key["comparison"])

    def write(self, name, rows):
        path = self.folder / name
        path.write_text(HEADER + "".join(",".join(map(str, row)) + "\n" for row in rows), "utf8")
        return path

    def test_choices(self):
        _, _, key = self.comparison("choices")
        out, rows = self.folder / "choices", [[key["comparison"], "x", 1, "A", 1]]
        path = self.write("c.csv", rows)
        self.assertIn("1 choice of 1 observer, 12 pairs of images", self.blind("-o", out, "--choices", path))
        self.assertIn("has answered trial 1 before",
                      self.blind("-o", out, "--choices", path, path, code=4))
        # Nothing that the evaluation would ignore.
        for more in (["--frames", "1"], ["--seed", "2"], ["--truth", "both.####.exr"],
                     ["--input-transfer", "srgb"], ["--threads", "2"], ["--on-existing", "overwrite"]):
            self.assertIn("excludes", self.blind("-o", out, "--choices", path, *more, code=2))
        self.assertIn("--json requires --choices",
                      self.blind(*self.sides, "-o", self.folder / "json", "--json", code=2))
        # The comparison of other images of the same names.
        self.blind(self.sides[0], f"streaks={self.folder}/in/both.####.exr", self.sides[2], "-o", out,
                   "--on-existing", "overwrite")
        self.assertIn("belongs to comparison " + key["comparison"], self.blind("-o", out, "--choices", path, code=4))

    def test_what_is_wrong_with_sides_is_named(self):
        out = self.folder / "none"
        self.scene("large", "96x54", "1")
        first, second, third = self.sides
        sizes = "is 96x54 and the first side's frame 48x27"
        for code, said, words in [
                (2, "a comparison needs two sides", []),
                (2, "--seed", [second, third, "--seed", "-1"]),
                (2, "is not NAME=OUT", ["x.####.exr"]),
                (2, "two sides are named plain", [first]),
                (4, "no frame in common", [f"gone={self.folder}/gone.####.exr"]),
                (4, sizes, [f"large={self.folder}/large/mb.####.exr", "--frames", "1"]),
                (4, sizes, [second, "--truth", f"{self.folder}/large/both.####.exr", "--frames", "1"])]:
            self.assertIn(said, self.blind(first, *words, "-o", out, code=code))
        self.assertFalse(out.exists())
        # A folder of others is not written to, nor one in which an input lies.
        mine = self.folder / "mine"
        mine.mkdir()
        (mine / "notes.txt").write_text("mine", "utf8")
        self.blind(*self.sides, "-o", mine, "--on-existing", "overwrite", code=5)
        self.assertEqual([path.name for path in mine.iterdir()], ["notes.txt"])
        self.blind(*self.sides, "-o", self.folder / "in", code=2)
        self.comparison("kept")
        self.assertIn("--on-existing", self.blind(*self.sides, "-o", self.folder / "kept", code=5))
        self.blind(*self.sides, "-o", self.folder / "kept", "--on-existing", "overwrite")

    def test_an_observer_at_the_page(self):
        _, _, key = self.comparison("page", "--truth", self.folder / "in/both.####.exr")
        browser = Browser([])
        self.addCleanup(browser.close)
        browser.open(f"file://{self.folder}/page/index.html")
        browser.wait("document.querySelector('#observer')")
        place = "return document.querySelector('#place').innerText;"
        press = ("dispatchEvent(new KeyboardEvent('keydown', {key: args[0], bubbles: true}));")
        browser.run("document.querySelector('#observer').value = 'Ann, \"x\"';"
                    "document.querySelector('form button').click();")
        self.assertEqual(browser.run(place), "Pair 1 of 12")
        self.assertEqual(browser.run("return [...document.querySelectorAll('figcaption')].map("
                                     "(f) => f.textContent);"), ["A", "Reference", "B"])
        browser.wait("[...document.images].every((i) => i.naturalWidth === 48)")
        # By keys, by the pointer, back and again.
        browser.run(press, "b")
        browser.run("document.querySelector('#choose-none').click();")
        browser.run(press, "1")
        self.assertEqual(browser.run(place), "Pair 4 of 12")
        browser.run(press, "Backspace")
        self.assertEqual(browser.run(
            "return document.querySelector('#choose-A').getAttribute('aria-pressed');"), "true")
        browser.run(press, "0")
        # One at a time: the same place on the screen.
        browser.run(press, "f")
        shown = []
        for name in ("ArrowLeft", "ArrowRight", "r"):
            browser.run(press, name)
            shown.append(browser.run("return [document.images.length, "
                                     "document.querySelector('figcaption').textContent, "
                                     "document.images[0].getBoundingClientRect().x];"))
        self.assertEqual([one[:2] for one in shown], [[1, "A"], [1, "B"], [1, "Reference"]])
        self.assertEqual(len({one[2] for one in shown}), 1)
        for _ in range(9):
            browser.run(press, "a")
        self.assertIn("12 choices made", browser.run(place))
        browser.run("URL.createObjectURL = (b) => { b.text().then((t) => { window.csv = t; });"
                    "return '#'; }; document.querySelector('#save').click();")
        browser.wait("window.csv")
        csv = browser.run("return window.csv;")
        self.assertEqual(browser.errors(), [])
        lines = csv.splitlines()
        self.assertEqual([line.split(",")[3] for line in lines[1:]],
                         ["B", "none", "none"] + ["A"] * 9)
        self.assertTrue(lines[1].startswith(f"{key['comparison']},Ann_ _x_,1,B,"), lines[1])
        path = self.folder / "ann.csv"
        path.write_text(csv, "utf8")
        found = json.loads(self.blind("-o", self.folder / "page", "--choices", path, "--json"))
        self.assertEqual(sum(pair["for_a"] + pair["for_b"] for pair in found["pairs"]), 10)
        first = key["trials"][0]
        wins = {name: 0 for name in SIDES}
        wins[first["right"]] += 1
        for trial in key["trials"][3:]:
            wins[trial["left"]] += 1
        for name in SIDES:
            self.assertEqual(wins[name], sum(pair["for_a"] * (pair["a"] == name)
                                             + pair["for_b"] * (pair["b"] == name)
                                             for pair in found["pairs"]))


if __name__ == "__main__":
    unittest.main()
