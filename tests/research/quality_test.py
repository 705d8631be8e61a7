"""The table of errors on a small generated scene whose two halves of ground truth are known.

usage: quality_test.py POSTCHAIN"""
import argparse
import contextlib
import io
import json
import math
import pathlib
import shutil
import sys
import tempfile
import unittest

import quality
import quality_tables

POSTCHAIN = sys.argv.pop(1)


def main(*arguments):
    """What it prints."""
    sys.argv = ["quality.py", *map(str, arguments)]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as refused:
        quality.main()
    return out.getvalue() + refused.getvalue()


class Quality(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.wheels = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        quality.call(POSTCHAIN, "scene", "wheels", "-o", cls.wheels, "--size", "64x36", "--frames", "11",
                     "--truth-samples", "16", "--on-existing", "overwrite")

    def setUp(self):
        self.data = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.scene = self.data / "wheels"
        shutil.copytree(self.wheels, self.scene)

    def shift(self, name, value):
        """mb.0011.exr plus a value, as another file."""
        quality.call("oiiotool", self.scene / "mb.0011.exr", "--addc", value, "-o", self.scene / name)

    def run_it(self, *arguments):
        """Its output, and the figures."""
        table = [] if "--table" in arguments else ["--table", "motion"]
        printed = main(POSTCHAIN, f"{self.data}:11", "--repeat", "1", *table, "--json", self.data / "out.json",
                       *arguments)
        return printed, json.loads((self.data / "out.json").read_text())["figures"]

    def test_psnr_is_without_the_noise_of_two_halves(self):
        printed, figures = self.run_it("--row", "25 samples")
        self.assertNotIn("noise", printed)
        self.assertNotIn("psnr_of_noise", figures[0])
        self.shift("mb_a.0011.exr", 0.05)
        self.shift("mb_b.0011.exr", -0.05)
        halves = quality.call(POSTCHAIN, "diff", self.scene / "mb_a.0011.exr", self.scene / "mb_b.0011.exr",
                              "--metric", "psnr", "--json")
        printed, (noise, again) = self.run_it("--row", "25 samples")
        self.assertIsNone(noise["chain"])
        of_noise = 10**(-json.loads(halves)["psnr"] / 10) / 4
        self.assertAlmostEqual(again["psnr_of_noise"], -10 * math.log10(of_noise))
        self.assertEqual(again["psnr"], figures[0]["psnr"])
        self.assertAlmostEqual(10**(-again["psnr_without_noise"] / 10) + of_noise, 10**(-again["psnr"] / 10))
        self.assertIn(f"| noise of the ground truth | {again['psnr_of_noise']:.2f} / ", printed)
        self.assertIn(f"| `guertin`, 25 samples | {again['psnr_without_noise']:.2f} / ", printed)

    def test_peers_are_rows_of_the_scenes_that_have_them(self):
        printed, figures = self.run_it("--row", "Blender")
        self.assertEqual(figures, [])
        self.assertRegex(printed, "peer_vectorblur_best.0011.exr is missing")
        shutil.copy(self.scene / "mb.0011.exr", self.scene / "peer_vectorblur_best.0011.exr")
        printed, figures = self.run_it("--row", "Blender")
        self.assertEqual(figures[0]["psnr"], 200)
        self.assertIn("| Blender's Vector Blur", printed)

    def test_rows_with_the_layer_behind_need_it(self):
        row = ["--table", "both", "--row", "`best`"]
        printed, figures = self.run_it(*row)
        self.assertEqual(len(figures), 1)
        self.assertRegex(printed, "behind.0011.exr is missing")
        shutil.rmtree(self.scene)
        quality.call(POSTCHAIN, "scene", "crossing", "-o", self.data / "crossing", "--size", "96x54",
                     "--frames", "11", "--truth-samples", "64", "--behind")
        printed, figures = self.run_it(*row)
        self.assertIn("| `best` with the layer behind | ", printed)
        self.assertGreater(figures[1]["psnr"], figures[0]["psnr"] + 0.1)

    def test_the_baseline_is_a_stage_among_passes(self):
        blur = "motion_blur: {mode: guertin}"
        self.assertEqual(quality.stages(f"{blur} ; fxaa: {{}} ; {quality.BASELINE} ; {blur}"),
                         [f"{blur} ; fxaa: {{}}", quality.BASELINE, blur])
        options = argparse.Namespace(postchain=POSTCHAIN)
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "out.0011.exr"
            found = []
            for chain in (blur, f"{blur} ; {quality.BASELINE}", f"{blur} ; {quality.BASELINE} ; {blur}"):
                quality.run_chain(options, chain, self.scene, 11, pathlib.Path(folder))
                found.append(quality.errors(options, self.scene / "both.0011.exr", out)[0])
        self.assertEqual(len(set(found)), 3, found)
        printed, figures = self.run_it("--table", "both", "--row", "scatter as gather", "--row", "`paper`")
        errors = {figure["row"]: figure["psnr"] for figure in figures}
        self.assertEqual(len(set(errors.values())), 3, errors)  # paper and both orders differ
        self.assertGreater(min(errors.values()), 20)
        self.assertRegex(printed, r"scatter as gather, then `guertin`, 401 samples \| .* \|  \|")

    def test_tables_are_written_between_marks(self):
        mark = quality_tables.MARK
        page = self.data / "page.md"
        page.write_text(f"before\n{mark}\nold\n{mark}\nafter\n")
        printed, _ = self.run_it("--row", "25 samples", "--write", str(page))
        self.assertRegex(page.read_text(), rf"^before\n{mark}\n\n\| frame 11, `mb` \| wheels \| mean \|\n"
                         rf"(\|---){{3}}\|\n\| `guertin`, 25 samples \| [^\n]*\n\n{mark}\nafter\n$")
        self.assertIn("| frame 11, `mb` | wheels | mean | time |\n|---|---|---|---|\n", printed)
        page.write_text("no marks")
        with self.assertRaisesRegex(SystemExit, "needs two lines"):
            quality_tables.write_between_marks(page, "")

    def test_figures_of_runs_are_merged(self):
        def figure(scene, row, psnr):
            return {"set": "s", "table": "lens", "frame": 11, "scene": scene, "row": row, "psnr": psnr,
                    "hdr_flip": 0.1, "ssim": 0.5, "ms": 0, "rim_pixels": 0, "rim_psnr": None}
        paths = []
        for scene, psnr in (("b", 30), ("a", 20)):
            paths.append(self.data / f"{scene}.json")
            rows = ["a former row", "`best`: `joint_blur`, 128 samples, 8 starts", "`paper`"] \
                if scene == "a" else ["`paper`"]
            paths[-1].write_text(json.dumps({"commit": f"of-{scene}", "version": f"v{scene}", "figures": [
                figure(scene, row, psnr) for row in rows]}))
        merged = self.data / "merged.json"
        out = main(POSTCHAIN, *paths, "--json", merged)
        self.assertEqual(out, "| frame 11, `dof` | a | b | mean | time |\n|---|---|---|---|---|\n"
                         "| `paper` | 20.00 / .100 / .500 | 30.00 / .100 / .500 | 25.00 / .100 / .500 |  |\n"
                         "| `best`: `joint_blur`, 128 samples, 8 starts | 20.00 / .100 / .500 | - | - |  |\n"
                         "| a former row | 20.00 / .100 / .500 | - | - |  |\n\n")
        content = json.loads(merged.read_text())
        self.assertEqual((content["commit"], content["version"]), ("of-a, of-b", "va, vb"))

    def test_exact_shots_follow_the_other_tables(self):
        def chain(error, still):
            return {metric: {"mean": still if metric.endswith("still") else error}
                    for metric in quality_tables.EXACT}
        figures = {"pan": {"fast": chain(0.25, 0.5), "best": chain(0.125, None)},
                   "stop": {"fast": chain(0.75, 0.5), "best": chain(0.375, 0.25)}}
        program = self.data / "exact_shots"
        program.write_text(f"#!{sys.executable}\nimport sys\n"
                           f"open(sys.argv[1].removeprefix('--json='), 'w').write({json.dumps(figures)!r})\n")
        program.chmod(0o755)
        other, found = self.data / "other.json", self.data / "found.json"
        other.write_text(json.dumps({"commit": "c", "version": "v", "figures": []}))
        printed = main(POSTCHAIN, other, "--exact", program, "--json", found)
        self.assertIn("| exact shots, error | fast | best |\n|---|---|---|\n| pan | .2500 | .1250 |\n"
                      "| stop | .7500 | .3750 |\n| mean | .5000 | .2500 |\n\n", printed)
        self.assertIn("| exact shots, temporal_error_still | fast | best |\n|---|---|---|\n"
                      "| stop | .500 | .250 |\n| mean | .500 | .250 |\n\n", printed)
        self.assertEqual(json.loads(found.read_text())["exact"], figures)
        self.assertEqual(main(POSTCHAIN, found), printed)

    def test_rims_have_a_table_of_their_own(self):
        channels = [f"ViewLayer.{group}.{letter}" for group, letters in
                    (("Combined", "RGBA"), ("Depth", "Z"), ("Vector", "XYZW")) for letter in letters]
        quality.call("oiiotool", "--create", "64x36", "9", "--chnames", ",".join(channels),
                     "--fill:color=0.1,0.1,0.1,1,3,0,0,0,0", "64x36", "--fill:color=90,90,90,1,3,0,0,0,0",
                     "2x2+31+17", "-d", "float", "-o", self.scene / "sharp.0011.exr")
        camera = json.loads((self.scene / "camera.json").read_text())
        camera["f_stop"] = 0.2  # a radius of five pixels
        (self.scene / "camera.json").write_text(json.dumps(camera))
        for value, name in ((9, "dof"), (8, "peer_defocus")):
            quality.call("oiiotool", "--create", "64x36", "3", "--fill:color=0.1,0.1,0.1", "64x36",
                         f"--fill:color={value},{value},{value}", "9x9+27+14", "-o",
                         self.scene / f"{name}.0011.exr")
        printed, figures = self.run_it("--table", "lens", "--row", "Blender")
        self.assertGreater(figures[0]["rim_pixels"], 30)
        self.assertLess(figures[0]["rim_psnr"], figures[0]["psnr"])
        self.assertIn(f"| pixels | {figures[0]['rim_pixels']} |  |", printed)
        self.assertIn(f"| Blender's Defocus | {figures[0]['rim_psnr']:.2f} | ", printed)


unittest.main()
