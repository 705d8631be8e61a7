"""dataset.py with a program in Blender's place that writes images of one value."""
import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(SCRIPTS))
import dataset  # noqa: E402

# Half a is 0.25, half b 0.75. Keeps a log of the images. Fails for the kind in $FAILS.
BLENDER = """#!{python}
import os, pathlib, shutil, sys
sys.path.insert(0, {scripts!r})
import dataset, request
arguments = sys.argv[sys.argv.index("--") + 1:]
if "peers.py" in sys.argv[sys.argv.index("-P") + 1]:
    for name, kind in dataset.PEERS.items():
        if (kind, int(arguments[1])) in dataset.TRUTH:
            pathlib.Path(arguments[0], name + "." + arguments[1].zfill(4) + ".exr").touch()
    sys.exit()
options = request.parse_options(arguments, "")
os.makedirs(options.out, exist_ok=True)
for kind, frame in request.images_to_render(options):
    if kind == os.environ.get("FAILS"):
        sys.exit("no " + kind)
    name = request.file_name(kind, frame, options.half)
    shutil.copy({images!r} + f"/{{options.half}}.exr", os.path.join(options.out, name))
    with open({log!r}, "a") as log:
        log.write(pathlib.Path(options.out).name + "/" + name + "\\n")
"""


class Dataset(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.images = cls.enterClassContext(tempfile.TemporaryDirectory())
        for half, value in (("a", 0.25), ("b", 0.75), ("None", 1)):
            subprocess.run(["oiiotool", "--pattern", f"constant:color={value},{value},{value}", "4x4",
                            "3", "-d", "half", "-o", f"{cls.images}/{half}.exr"], check=True)

    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.log = self.out / "log"
        self.blender = self.out / "blender"
        self.blender.write_text(BLENDER.format(python=sys.executable, scripts=str(SCRIPTS),
                                               log=str(self.log), images=self.images))
        self.blender.chmod(0o755)

    def run_it(self, *arguments, **environment):
        """Exit code, images rendered, what was printed."""
        self.log.write_text("")
        done = subprocess.run([sys.executable, "-B", SCRIPTS / "dataset.py", self.out, *arguments,
                               "--blender", self.blender], capture_output=True, text=True,
                              env={**os.environ, **environment}, check=False)
        return done.returncode, self.log.read_text().split(), done.stdout + done.stderr

    def test_valuable_images_of_all_scenes_come_first_and_whole_ones_stay(self):
        code, made, _ = self.run_it("glass", "rain")
        self.assertEqual(code, 0)
        self.assertEqual(made[:12], [
            *(f"{scene}/sharp.00{frame}.exr" for scene in ("glass", "rain") for frame in range(10, 14)),
            "glass/behind.0011.exr", "rain/behind.0011.exr",
            "glass/both_a.0011.exr", "rain/both_a.0011.exr"])
        self.assertEqual(len(made), 2 * (4 + 1 + 8))
        self.assertEqual(self.run_it("glass", "rain")[:2], (0, []))
        (self.out / "rain" / "mb_b.0011.exr").unlink()
        self.assertEqual(self.run_it("glass", "rain")[:2], (0, ["rain/mb_b.0011.exr"]))

    def test_ground_truth_is_the_mean_of_its_halves(self):
        self.run_it("glass")
        shown = subprocess.run(["oiiotool", "--stats", self.out / "glass" / "both.0012.exr"],
                               capture_output=True, text=True, check=True).stdout
        self.assertRegex(shown, r"Stats Avg: 0\.5000\d* 0\.5000\d* 0\.5000\d*")

    def test_a_limit_ends_early_and_a_failure_does_not_stop_the_rest(self):
        code, made, _ = self.run_it("glass", "--limit", "2")
        self.assertEqual((code, made[4:]), (3, ["glass/behind.0011.exr"]))
        written = json.loads((self.out / "manifest.json").read_text())
        self.assertEqual({"glass": sorted(pathlib.Path(name).name for name in made)},
                         {scene: sorted(files) for scene, files in written.items()})
        code, made, printed = self.run_it("glass", FAILS="mb")
        self.assertEqual(code, 1)
        self.assertEqual(len(made), 6)
        self.assertIn("--kinds mb --frames 11 --half a: FAILED", printed)
        self.assertIn("no mb", printed)

    def test_check_names_files_that_are_not_those_of_the_manifest(self):
        self.run_it("glass")
        written = json.loads((self.out / "manifest.json").read_text())
        self.assertEqual(len(written["glass"]), 4 + 1 + 8 + 4 + 4)  # no JSON from this Blender
        dataset.MANIFEST = self.out / "manifest.json"
        self.assertEqual(dataset.check(self.out), 0)
        (self.out / "glass" / "sharp.0010.exr").write_bytes(b"x")
        (self.out / "glass" / "dof.0011.exr").unlink()
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            self.assertEqual(dataset.check(self.out), 2)
        self.assertRegex(printed.getvalue(), r"dof\.0011\.exr: missing; .*\n.*sharp\.0010\.exr: other; ")

    def package(self, commit="v1-2-gabc", **changes):
        """The made folder, and what package.py said."""
        results = self.out / "results.json"
        results.write_text(json.dumps({"commit": commit, "version": "postchain 1", "figures": [], **changes}))
        folder = self.out / "published"
        done = subprocess.run([sys.executable, "-B", SCRIPTS / "package.py", self.out, folder, "--results",
                               results], capture_output=True, text=True, check=False)
        return folder, done.returncode, done.stderr

    def test_a_package_checks_and_renders_itself(self):
        self.assertIn("no scene; render with", self.package()[2])
        self.run_it("glass")
        folder, code, said = self.package()
        self.assertEqual(code, 0, said)
        readme = (folder / "README.md").read_text()
        self.assertIn("measured with postchain 1 (v1-2-gabc)", readme)
        self.assertIn("- `glass`: camera.json, peers.0011.json, peers.0012.json\n", readme)
        self.assertIn("- `rain`: camera.json, ", readme)
        self.assertIn('version: "postchain 1"', (folder / "CITATION.cff").read_text())
        sums = subprocess.run(["sha256sum", "--quiet", "-c", "SHA256SUMS"], cwd=folder, check=False)
        self.assertEqual(sums.returncode, 0)
        own = [sys.executable, "-B", folder / "code/tests/cycles/dataset.py"]
        self.assertEqual(subprocess.run([*own, folder / "scenes", "--check"], check=False).returncode, 0)
        again = subprocess.run([*own, folder / "again", "rain", "--limit", "1", "--blender", self.blender],
                               capture_output=True, text=True, check=False)
        self.assertEqual(again.returncode, 3, again.stderr)
        self.assertTrue((folder / "again/rain/sharp.0010.exr").exists())
        for script in ("quality.py", "scatter_gather.py"):
            self.assertTrue((folder / "code/tests/bench" / script).exists())
        self.assertIn("exists; choose another", self.package()[2])

    def test_a_package_needs_results_of_a_commit(self):
        self.run_it("glass")
        for commit in ("v1-2-gabc-dirty", "no repository", "abc, abc-dirty"):
            self.assertIn("which names no commit; commit all", self.package(commit)[2])
        self.assertFalse((self.out / "published").exists())

    def test_a_digest_is_that_of_the_pixels(self):
        first, other = self.out / "first.exr", self.out / "other.exr"
        digests = {}
        for value, comment in ((0.5, "1 s"), (0.5, "1000 s"), (0.75, "1 s")):
            subprocess.run(["oiiotool", "--pattern", f"checker:color1={value},1,0", "70x40", "3", "-d",
                            "half", "--attrib", "RenderTime", comment, "--compression", "zip", "-o", first],
                           check=True)
            digests[value, comment] = dataset.digest(first)
            subprocess.run(["oiiotool", first, "--compression", "none", "-o", other], check=True)
            # Uncompressed: for each of 40 lines its number, its size, 70 values of 3 half channels.
            self.assertEqual(len(dataset.pixels_of(other.read_bytes())), 40 * (8 + 70 * 3 * 2))
        self.assertEqual(digests[0.5, "1 s"], digests[0.5, "1000 s"])
        self.assertNotEqual(digests[0.5, "1 s"], digests[0.75, "1 s"])

    def test_every_scene_has_a_script(self):
        for scene in dataset.SCENES:
            self.assertTrue((SCRIPTS / f"{scene}.py").exists(), scene)


unittest.main()
