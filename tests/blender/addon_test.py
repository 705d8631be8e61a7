"""The add-on in Blender, with the zip installed in an empty folder of its own.

usage: addon_test.py Addon|Window POSTCHAIN ZIP [BLENDER]"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tools/research/cycles"), str(HERE.parent / "support")]
import request  # noqa: E402
from skips import skip  # noqa: E402

DOCUMENT = HERE.parents[1] / "docs/blender.md"
POSTCHAIN = ZIP = BLENDER = None


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def environment(self, module):
        own = {"BLENDER_USER_SCRIPTS": "scripts", "BLENDER_USER_CONFIG": "config",
               "BLENDER_USER_EXTENSIONS": "extensions"}
        paths = {name: os.path.join(self.folder, "blender", part) for name, part in own.items()}
        for path in paths.values():
            os.makedirs(path, exist_ok=True)
        return {**request.blender_environment(), **paths, "POSTCHAIN": POSTCHAIN, "POSTCHAIN_ZIP": ZIP,
                "POSTCHAIN_MODULE": module, "PYTHONDONTWRITEBYTECODE": "1", "PWD": self.folder}

    def blender(self, *arguments, before=(), module="postchain_blender"):
        """Standard output and error of `blender ARGUMENTS`; fails if Blender does. module: name of the add-on
        for Python."""
        done = subprocess.run([*before, BLENDER, "--factory-startup", "--python-exit-code", "1",
                               *map(str, arguments)], cwd=self.folder, env=self.environment(module), text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=1700, check=False)
        printed = "\n".join(line for line in done.stdout.splitlines() if not line.startswith("Fra:"))
        self.assertEqual(done.returncode, 0, printed)
        return printed


class Addon(Case):
    """Without a window."""

    def test_inside_blender_and_on_a_farm(self):
        printed = self.blender("-b", "-P", HERE / "inside.py", "--", self.folder)
        self.assertIn("\nOK\n", printed)
        self.assertIn("Warning: frame step 2", printed)  # reported by Filter

        # The documented lines, on the file that inside.py has left, without the add-on installed.
        script = re.search(r"<!-- farm -->\n+```sh\n(.*?)```", DOCUMENT.read_text("utf8"), re.S)[1]
        self.assertEqual(len(script.splitlines()), 3, script)
        expression = re.search(r'--python-expr "(.*?)"', script, re.S)[1].replace("\\\n", "")
        expression = re.sub(r"[^'\s]+(?=/postchain_blender.zip)", os.path.dirname(ZIP), expression)
        shutil.rmtree(pathlib.Path(self.folder, "blender"))
        self.blender("-b", "shot.blend", "--python-expr", expression)
        camera = json.loads(pathlib.Path(self.folder, "camera.json").read_text("utf8"))
        self.assertEqual(camera["focal_length_mm"], 35)
        self.assertEqual(sorted(camera["camera_matrix_world"]), ["0", "1", "2", "3", "4"])

    def test_as_an_extension(self):
        printed = subprocess.run([BLENDER, "--version"], capture_output=True, text=True, check=True).stdout
        if tuple(int(part) for part in printed.split()[1].split(".")) < (4, 2):
            self.skipTest("Blender before 4.2 has no extensions")
        self.assertIn("Success", self.blender("--command", "extension", "validate", ZIP))
        printed = self.blender("-b", "-P", HERE / "inside.py", "--", self.folder, "__main__.Compare",
                               "__main__.Registration", "behind_inside.Behind.test_shows_the_wall_behind_the_cube",
                               module="bl_ext.user_default.postchain_blender")
        self.assertIn("\nOK\n", printed)


class Window(Case):
    """Under Xvfb: the panel draws, Filter runs while Blender stays usable, Esc and loading a file end it."""

    def test_in_a_window(self):
        printed = self.blender("--enable-event-simulate", "--window-geometry", "0", "0", "1280", "800", "-P",
                               HERE / "window.py", "--", self.folder, before=[HERE.parent / "support/with_display.sh"])
        self.assertIn("\nOK\n", printed)
        for word in ("Traceback", "rna_uiItem", "Error:"):
            self.assertNotIn(word, printed)


if __name__ == "__main__":
    if sys.argv[1] == "Window" and not shutil.which("Xvfb"):
        skip("no Xvfb", "xvfb")
    if len(sys.argv) < 5:
        skip("no Blender", "blender")
    POSTCHAIN, ZIP, BLENDER = (os.path.abspath(one) for one in sys.argv[2:5])
    unittest.main(argv=sys.argv[:2])
