"""Runs inside Blender: the tests of the modules listed at the end, and those of the add-on as a whole.
Called by addon_test.py with a folder after "--", and the tests' names if not all are meant. Leaves shot.blend there."""
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as scenes  # noqa: E402
from addon_case import FOLDER, Case, addon  # noqa: E402


class Registration(Case):
    def test_nothing_is_left_behind(self):
        bpy.ops.preferences.addon_disable(module=scenes.MODULE)
        handlers = {name: list(getattr(bpy.app.handlers, name)) for name in dir(bpy.app.handlers)
                    if isinstance(getattr(bpy.app.handlers, name), list)}
        types = set(dir(bpy.types))
        self.assertFalse([name for name in types if "POSTCHAIN" in name.upper()])
        self.assertFalse(hasattr(bpy.types.Scene, "postchain"))
        self.assertFalse(hasattr(bpy.types.WindowManager, "postchain_outcome"))
        for _ in range(2):
            scenes.enable()
            self.assertTrue(hasattr(bpy.types.Scene, "postchain"))
            bpy.ops.preferences.addon_disable(module=scenes.MODULE)
            self.assertEqual(set(dir(bpy.types)), types)
            self.assertEqual({name: list(getattr(bpy.app.handlers, name)) for name in handlers}, handlers)
        scenes.enable()

    def test_version_is_that_of_the_command(self):
        printed = subprocess.run([os.environ["POSTCHAIN"], "--version"], capture_output=True, text=True,
                                 check=True).stdout
        self.assertIn(".".join(str(part) for part in addon().bl_info["version"]), printed)
        manifest = pathlib.Path(addon().__file__).with_name("blender_manifest.toml").read_text("utf8")
        self.assertIn(re.search('^version = "(.*)"$', manifest, re.M)[1], printed)


class Compare(Case):
    def test_filtered_is_closer_than_rendered(self):
        self.scene.postchain.truth_samples = 64
        self.scene.render.motion_blur_shutter = 2
        self.scene.frame_set(2)
        self.assertEqual(bpy.ops.postchain.compare(), {"FINISHED"})
        found = json.loads(self.scene.postchain.comparison)
        self.assertEqual(found["frame"], 2)
        psnr = {row[0]: float(row[1].split()[0]) for row in found["rows"]}
        self.assertGreater(psnr["filtered"], psnr["as_rendered"] + 5)
        self.assertTrue(os.path.exists(found["page"]))
        # The file that is open was not changed.
        self.assertEqual(self.scene.render.image_settings.file_format, "PNG")
        self.assertTrue(self.scene.render.use_motion_blur)

    def test_stereoscopy_and_a_frame_too_small_for_ssim(self):
        self.scene.render.use_multiview = True
        self.scene.render.resolution_x = self.scene.render.resolution_y = 8
        self.scene.postchain.truth_samples = 4
        self.assertEqual(bpy.ops.postchain.compare(), {"FINISHED"})
        for row in json.loads(self.scene.postchain.comparison)["rows"]:
            self.assertIn("dB", row[1])
            self.assertEqual(row[3], "none")


class Shot(Case):
    def test_file_for_the_farm(self):
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "shot.blend"), copy=True)


scenes.install()
tests = unittest.defaultTestLoader.loadTestsFromNames(
    sys.argv[sys.argv.index("--") + 2:] or
    ["__main__", "prepare_inside", "camera_inside", "filter_inside", "chain_inside", "behind_inside",
     "simulation_inside"])
if not unittest.TextTestRunner().run(tests).wasSuccessful():
    raise SystemExit(1)
print("\nOK\n", flush=True)
