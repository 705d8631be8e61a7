"""postchain blind: the page, its key, the choices of observers and what follows from them.

usage: blind_test.py POSTCHAIN"""
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "page"))
from browser import Browser  # noqa: E402

POSTCHAIN = sys.argv.pop(1)
SIDES = ["plain", "streaks", "circles"]
HEADER = "kit,observer,trial,choice,seconds\n"


def tail(first, last, n, share):
    return math.fsum(math.comb(n, k) * share ** k * (1 - share) ** (n - k)
                     for k in range(first, last + 1))


def share_at(f):
    """The share at which a rising f is 0.025."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if f(middle) < 0.025 else (low, middle)
    return low


class Blind(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        subprocess.run([POSTCHAIN, "scene", "wheels", "-o", cls.folder / "in", "--size", "48x27",
                        "--frames", "1-4", "--truth-samples", "2"], check=True, capture_output=True)
        cls.sides = [f"plain={cls.folder}/in/sharp.####.exr", f"streaks={cls.folder}/in/mb.####.exr",
                     f"circles={cls.folder}/in/dof.####.exr"]

    def blind(self, *words, code=0):
        done = subprocess.run([POSTCHAIN, "blind", *map(str, words)], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout if code == 0 else done.stderr

    def kit(self, name, *more):
        """The data of a new page, and its key."""
        out = self.folder / name
        self.blind(*self.sides, "-o", out, *more)
        page = (out / "index.html").read_text("utf8")
        data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.S)[1])
        return page, data, json.loads((out / "key.json").read_text("utf8"))

    def test_pairs_are_complete_shuffled_and_nameless(self):
        page, data, key = self.kit("one")
        pairs = sorted((trial["frame"], *sorted([trial["left"], trial["right"]]))
                       for trial in key["trials"])
        self.assertEqual(pairs, sorted((frame, *sorted([a, b])) for frame in (1, 2, 3, 4)
                                       for a, b in [SIDES[:2], SIDES[1:], SIDES[::2]]))
        order = [SIDES.index(trial["left"]) < SIDES.index(trial["right"]) for trial in key["trials"]]
        self.assertEqual(set(order), {True, False})
        self.assertNotEqual([trial["frame"] for trial in key["trials"]], sorted([1, 2, 3, 4] * 3))
        for name in SIDES + ["sharp", "mb.", "dof"]:
            self.assertNotIn(f'"{name}', page)
        # Equal pictures of equal sides, once each.
        self.assertEqual(len(data["images"]), 12)
        seen = {}
        for shown, true in zip(data["trials"], key["trials"]):
            self.assertIsNone(shown["truth"])
            for side in ("left", "right"):
                self.assertEqual(seen.setdefault((true["frame"], true[side]), shown[side]), shown[side])
        self.assertEqual(len(set(seen.values())), 12)
        # The seed decides.
        again, *_ = self.kit("again")
        self.assertEqual(again, page)
        _, _, other = self.kit("other", "--seed", "2")
        self.assertNotEqual(other["trials"], key["trials"])
        self.assertNotEqual(other["kit"], key["kit"])

    def test_other_images_of_the_same_names_are_another_kit(self):
        _, _, first = self.kit("images")
        rows = self.write("images.csv", [[first["kit"], "x", 1, "A", 1]])
        self.blind("-o", self.folder / "images", "--choices", rows)
        self.blind(self.sides[0], f"streaks={self.folder}/in/both.####.exr", self.sides[2], "-o",
                   self.folder / "images", "--on-existing", "overwrite")
        key = json.loads((self.folder / "images/key.json").read_text("utf8"))
        self.assertEqual(key["trials"], first["trials"])
        self.assertIn("belongs to kit " + first["kit"],
                      self.blind("-o", self.folder / "images", "--choices", rows, code=4))

    def test_ground_truth_is_a_reference(self):
        _, data, _ = self.kit("truth", "--truth", self.folder / "in/both.####.exr", "--frames", "2")
        self.assertEqual({trial["truth"] is None for trial in data["trials"]}, {False})
        self.assertEqual(len(data["images"]), 4)

    def write(self, name, rows):
        path = self.folder / name
        path.write_text(HEADER + "".join(",".join(map(str, row)) + "\n" for row in rows), "utf8")
        return path

    def test_choices_are_counted_for_the_true_sides(self):
        _, _, key = self.kit("counted")
        # Who prefers streaks to everything; the second observer sees no difference to circles.
        files = []
        for observer in range(3):
            rows = []
            for i, trial in enumerate(key["trials"]):
                names = [trial["left"], trial["right"]]
                choice = "none" if "streaks" not in names else "AB"[names.index("streaks")]
                if observer == 1 and "circles" in names:
                    choice = "none"
                rows.append([key["kit"], f"observer {observer}", i + 1, choice, 1.5])
            files.append(self.write(f"c{observer}.csv", rows))
        text = self.blind("-o", self.folder / "counted", "--choices", *files, "--json")
        self.assertEqual(text.count("\n"), 1)
        found = json.loads(text)
        self.assertEqual(found["observers"], 3)
        pairs = {(pair["a"], pair["b"]): pair for pair in found["pairs"]}
        counts = {name: (pair["for_a"], pair["for_b"], pair["no_difference"])
                  for name, pair in pairs.items()}
        self.assertEqual(counts, {("plain", "streaks"): (0, 12, 0), ("plain", "circles"): (0, 0, 12),
                                  ("streaks", "circles"): (8, 0, 4)})
        low, high = pairs["plain", "streaks"]["share_b_interval"]
        self.assertAlmostEqual(low, share_at(lambda p: tail(12, 12, 12, p)), 9)
        self.assertEqual(high, 1)
        self.assertIsNone(pairs["plain", "circles"]["share_b_interval"])
        # Three questions: the smallest probability times 3, the next times 2.
        self.assertAlmostEqual(pairs["plain", "streaks"]["probability"], 2 / 2 ** 12, 12)
        self.assertAlmostEqual(pairs["plain", "streaks"]["probability_holm"], 6 / 2 ** 12, 12)
        self.assertAlmostEqual(pairs["streaks", "circles"]["probability_holm"], 4 / 2 ** 8, 12)
        self.assertEqual(pairs["plain", "circles"]["probability_holm"], 1)
        text = self.blind("-o", self.folder / "counted", "--choices", *files)
        self.assertIn("streaks against plain: 12 to 0, no difference 0 times; preferred in 100 % "
                      "(74 to 100 %), p 0.001465\n", text)

    def test_what_is_wrong_with_choices_is_named(self):
        _, _, key = self.kit("wrong")
        out, kit = self.folder / "wrong", key["kit"]
        for rows, said in (
                ([["0" * 16, "x", 1, "A", 1]], f"belongs to kit {'0' * 16}, and this folder is kit {kit}"),
                ([[kit, "x", 1, "A", 1], [kit, "x", 1, "B", 1]],
                 "c.csv:3: observer 'x' has answered trial 1 before"),
                ([[kit, "x", 13, "A", 1]], "c.csv:2: trial 13 is not in 1..12"),
                ([[kit, "x", 1, "C", 1]], "c.csv:2: choice C is not A, B or none"),
                ([[kit, "", 1, "A", 1]], "c.csv:2: names no observer"),
                ([[kit, "x", 1, "A"]], "c.csv:2: has 4 fields instead of 5")):
            self.assertIn(said, self.blind("-o", out, "--choices", self.write("c.csv", rows), code=4))
        path = self.folder / "c.csv"
        path.write_text("a,b\n", "utf8")
        self.assertIn("c.csv:1: the first line is not kit,", self.blind("-o", out, "--choices", path,
                                                                        code=4))
        path.write_text("", "utf8")
        self.assertIn("c.csv:1: the first line is not kit,", self.blind("-o", out, "--choices", path,
                                                                        code=4))
        # As a spreadsheet saves it.
        path.write_bytes(b"\xef\xbb\xbf" + HEADER.strip().encode() + b"\r\n" + f"{kit},x,1,A,1\r\n".encode())
        self.assertIn("1 choice of 1 observer, 12 pairs of images", self.blind("-o", out, "--choices", path))
        # Nothing that the evaluation would ignore.
        for more in (["--frames", "1"], ["--seed", "2"], ["--truth", "both.####.exr"],
                     ["--input-transfer", "srgb"], ["--threads", "2"], ["--on-existing", "overwrite"]):
            self.assertIn("excludes", self.blind("-o", out, "--choices", path, *more, code=2))
        self.assertIn("--json requires --choices",
                      self.blind(*self.sides, "-o", self.folder / "json", "--json", code=2))
        changed = out / "key.json"
        changed.write_text(changed.read_text("utf8").replace('"frame": 1,', '"frame": 2,', 1), "utf8")
        self.assertIn("is not the key of a blind comparison, or was changed",
                      self.blind("-o", out, "--choices", self.write("c.csv", []), code=4))

    def test_what_is_wrong_with_sides_is_named(self):
        out = self.folder / "none"
        self.assertIn("a comparison needs two sides", self.blind(self.sides[0], "-o", out, code=2))
        self.assertIn("--seed", self.blind(*self.sides, "-o", out, "--seed", "-1", code=2))
        self.assertIn("is not NAME=OUT", self.blind(self.sides[0], "x.####.exr", "-o", out, code=2))
        self.assertIn("two sides are named plain", self.blind(self.sides[0], self.sides[0], "-o", out,
                                                              code=2))
        self.assertIn("no frame in common",
                      self.blind(self.sides[0], f"gone={self.folder}/gone.####.exr", "-o", out, code=4))
        subprocess.run([POSTCHAIN, "scene", "wheels", "-o", self.folder / "large", "--size", "96x54",
                        "--frames", "1", "--truth-samples", "2"], check=True, capture_output=True)
        for more in (["large=" + f"{self.folder}/large/mb.####.exr"],
                     [self.sides[1], "--truth", f"{self.folder}/large/both.####.exr"]):
            self.assertIn("is 96x54 and the first side's frame 48x27",
                          self.blind(self.sides[0], *more, "-o", out, "--frames", "1", code=4))
        self.assertFalse(out.exists())
        # A folder of others is not written to, nor one in which an input lies.
        mine = self.folder / "mine"
        mine.mkdir()
        (mine / "notes.txt").write_text("mine", "utf8")
        self.blind(*self.sides, "-o", mine, "--on-existing", "overwrite", code=5)
        self.assertEqual([path.name for path in mine.iterdir()], ["notes.txt"])
        self.blind(*self.sides, "-o", self.folder / "in", code=2)
        self.kit("kept")
        self.assertIn("--on-existing", self.blind(*self.sides, "-o", self.folder / "kept", code=5))
        self.blind(*self.sides, "-o", self.folder / "kept", "--on-existing", "overwrite")

    def test_an_observer_at_the_page(self):
        _, _, key = self.kit("page", "--truth", self.folder / "in/both.####.exr")
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
        self.assertTrue(lines[1].startswith(f"{key['kit']},Ann_ _x_,1,B,"), lines[1])
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
