"""Inside Blender: Prepare, Put Back, and the settings that they refuse."""
import os

import bpy

import scene as scenes
from addon_case import Case, addon


class Prepare(Case):
    def state(self):
        image, layer = self.scene.render.image_settings, self.scene.view_layers[0]
        return (image.file_format, image.color_depth, image.exr_codec, layer.use_pass_z,
                layer.use_pass_vector, layer.use_pass_cryptomatte_object, layer.pass_cryptomatte_depth,
                self.scene.render.use_motion_blur, getattr(self.scene.eevee, "use_motion_blur", False),
                self.scene.camera.data.dof.use_dof)

    PREPARED = ("OPEN_EXR_MULTILAYER", "32", "ZIP", True, True, True, 6, False, False, False)

    def prepare(self):
        self.scene.postchain.cryptomatte = True
        if hasattr(self.scene.eevee, "use_motion_blur"):  # before 4.2
            self.scene.eevee.use_motion_blur = True
        self.scene.render.image_settings.color_depth = "16"  # PNG's
        before = self.state()
        bpy.ops.postchain.prepare()
        self.assertEqual(self.state(), self.PREPARED)
        texts = [change.text for change in self.scene.postchain.changes]
        self.assertIn("lens: depth of field off", texts)
        return before

    def put_back(self, before):
        bpy.ops.postchain.put_back()
        self.assertEqual(self.state(), before)

    def test_twice_keeps_the_first_values(self):
        before = self.prepare()
        self.assertEqual(addon().prepare.missing(self.scene), [])
        self.scene.camera.data.dof.use_dof = True
        self.scene.render.image_settings.file_format = "OPEN_EXR"
        bpy.ops.postchain.prepare()
        self.assertEqual(self.state(), self.PREPARED)
        self.put_back(before)
        self.assertFalse(bpy.ops.postchain.put_back.poll())

    def test_state_is_in_the_file(self):
        before = self.prepare()
        os.makedirs(self.folder, exist_ok=True)
        path = os.path.join(self.folder, "prepared.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.scene = bpy.context.scene
        self.assertEqual(self.state(), self.PREPARED)
        self.put_back(before)

    def test_undo(self):
        bpy.ops.ed.undo_push(message="before")
        before = self.prepare()
        bpy.ops.ed.undo_push(message="Prepare")
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        self.assertNotEqual(self.state(), self.PREPARED)
        self.assertEqual(len(self.scene.postchain.changes), 0)
        bpy.ops.ed.redo()
        self.scene = bpy.context.scene
        self.assertEqual(self.state(), self.PREPARED)
        self.put_back(before)
        bpy.ops.ed.undo_push(message="Put Back")
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        self.assertEqual(self.state(), self.PREPARED)

    def test_later_changes_are_kept(self):
        self.prepare()
        self.scene.view_layers[0].use_pass_vector = False
        self.scene.camera.data.name = "renamed"
        bpy.ops.postchain.put_back()
        self.assertFalse(self.scene.view_layers[0].use_pass_vector)
        self.assertTrue(self.scene.camera.data.dof.use_dof)
        self.assertEqual(self.scene.render.image_settings.file_format, "PNG")

    def test_every_camera_of_the_markers(self):
        second = self.second_camera()
        self.cut({2: second})
        bpy.ops.postchain.prepare()
        self.assertFalse(second.data.dof.use_dof)
        bpy.ops.postchain.put_back()
        self.assertTrue(second.data.dof.use_dof)


class Problems(Case):
    def test_cameras_of_markers_beyond_the_frame_range(self):
        eye = self.scene.camera
        for frame in (-9, 0, 2, 4):  # the range is 1 to 3
            other = self.second_camera()
            other.data.type = "PANO" if frame in (-9, 4) else "PERSP"
            other.name = f"at {frame}"
            self.cut({frame: other})
        self.scene.camera = eye  # Blender 4.3 sets that of the marker at once
        self.assertEqual([one.name for one in addon().prepare.cameras(self.scene)], ["eye", "at 0", "at 2"])
        self.assertFalse([text for wrong, text in self.problems() if wrong])
        self.scene.frame_end = 4
        self.says("camera 'at 4' is panoramic", wrong=True)

    def test_settings_one_by_one(self):
        render, data = self.scene.render, self.scene.camera.data
        self.scene.sequence_editor_create().sequences.new_scene("s", self.scene, 1, 1)
        render.use_sequencer, render.use_crop_to_border = False, True
        for wrong, text, owner, key, value in [
                (True, "Crop to Render Region off", render, "use_border", True),
                (True, "outside 0.1 to 10", data.dof, "aperture_ratio", 0.05),
                (True, "focuses at distance 0", data.dof, "focus_distance", 0),
                (True, "Sequencer off", render, "use_sequencer", True),
                *((True, f"holds '{token}' beside its frame number", render, "filepath", f"{self.folder}/{name}")
                  for name, token in (("a##_b_####", "##"), ("b_%04d", "%04d"), ("b@2x_##", "@"), ("b_$F4", "$F"))),
                (False, "Rolling Shutter is on", self.scene.cycles, "rolling_shutter_type", "TOP"),
                (False, "shifted lens", data, "shift_y", 0.1),
                (False, "pixel aspect is 2:1", render, "pixel_aspect_x", 2),
                (False, "Shutter Curve is not constant",
                 render.motion_blur_shutter_curve.curves[0].points[0].location, "y", 0)]:
            self.assertEqual(self.problems(), [])
            before = getattr(owner, key)
            setattr(owner, key, value)
            self.says(text, wrong)
            setattr(owner, key, before)
        render.filepath = os.path.join(self.folder, "a##/b_##_100%_d")
        self.assertEqual(self.problems(), [])
        data.dof.keyframe_insert("use_dof", frame=1)
        self.says("switched by an animation", wrong=True)

    def test_engines(self):
        self.scene.render.engine = "BLENDER_WORKBENCH"
        self.fails(bpy.ops.postchain.prepare, "Workbench has neither depth nor motion vectors")
        self.scene.render.engine = scenes.eevee()
        if bpy.app.version < (4, 2, 0):
            self.says("EEVEE has no motion vectors", wrong=True)
            self.scene.postchain.order = "LENS"
        self.assertEqual(self.problems(), [])

    def test_motion_blur_of_cycles_that_the_filter_lacks(self):
        cube, wall = (bpy.data.objects[name] for name in ("cube", "wall"))
        wall.cycles.use_deform_motion = False  # it does not deform
        self.assertEqual(self.problems(), [])
        cube.cycles.use_motion_blur = self.scene.camera.cycles.use_motion_blur = False
        self.says("Motion Blur is off for 'cube': Cycles writes this motion", wrong=False)
        self.says("Motion Blur is off for camera 'eye'", wrong=False)
        wall.shape_key_add(name="rest")
        self.says("Deformation (Motion Blur) is off for 'wall'", wrong=False)
        self.scene.postchain.order = "LENS"
        self.assertEqual(self.problems(), [])
        self.scene.postchain.order = "JOINT"
        cube.hide_render = wall.hide_render = self.scene.camera.cycles.use_motion_blur = True
        self.assertEqual(self.problems(), [])
        for number in range(7):
            other = cube.copy()
            other.hide_render = False
            self.scene.collection.objects.link(other)
        self.says("'cube.005' and 2 more", wrong=False)
