"""The report's filter in NumPy against the product, without jitter.

usage: guertin_test.py POSTCHAIN"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

import guertin

POSTCHAIN = sys.argv.pop(1)
CHAIN = "postchain: 1\npasses:\n  - motion_blur: {mode: %s, noise: none, max_blur_px: 16%s}\n"
SWITCHES = (("", {}), (", samples: 9, center_weight: 10", {"samples": 9, "kappa": 10.0}),
            (", sample_split: variance", {"u": "variance"}), (", depth_softness: 20", {"softness": 20.0}),
            (", variance_threshold_px: 4", {"gamma": 4.0}),
            (", velocity_storage: unorm8", {"encoding": "report"}), ("single", {"single": True}))


def channels(path, *names):
    image = oiio.ImageBuf(str(path))
    return image.get_pixels(oiio.FLOAT)[..., [image.spec().channelindex(name) for name in names]]


class Guertin(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.call("scene", "wheels", "-o", cls.folder, "--size", "96x54", "--frames", "1", "--on-existing",
                 "overwrite")
        layer = "ViewLayer."
        path = cls.folder / "sharp.0001.exr"
        cls.color = channels(path, *(f"{layer}Combined.{one}" for one in "RGB"))
        depth = channels(path, f"{layer}Depth.Z")[..., 0]
        cls.inverse_depth = np.where(depth < 1e10, 1 / depth, 0)
        cls.motion = channels(path, f"{layer}Vector.Z", f"{layer}Vector.W") * (-1, 1)

    @classmethod
    def call(cls, *words):
        subprocess.run([POSTCHAIN, *map(str, words), "-q"], check=True)

    def test_every_switch_that_both_have(self):
        for number, (text, switches) in enumerate(SWITCHES):
            with self.subTest(text):
                mode, more = ("single", "") if text == "single" else ("guertin", text)
                (self.folder / "chain.yaml").write_text(CHAIN % (mode, more))
                self.call("run", self.folder / "chain.yaml", "-i", self.folder / "sharp.####.exr", "--camera",
                          self.folder / "camera.json", "-o", self.folder / f"{number}.####.exr")
                # A name of its own for each picture: OpenImageIO keeps what it has read.
                expected = channels(self.folder / f"{number}.0001.exr", "ViewLayer.Combined.R",
                                    "ViewLayer.Combined.G", "ViewLayer.Combined.B")
                found = guertin.blur(self.color, self.inverse_depth, self.motion, r=16, noise="none", **switches)
                self.assertGreater(np.abs(expected - self.color).mean(), 0.01)
                apart = np.abs(found - expected).max(-1) / np.maximum(1, expected.max(-1))
                # Results are stored as halves. A tap that rounds the other way reads another pixel.
                self.assertGreater((apart < 1e-3).mean(), 0.999)


if __name__ == "__main__":
    unittest.main()
