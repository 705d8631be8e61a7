"""The add-on without a window: inside.py in Blender, then the lines of docs/blender.md for a farm.

usage: addon_test.py POSTCHAIN ZIP [BLENDER]"""
import json
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

import launch

DOCUMENT = launch.HERE.parents[1] / "docs/blender.md"
BLENDER = None


class Addon(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def test_inside_blender_and_on_a_farm(self):
        printed = BLENDER.run(self.folder, "-b", "-P", launch.HERE / "inside.py", "--", self.folder)
        self.assertIn("\nOK\n", printed)
        self.assertIn("Warning: frame step 2", printed)  # reported by Filter

        # The documented lines, on the file that inside.py has left, without the add-on installed.
        script = re.search(r"<!-- farm -->\n+```sh\n(.*?)```", DOCUMENT.read_text("utf8"), re.S)[1]
        self.assertEqual(len(script.splitlines()), 3, script)
        expression = re.search(r'--python-expr "(.*?)"', script, re.S)[1].replace("\\\n", "")
        expression = re.sub(r"/\S*(?=/postchain_blender.zip)", str(pathlib.Path(BLENDER.zip).parent),
                            expression)
        shutil.rmtree(pathlib.Path(self.folder, "blender"))
        BLENDER.run(self.folder, "-b", "shot.blend", "--python-expr", expression)
        camera = json.loads(pathlib.Path(self.folder, "camera.json").read_text("utf8"))
        self.assertEqual(camera["focal_length_mm"], 35)
        self.assertEqual(sorted(camera["camera_matrix_world"]), ["0", "1", "2", "3", "4"])

    def test_as_an_extension(self):
        if BLENDER.version() < (4, 2):
            self.skipTest("Blender before 4.2 has no extensions")
        printed = BLENDER.run(self.folder, "--command", "extension", "validate", BLENDER.zip)
        self.assertIn("Success", printed)
        printed = BLENDER.run(self.folder, "-b", "-P", launch.HERE / "inside.py", "--", self.folder, "__main__.Compare",
                              "__main__.Registration", "behind_inside.Behind.test_shows_the_wall_behind_the_cube",
                              module="bl_ext.user_default.postchain_blender")
        self.assertIn("\nOK\n", printed)


if __name__ == "__main__":
    BLENDER = launch.Launcher(sys.argv[1:])
    unittest.main(argv=sys.argv[:1])
