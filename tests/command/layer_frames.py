"""Frames with layers and a cryptomatte, filtered by the command and read back."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import exr

FRAMES = pathlib.Path(__file__).resolve().parents[1] / "data/layers"
CRYPTO = "ViewLayer.CryptoObject"
OBJECTS = ["wall", "post", "lamp", "ball"]
LENS = ["--set", "camera.focal_length_mm=35", "--set", "camera.sensor_width_mm=36", "--set",
        "camera.f_stop=0.7", "--set", "camera.focus_distance=3"]


def channel(layer, word):
    return f"ViewLayer.{layer}.{word}"


def largest_difference(first, second):
    return max(abs(a - b) for a, b in zip(first, second))


class Frames(unittest.TestCase):
    postchain = ""  # the command

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def run_on(self, pattern, chain, *options, code=0, output="out.####.exr"):
        done = subprocess.run(
            [self.postchain, "run", chain, "-i", pattern, "-o", f"{self.folder}/{output}",
             "--on-existing", "overwrite", *LENS, *options], capture_output=True, text=True,
            check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def chain(self, *passes):
        path = f"{self.folder}/chain.yaml"
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n  - ".join(["postchain: 1\npasses:", *passes]) + "\n")
        return path

    def filtered(self, chain, *options, frame=2):
        self.messages = self.run_on(f"{FRAMES}/layers.####.exr", chain, "--frames", str(frame),
                                    *options)
        return exr.read(f"{self.folder}/out.{frame:04}.exr")

    def sidecar(self, frame=2):
        with open(f"{self.folder}/out.{frame:04}.exr.json", encoding="utf-8") as file:
            return json.load(file)

    def matte_frame(self):
        """A frame whose light group key holds the mattes of three objects."""
        picture = exr.read(FRAMES / "layers.0002.exr")
        for word, name in zip("RGB", OBJECTS[1:]):
            picture.channels[channel("Combined_key", word)] = "f", exr.matte(picture, CRYPTO, name)
        path = f"{self.folder}/mattes.0002.exr"
        exr.write(path, picture)
        return path, picture


def main():
    """Runs the tests of the program: NAME_test.py POSTCHAIN [TEST ...]"""
    Frames.postchain = sys.argv.pop(1)
    unittest.main()
