"""Inside Blender: the chains that the panel's values make."""
import os
import pathlib
import subprocess

import bpy

from addon_case import Case, addon


class Chain(Case):
    def test_shipped_chains_are_read(self):
        names = {path.stem for path in pathlib.Path(addon().__file__).parent.joinpath("chains").iterdir()}
        self.assertEqual(set(addon().properties.SHIPPED), names)
        self.assertEqual(addon().properties.shipped("paper")[0], ("motion_blur", {
            "mode": "guertin", "samples": 25, "max_blur_px": 40, "jitter": 0.95, "center_weight": 40,
            "variance_threshold_px": 1.5}))

    def test_every_combination_is_a_valid_chain(self):
        settings = self.scene.postchain
        combinations = [(preset, order) for preset in addon().properties.SHIPPED
                        for order in addon().properties.ORDERS]
        frames = os.path.join(self.folder, "frames")
        os.makedirs(frames)
        call = [os.environ["POSTCHAIN"], "scene", "wheels", "-o", frames, "--size", "32x18", "--frames",
                "1", "-q", "--device", "software"]
        subprocess.run(call, check=True)
        seen = set()
        for preset, order in combinations:
            settings.preset, settings.order, settings.samples = preset, order, 24
            text = addon().properties.chain_text(addon().properties.chain(self.scene))
            if text in seen:
                continue
            seen.add(text)
            name = os.path.join(frames, "chain.json")
            pathlib.Path(name).write_text(text, "utf8")
            subprocess.run([os.environ["POSTCHAIN"], "plan", name, "-i", f"{frames}/sharp.0001.exr",
                            "--camera", f"{frames}/camera.json", "-q"], check=True,
                           stdout=subprocess.DEVNULL)
        self.assertEqual(len(seen), 3 * 5 + 2)

    def test_properties_are_those_of_the_tables(self):
        for one in addon().properties.tables()["passes"]:
            group = getattr(self.scene.postchain, one["name"])
            for row in one["parameters"]:
                value, default = getattr(group, row["key"]), row["default"]
                if default is None:
                    continue
                if "allowed" in row:
                    self.assertEqual(int(value), default, row)
                elif isinstance(default, str):
                    self.assertEqual(value, default, row)
                else:
                    self.assertAlmostEqual(value, default, places=5, msg=row)
        bpy.ops.postchain.own(name="joint_blur", key="samples")
        self.assertTrue(self.scene.postchain.joint_blur.is_property_set("samples"))
        self.assertEqual(self.scene.postchain.joint_blur.samples, 15)  # of the chain `fast`
        bpy.ops.postchain.own(name="joint_blur", key="f_stop")  # no value yet
        bpy.ops.postchain.own(name="fxaa", key="preset")
        self.assertEqual(addon().properties.chain(self.scene)["passes"][1][1]["preset"], 12)
        bpy.ops.postchain.own(key="samples")  # of the whole chain
        self.assertEqual(self.scene.postchain.samples, 15)
        bpy.ops.postchain.reset(key="samples")
        self.assertEqual(self.scene.postchain.samples, 0)
        bpy.ops.postchain.reset(name="joint_blur", key="samples")
        self.assertFalse(self.scene.postchain.joint_blur.is_property_set("samples"))
        bpy.ops.postchain.reset(name="joint_blur")
        self.assertFalse(self.scene.postchain.joint_blur.is_property_set("f_stop"))
        self.scene.postchain.fxaa.preset = "39"
        self.scene.postchain.fxaa.subpix = 0.5
        self.scene.postchain.fxaa.matte = "cryptomatte:hero"
        values = addon().properties.chain(self.scene)["passes"][1][1]
        self.assertEqual(values, {"mode": "directional", "where": "blurred", "preset": 39, "subpix": 0.5,
                                  "matte": "cryptomatte:hero"})
