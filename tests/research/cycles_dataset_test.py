"""dataset.py and package.py with a Blender that copies images of one value."""
import ast
import contextlib
import io
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "tools/research/cycles"
sys.path[:0] = [str(SCRIPTS), str(ROOT / "tests/support")]
import dataset  # noqa: E402
import package  # noqa: E402
import request  # noqa: E402
from skips import skip  # noqa: E402


# In place of Blender for a dataset.py that runs as a program.
BLENDER = """#!{python}
import pathlib, sys
sys.path.insert(0, {scripts!r})
import request
options = request.parse_options(sys.argv[sys.argv.index("--") + 1:])
pathlib.Path(options.out).mkdir(parents=True)
for kind, frame in request.images_to_render(options):
    pathlib.Path(options.out, request.file_name(kind, frame, options.half)).touch()
"""


def oiiotool(*words):
    return subprocess.run(["oiiotool", *words], check=True, capture_output=True, text=True).stdout


class Dataset(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Images whose half a is 0.25 and half b 0.75, and a finished scene."""
        cls.images = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        for half, value in (("a", 0.25), ("b", 0.75), (None, 1)):
            oiiotool("--pattern", f"constant:color={value},{value},{value}", "4x4", "3", "-d", "half", "-o",
                     cls.images / f"{half}.exr")
        cls.finished = cls.images / "finished"
        cls.render_set(cls.finished, "glass", means=True)

    def setUp(self):
        self.out = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    @classmethod
    def render_set(cls, out, *arguments, fails=None, means=False):
        """Exit code of dataset.py, images rendered, text printed. Blender fails for the kind `fails`. Without
        `means` the means of halves are empty files."""
        assert set(dataset.SCENES) <= set(request.SCENES)
        made, run = [], subprocess.run

        def blender(command, **options):
            if command[0] == "oiiotool" and not means:
                pathlib.Path(command[-1]).touch()
                return subprocess.CompletedProcess(command, 0)
            if command[0] != "blender":
                return run(command, **options)
            script, given = pathlib.Path(command[command.index("-P") + 1]), command[command.index("--") + 1:]
            assert script.exists(), script
            if script.name == "peers.py":
                for name, kind in dataset.PEERS.items():
                    if (kind, int(given[1])) in dataset.TRUTH:
                        pathlib.Path(given[0], request.file_name(name, int(given[1]))).touch()
                return subprocess.CompletedProcess(command, 0)
            wanted = request.parse_options(given)
            folder = pathlib.Path(wanted.out)
            folder.mkdir(parents=True, exist_ok=True)
            for kind, frame in request.images_to_render(wanted):
                if kind == fails:
                    return subprocess.CompletedProcess(command, 1, "", f"no {kind}")
                name = request.file_name(kind, frame, wanted.half)
                shutil.copy(cls.images / f"{wanted.half}.exr", folder / name)
                made.append(f"{wanted.scene}/{name}")
            return subprocess.CompletedProcess(command, 0)

        with (mock.patch.object(subprocess, "run", blender), contextlib.redirect_stdout(io.StringIO()) as printed,
              mock.patch.object(sys, "argv", ["dataset.py", str(out), *arguments])):
            try:
                dataset.main()
            except SystemExit as end:
                return end.code, made, printed.getvalue()

    def test_valuable_images_of_all_scenes_come_first_and_whole_ones_stay(self):
        code, made, _ = self.render_set(self.out, "glass", "rain")
        self.assertEqual(code, 0)
        self.assertEqual(made[:12], [
            *(f"{scene}/sharp.00{frame}.exr" for scene in ("glass", "rain") for frame in range(10, 14)),
            "glass/behind.0011.exr", "rain/behind.0011.exr",
            "glass/both_a.0011.exr", "rain/both_a.0011.exr"])
        self.assertEqual(len(made), 2 * (4 + 1 + 8))
        (self.out / "rain" / "mb_b.0011.exr").unlink()
        self.assertEqual(self.render_set(self.out, "glass", "rain")[:2], (0, ["rain/mb_b.0011.exr"]))

    def test_ground_truth_is_the_mean_of_its_halves(self):
        self.assertRegex(oiiotool("--stats", self.finished / "glass" / "both.0012.exr"),
                         r"Stats Avg: 0\.5000\d* 0\.5000\d* 0\.5000\d*")

    def test_a_limit_ends_early_and_a_failure_does_not_stop_the_rest(self):
        code, made, _ = self.render_set(self.out, "glass", "--limit", "2")
        self.assertEqual((code, made[4:]), (3, ["glass/behind.0011.exr"]))
        written = json.loads((self.out / "manifest.json").read_text())
        self.assertEqual({"glass": sorted(pathlib.Path(name).name for name in made)},
                         {scene: sorted(files) for scene, files in written.items()})
        code, made, printed = self.render_set(self.out, "glass", fails="mb")
        self.assertEqual((code, len(made)), (1, 6))
        self.assertIn("--kinds mb --frames 11 --half a: FAILED", printed)
        self.assertIn("no mb", printed)
        # A run that failed does not count.
        made = self.render_set(self.out / "other", "glass", "--limit", "1", fails="sharp")[1]
        self.assertEqual(made, ["glass/behind.0011.exr"])

    def test_check_names_files_that_are_not_those_of_the_manifest(self):
        shutil.copytree(self.finished, self.out, dirs_exist_ok=True)
        written = json.loads((self.out / "manifest.json").read_text())
        self.assertEqual(len(written["glass"]), 4 + 1 + 8 + 4 + 4)  # no JSON from this Blender
        self.enterContext(mock.patch.object(dataset, "MANIFEST", self.out / "manifest.json"))
        self.assertEqual(dataset.check(self.out), 0)
        (self.out / "glass" / "sharp.0010.exr").write_bytes(b"x")
        (self.out / "glass" / "dof.0011.exr").unlink()
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            self.assertEqual(dataset.check(self.out), 2)
        self.assertRegex(printed.getvalue(), r"dof\.0011\.exr: missing; .*\n.*sharp\.0010\.exr: other; ")

    def package(self, commit="v1-2-gabc"):
        """The folder of package.py."""
        results = self.out / "results.json"
        results.write_text(json.dumps({"commit": commit, "version": "postchain 1", "figures": []}))
        package.package(self.out, self.out / "published", results)
        return self.out / "published"

    def refused(self, *arguments):
        with self.assertRaises(SystemExit) as end:
            self.package(*arguments)
        return end.exception.code

    def test_a_package_checks_and_renders_itself(self):
        self.assertIn("no scene; render with", self.refused())
        shutil.copytree(self.finished, self.out, dirs_exist_ok=True)
        folder = self.package()
        readme = (folder / "README.md").read_text()
        self.assertIn("measured with postchain 1 (v1-2-gabc)", readme)
        self.assertIn("- `glass`: camera.json, peers.0011.json, peers.0012.json\n", readme)
        self.assertIn("- `rain`: camera.json, ", readme)
        self.assertIn('version: "postchain 1"', (folder / "CITATION.cff").read_text())
        subprocess.run(["sha256sum", "--quiet", "-c", "SHA256SUMS"], cwd=folder, check=True)
        self.assertIn("exists; choose another", self.refused())

        blender = self.out / "blender"
        blender.write_text(BLENDER.format(python=sys.executable, scripts=str(folder / "code/tools/research/cycles")))
        blender.chmod(0o755)
        own = [sys.executable, "-B", folder / "code/tools/research/cycles/dataset.py"]
        subprocess.run([*own, folder / "scenes", "--check"], check=True)
        again = subprocess.run([*own, folder / "again", "rain", "--limit", "1", "--blender", blender],
                               capture_output=True, text=True, check=False)
        self.assertEqual(again.returncode, 3, again.stderr)
        self.assertTrue((folder / "again/rain/sharp.0010.exr").exists())

    def test_a_package_has_every_module_that_its_scripts_import(self):
        own = {path.stem for pattern in ("tools/research/*.py", "tools/research/cycles/*.py",
                                               "tools/blender/postchain_blender/*.py")
               for path in package.ROOT.glob(pattern)}
        held = [path for pattern in package.CODE for path in package.ROOT.glob(pattern)
                if path.suffix == ".py"]
        self.assertGreater(len(held), 20)
        for path in held:
            for node in ast.walk(ast.parse(path.read_text("utf8"))):
                names = [node.module] if isinstance(node, ast.ImportFrom) else \
                    [one.name for one in node.names] if isinstance(node, ast.Import) else []
                self.assertLessEqual(own & set(names), {one.stem for one in held}, path)

    def test_a_package_needs_results_of_a_commit(self):
        shutil.copytree(self.finished, self.out, dirs_exist_ok=True)
        for commit in ("v1-2-gabc-dirty", "no repository", "abc, abc-dirty"):
            self.assertIn("which names no commit; commit all", self.refused(commit))
        self.assertFalse((self.out / "published").exists())

    def test_a_digest_is_that_of_the_pixels(self):
        first, other = self.out / "first.exr", self.out / "other.exr"
        digests = []
        for value, comment in ((0.5, "1 s"), (0.5, "1000 s"), (0.75, "1 s")):
            oiiotool("--pattern", f"checker:color1={value},1,0", "70x40", "3", "-d", "half", "--attrib", "RenderTime",
                     comment, "--compression", "zip", "-o", first)
            digests.append(dataset.digest(first))
        self.assertEqual(digests[0], digests[1])
        self.assertNotEqual(digests[0], digests[2])
        oiiotool(first, "--compression", "none", "-o", other)
        # Uncompressed: for each of 40 lines its number, its size, 70 values of 3 half channels.
        self.assertEqual(len(dataset.pixels_of(other.read_bytes())), 40 * (8 + 70 * 3 * 2))


if __name__ == "__main__":
    if not shutil.which("oiiotool"):
        skip("no oiiotool", "openimageio-tools")
    unittest.main()
