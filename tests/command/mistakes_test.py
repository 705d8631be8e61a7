"""What the command says of a mistyped name, a misspelled option, and files without known channels.

usage: mistakes_test.py POSTCHAIN"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

import exr

POSTCHAIN = None
WIDTH, HEIGHT = 16, 9


def run(*words, folder=None):
    return subprocess.run([POSTCHAIN, *map(str, words)], cwd=folder, capture_output=True, text=True,
                          check=False)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name, channels=("R", "G", "B"), value=0.5):
        window = struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1)
        attributes = {"dataWindow": ("box2i", window), "displayWindow": ("box2i", window),
                      "lineOrder": ("lineOrder", b"\0"),
                      "pixelAspectRatio": ("float", struct.pack("<f", 1)),
                      "screenWindowCenter": ("v2f", bytes(8)),
                      "screenWindowWidth": ("float", struct.pack("<f", 1))}
        exr.write(self.folder / name, exr.Picture(WIDTH, HEIGHT, attributes, {
            channel: ("f", [value] * (WIDTH * HEIGHT)) for channel in channels}))

    def said(self, code, *words):
        done = run(*words, folder=self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stderr


class Names(Case):
    def test_another_form_of_the_number_is_named(self):
        for n in (1, 2):
            self.write(f"beauty.{n:04}.exr")
        for typed in ("beauty.#.exr", "beauty.*.exr", "beauty.%02d.exr", "beuaty.####.exr"):
            for words in (["inspect", typed], ["plan", "fast", "-i", typed],
                          ["diff", typed, "beauty.####.exr"] if "*" not in typed else
                          ["diff", typed, "beauty.0001.exr"]):
                self.assertIn(f"{typed}: ", said := self.said(4, *words))
                self.assertIn("(did you mean 'beauty.####.exr'?)", said)
        # The folder as it was typed, and a single frame by its own name.
        self.assertIn(f"(did you mean '{self.folder}/beauty.####.exr'?)",
                      self.said(4, "inspect", self.folder / "beauty.#.exr"))
        self.assertIn("(did you mean './beauty.0002.exr'?)",
                      self.said(4, "inspect", "./beuty.0002.exr"))
        self.assertIn("(did you mean 'beauty.####.exr'?)", self.said(4, "inspect", "beauty.0009.exr"))

    def test_nothing_is_named_that_is_not_like_it(self):
        self.write("beauty.0001.exr")
        for typed in ("depth_of_the_car.####.exr", "beauty.####.png", "no/beauty.####.exr"):
            self.assertNotIn("did you mean", self.said(4, "inspect", typed))


if __name__ == "__main__":
    POSTCHAIN = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=1)
