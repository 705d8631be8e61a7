"""postchain sheet: frames of one color each, located in the image, which is decoded here by the
PNG specification.

usage: sheet_test.py POSTCHAIN"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import exr
from png import read_png

POSTCHAIN = None
HALVED = pathlib.Path(__file__).resolve().parents[1] / "data/halved.ocio"
WIDTH, HEIGHT = 64, 36


def shown(value):
    """x / (1 + x), then the power 1 / 2.2, as a byte."""
    return round(255 * (value / (1 + value)) ** (1 / 2.2))


class Sheet(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name, color, width=WIDTH, height=HEIGHT):
        """color: three numbers, or a function of x and y."""
        at = color if callable(color) else lambda x, y: color
        pixels = [at(x, y) for y in range(height) for x in range(width)]
        exr.write(self.folder / name, exr.flat(width, height, {
            word: [p[i] for p in pixels] for i, word in enumerate("RGB")}))

    def sequence(self, numbers):
        """Frame n has the color (n / 4, 0, 1 / n)."""
        for n in numbers:
            self.write(f"o.{n:04}.exr", (n / 4, 0, 1 / n))
        return {n: (shown(n / 4), 0, shown(1 / n)) for n in numbers}

    def sheet(self, *options, code=0, source="o.####.exr", output="sheet.png"):
        done = subprocess.run([POSTCHAIN, "sheet", source, "-o", output, *options],
                              cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.said = done.stdout + done.stderr
        return read_png(self.folder / output) if code in (0, 1) else None

    def place_of(self, color, sheet):
        """Upper left corner and size of the rectangle with this color."""
        width, _, rows = sheet
        found = [(x, y) for y, row in enumerate(rows) for x in range(width)
                 if row[3 * x:3 * x + 3] == bytes(color)]
        if not found:
            return None
        left, top = min(x for x, _ in found), min(y for _, y in found)
        size = max(x for x, _ in found) + 1 - left, max(y for _, y in found) + 1 - top
        self.assertEqual(len(found), size[0] * size[1])
        return left, top, *size

    def below(self, place, sheet, rows=24):
        """The label: the rows below a thumbnail, over its width."""
        left, top, width, height = place
        return [sheet[2][y][3 * left:3 * (left + width)]
                for y in range(top + height, top + height + rows)]

    def test_each_frame_stands_in_its_place_with_its_number(self):
        colors = self.sequence(range(1, 8))
        sheet = self.sheet("--width", "64", "--columns", "3")
        places = {n: self.place_of(color, sheet) for n, color in colors.items()}
        for place in places.values():
            self.assertEqual(place[2:], (64, 36))
        # In rows of three.
        self.assertEqual(sorted(places, key=lambda n: places[n][1::-1]), list(range(1, 8)))
        self.assertEqual([len({p[i] for p in places.values()}) for i in (0, 1)], [3, 3])
        labels = {n: self.below(place, sheet) for n, place in places.items()}
        for n, label in labels.items():
            self.assertGreater(len(set(b"".join(label))), 1, n)
            self.assertEqual([m for m in labels if labels[m] == label], [n])
        # The label depends only on the number.
        some = self.sheet("--cells", "3", "--width", "64", "--on-existing", "overwrite")
        there = {n: self.place_of(color, some) for n, color in colors.items()}
        self.assertEqual([n for n in there if there[n]], [1, 4, 7])
        self.assertEqual(self.below(there[4], some), labels[4])

    def test_light_is_averaged_before_it_is_shown(self):
        self.write("o.0001.exr", lambda x, y: (2.0 * ((x + y) % 2), 3.0 * (x % 2), 0.5))
        sheet = self.sheet("--width", "16")
        self.assertEqual(self.place_of((shown(1), shown(1.5), shown(0.5)), sheet)[2:], (16, 9))

    def test_the_input_beside_the_output(self):
        colors = self.sequence([1, 2])
        for n in (1, 2):
            self.write(f"i.{n:04}.exr", (0, n, 0))
        sheet = self.sheet("--beside", "i.####.exr", "--width", "64")
        for n in (1, 2):
            left, right = self.place_of(colors[n], sheet), self.place_of((0, shown(n), 0), sheet)
            self.assertEqual((left[0] + 64, left[1]), right[:2])

    def test_the_view_of_a_configuration(self):
        self.sequence([2])
        sheet = self.sheet("--ocio", HALVED, "--width", "64")
        self.assertIsNotNone(self.place_of((64, 0, 64), sheet))
        self.sheet("--ocio", HALVED, "--ocio-view", "Film", "--on-existing", "overwrite", code=2)
        self.assertIn("Halved", self.said)

    def test_another_size_is_fitted(self):
        colors = self.sequence([1])
        self.write("o.0002.exr", (0, 1, 0), 36, 36)
        sheet = self.sheet("--width", "64")
        self.assertEqual(self.place_of(colors[1], sheet)[2:], (64, 36))
        self.assertEqual(self.place_of((0, shown(1), 0), sheet)[2:], (36, 36))

    def test_what_is_not_there_or_damaged_is_shown_so(self):
        colors = self.sequence([1, 2, 4])
        whole = (self.folder / "o.0002.exr").read_bytes()
        (self.folder / "o.0002.exr").write_bytes(whole[:-99])
        sheet = self.sheet("--frames", "1-4", "--width", "128", code=1)
        self.assertIn("o.0002.exr", self.said)
        self.assertIn("1 image is not on disk", self.said)
        self.assertEqual([n for n in (1, 2, 4) if self.place_of(colors[n], sheet)], [1, 4])
        self.sheet(source="o.0002.exr", output="none.png", code=4)
        self.assertFalse((self.folder / "none.png").exists())

    def test_what_is_refused(self):
        self.sequence([1])
        self.sheet(output="sheet.jpg", code=2)
        self.sheet("--width", "4096", "--columns", "5", "--frames", "1-9", code=2)
        self.assertIn("--width", self.said)
        self.sheet("--ocio-view", "Film", code=2)
        self.assertIn("--ocio-view needs an OpenColorIO configuration", self.said)
        self.assertNotIn("--png", self.said)
        self.sheet(output="s.0001.png")
        # The name of one more frame.
        self.sheet("--on-existing", "overwrite", source="s.####.png", output="s.0002.png", code=2)
        self.assertFalse((self.folder / "s.0002.png").exists())


if __name__ == "__main__":
    POSTCHAIN = os.path.abspath(sys.argv.pop(1))
    unittest.main()
