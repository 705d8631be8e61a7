"""The table of errors on a small generated scene whose two halves of ground truth are known.

usage: quality_test.py POSTCHAIN"""
import contextlib
import io
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import quality

POSTCHAIN = sys.argv.pop(1)


class Quality(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.data = pathlib.Path(temporary.name)
        self.scene = self.data / "wheels"
        subprocess.run([POSTCHAIN, "scene", "wheels", "-o", self.scene, "--size", "64x36", "--frames",
                        "11", "--truth-samples", "16"], check=True, capture_output=True)

    def shift(self, name, value):
        """mb.0011.exr plus a value, as another file."""
        subprocess.run(["oiiotool", self.scene / "mb.0011.exr", "--addc", str(value), "-o",
                        self.scene / name], check=True)

    def run_it(self, *arguments):
        """What it prints, and the figures."""
        sys.argv = ["quality.py", POSTCHAIN, f"{self.data}:11", "--table", "motion", "--repeat", "1",
                    "--json", str(self.data / "out.json"), *arguments]
        with contextlib.redirect_stdout(io.StringIO()) as out, \
                contextlib.redirect_stderr(io.StringIO()) as refused:
            quality.main()
        return (out.getvalue() + refused.getvalue(),
                json.loads((self.data / "out.json").read_text())["figures"])

    def test_psnr_is_without_the_noise_of_two_halves(self):
        printed, figures = self.run_it("--row", "25 samples")
        self.assertNotIn("noise", printed)
        self.assertNotIn("psnr_of_noise", figures[0])
        self.shift("mb_a.0011.exr", 0.05)
        self.shift("mb_b.0011.exr", -0.05)
        halves = subprocess.run([POSTCHAIN, "diff", self.scene / "mb_a.0011.exr",
                                 self.scene / "mb_b.0011.exr", "--metric", "psnr", "--json"],
                                check=True, capture_output=True, text=True).stdout
        printed, again = self.run_it("--row", "25 samples")
        of_noise = 10**(-json.loads(halves)["psnr"] / 10) / 4
        self.assertAlmostEqual(again[0]["psnr_of_noise"], -10 * math.log10(of_noise))
        self.assertEqual(again[0]["psnr"], figures[0]["psnr"])
        self.assertAlmostEqual(10**(-again[0]["psnr_without_noise"] / 10) + of_noise,
                               10**(-again[0]["psnr"] / 10))
        self.assertIn(f"| noise of the ground truth | {again[0]['psnr_of_noise']:.2f} / ", printed)
        self.assertIn(f"| `guertin`, 25 samples | {again[0]['psnr_without_noise']:.2f} / ", printed)

    def test_peers_are_rows_only_if_every_scene_has_them(self):
        printed, figures = self.run_it("--row", "Blender")
        self.assertEqual(figures, [])
        self.assertRegex(printed, "no row .Blender's Vector Blur.*peer_vectorblur_best.0011.exr is missing")
        shutil.copy(self.scene / "mb.0011.exr", self.scene / "peer_vectorblur_best.0011.exr")
        printed, figures = self.run_it("--row", "Blender")
        self.assertEqual(figures[0]["psnr"], 200)
        self.assertIn("| Blender's Vector Blur", printed)


unittest.main()
