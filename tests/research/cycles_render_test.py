"""Renders small frames of each Cycles scene and reads them with the command.

usage: render_test.py POSTCHAIN [BLENDER]"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "tools/research/cycles"
sys.path[:0] = [str(SCRIPTS), str(ROOT / "tests/support")]
import dataset  # noqa: E402
import request  # noqa: E402
from skips import skip  # noqa: E402

try:
    import OpenImageIO
except ImportError:
    skip("no OpenImageIO in Python", "python3-openimageio")
if len(sys.argv) < 3:
    skip("no Blender", "blender")


def run_script(name, *arguments):
    done = subprocess.run(
        [BLENDER, "-b", "--factory-startup", "--python-exit-code", "1", "-P", SCRIPTS / name, "--", *arguments],
        capture_output=True, text=True, check=False, env=request.blender_environment())
    if done.returncode != 0:
        raise AssertionError(done.stdout + done.stderr)


def render(scene, folder, *options):
    run_script("render.py", scene, folder, "--size", "96x54", "--samples", "4", "--sharp-samples", "4", *options)


def psnr(reference, image):
    return json.loads(subprocess.run([POSTCHAIN, "diff", reference, image, "--metric", "psnr", "--json"],
                                     capture_output=True, text=True, check=True).stdout)["psnr"]


def inspect(folder, name, *options):
    return subprocess.run([POSTCHAIN, "inspect", "-q", "--camera", f"{folder}/camera.json",
                           f"{folder}/{name}", *options], capture_output=True, text=True,
                          check=True).stdout


class Render(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def described(self, kind, frame):
        return json.loads(inspect(self.folder, f"{kind}.{frame:04d}.exr", "--json"))

    def test_scenes(self):
        """First frame; px of motion at 96x54, inverse depth of the farthest and nearest surface per meter."""
        sky = 1e-10
        tuning = {"corridor": (6, 4, sky, 1.25), "dancers": (6, 4, 1 / 4, 1.16), "garden": (6, 4, sky, 1.12)}
        test = {"meadow": (11, 10, sky, 1.65), "glass": (11, 8, 1 / 3.5, 1.2), "canopy": (11, 8, sky, 1.7),
                "night": (11, 4, sky, 0.21), "acrobat": (11, 7, 1 / 5.3, 1.1), "whip": (11, 10, sky, 0.5),
                "facade": (11, 2, 1 / 62, 1 / 12.9), "rain": (11, 10, 1 / 8, 1.7), "station": (11, 8, sky, 0.8)}
        self.assertEqual(list(test), dataset.SCENES)
        # By frame: what is animated in the camera.
        cameras = {"dancers": ("focus_distance", [2.07, 2.03]), "whip": ("focal_length_mm", [38, 42.5])}
        for scene, (frame, least_px, farthest, nearest) in (tuning | test).items():
            with self.subTest(scene), tempfile.TemporaryDirectory() as self.folder:
                render(scene, self.folder, "--frames", f"{frame}-{frame + 1}", "--kinds", "gbuf")
                # The vectors of the frame lead to the next with the signs of the profile `cycles`.
                best = re.search(r"sign self-check.*\n +(.*)", inspect(self.folder, "gbuf.####.exr"))
                self.assertIsNotNone(best)
                self.assertRegex(best[1], r"^motion \(\+x, \+y\).*as converted")
                bounds = self.described("gbuf", frame)["bounds"]
                self.assertGreater(bounds["max_speed_px"], least_px)
                self.assertAlmostEqual(bounds["min_inverse_depth"] / farthest, 1, delta=0.1)
                self.assertAlmostEqual(bounds["max_inverse_depth"] / nearest, 1, delta=0.3)
                self.assertEqual(bounds["min_color"][3], 1)
                key, values = cameras.get(scene, ("focal_length_mm", []))
                for number, value in enumerate(values, frame):
                    self.assertAlmostEqual(self.described("gbuf", number)["frame"]["camera"][key], value, places=2)

    def test_a_run_adds_to_the_files_of_others(self):
        render("zoom", self.folder, "--frames", "6-7", "--kinds", "gbuf")
        render("zoom", self.folder, "--frames", "6", "--kinds", "gbuf,sharp,mb,dof,both")
        self.assertEqual({path.name for path in pathlib.Path(self.folder).iterdir()},
                         {"camera.json", "gbuf.0006.exr", "gbuf.0007.exr", "sharp.0006.exr", "mb.0006.exr",
                          "dof.0006.exr", "both.0006.exr"})
        camera = json.loads((pathlib.Path(self.folder) / "camera.json").read_text("utf8"))
        self.assertEqual(list(camera["frames"]), ["6", "7"])

    def test_without_sky_or_stage(self):
        for scene in ("garden", "dancers"):
            with tempfile.TemporaryDirectory() as self.folder:
                render(scene, self.folder, "--frames", "6", "--kinds", "gbuf,both", "--transparent")
                for kind in ("gbuf", "both"):
                    bounds = self.described(kind, 6)["bounds"]
                    self.assertEqual([bounds[bound][3] for bound in ("min_color", "max_color")], [0, 1], (scene, kind))

    def test_halves_differ_by_their_noise(self):
        for half in "ab":
            render("whip", self.folder, "--frames", "11", "--kinds", "both", "--half", half)
        between = psnr(f"{self.folder}/both_a.0011.exr", f"{self.folder}/both_b.0011.exr")
        self.assertTrue(15 < between < 40, between)

    def test_peers_are_the_best_of_the_nodes_settings(self):
        render("canopy", self.folder, "--frames", "11", "--kinds", "sharp,both,mb,dof")
        run_script("peers.py", self.folder, "11")
        settings = pathlib.Path(self.folder) / "peers.0011.json"
        found = json.loads(settings.read_text("utf8"))
        self.assertEqual(list(found), list(dataset.PEERS))
        for name, truth in dataset.PEERS.items():
            filtered, sharp = (psnr(f"{self.folder}/{truth}.0011.exr", f"{self.folder}/{one}.0011.exr")
                               for one in (name, "sharp"))
            self.assertAlmostEqual(found[name]["psnr"], filtered, delta=0.01)
            self.assertGreater(filtered, sharp, name)
        for other in ("mb", "both"):
            (pathlib.Path(self.folder) / f"{other}.0011.exr").unlink()
        run_script("peers.py", self.folder, "11")
        self.assertEqual(json.loads(settings.read_text("utf8")),
                         {"peer_defocus": found["peer_defocus"]}, "the only ground truth that is left")

    def depths(self, kind, frame):
        image = OpenImageIO.ImageBuf(f"{self.folder}/{kind}.{frame:04d}.exr")
        return image.get_pixels()[:, :, image.spec().channelnames.index("ViewLayer.Depth.Z")]

    def test_behind_is_farther_than_what_hides_it(self):
        render("canopy", self.folder, "--frames", "11", "--kinds", "sharp,behind")
        hides, hidden = self.depths("sharp", 11), self.depths("behind", 11)
        sky = 1e9
        self.assertGreater(((hides < sky) & (hidden < sky)).mean(), 0.3)
        self.assertGreater(((hidden > hides) | (hidden >= sky)).mean(), 0.99)

    def test_zoom_is_not_in_the_motion_vectors_and_is_added(self):
        run_script("render.py", "zoom", self.folder, "--size", "192x108", "--frames", "10-12", "--kinds",
                   "sharp,mb,behind", "--samples", "64", "--min-samples", "64", "--sharp-samples", "32")
        self.assertLess(self.depths("sharp", 11).max(), 1e9)
        self.assertGreaterEqual(self.depths("behind", 11).min(), 1e9, "nothing is behind the wall")
        own = json.loads(inspect(self.folder, "sharp.0011.exr", "--json", "--camera-motion", "none"))
        self.assertEqual(own["bounds"]["max_speed_px"], 0)
        chain = pathlib.Path(self.folder, "chain.yaml")
        chain.write_text("postchain: 1\npasses: [motion_blur]\n")
        found = {}
        for wanted in ("none", "missing"):
            subprocess.run(
                [POSTCHAIN, "run", chain, "-i", f"{self.folder}/sharp.####.exr", "--camera",
                 f"{self.folder}/camera.json", "--frames", "11", "--camera-motion", wanted, "-o",
                 f"{self.folder}/{wanted}.####.exr"], capture_output=True, check=True)
            found[wanted] = psnr(f"{self.folder}/mb.0011.exr", f"{self.folder}/{wanted}.0011.exr")
        self.assertGreater(found["missing"], found["none"] + 6, found)


POSTCHAIN, BLENDER = sys.argv[1:3]
unittest.main(argv=sys.argv[:1] + sys.argv[3:])
