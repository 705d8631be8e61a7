"""Inside Blender: the camera file of each shot."""
import json
import math
import os

import bpy
from mathutils import Matrix

import scene as scenes
from addon_case import Case, addon


class Camera(Case):
    def describe(self, frames=(2,)):
        return addon().camera.describe(self.scene, list(frames))

    def one(self, frames=(2,)):
        (_, content), = self.describe(frames)
        return content

    def test_values(self):
        data, render = self.scene.camera.data, self.scene.render
        data.clip_start, data.clip_end = 0.25, 80
        data.dof.aperture_blades, data.dof.aperture_rotation = 7, math.radians(30)
        data.dof.aperture_ratio = 2
        data.shift_x = 0.125
        render.motion_blur_shutter, render.fps, render.fps_base = 0.75, 30, 1.001
        render.resolution_x, render.resolution_y, render.resolution_percentage = 1100, 300, 29
        scenes.shutter_owner(self.scene).motion_blur_position = "START"
        self.scene.unit_settings.scale_length = 0.01  # Blender's lens does not follow it
        found = self.one()
        for key, value in {
                "resolution": [319, 87], "near_clip": 0.25, "far_clip": 80, "focal_length_mm": 35,
                "sensor_width_mm": 32, "sensor_fit": "auto", "f_stop": 0.05, "focus_distance": 8,
                "aperture_blades": 7, "aperture_rotation_deg": 30, "aperture_ratio": 2,
                "lens_shift": [0.125, 0], "shutter_frames": 0.75, "shutter_position": "start",
                "meters_per_unit": 1, "frames": {"2": {}}}.items():
            self.assertEqual(found[key], value, key)
        self.assertAlmostEqual(found["fps"], 30 / 1.001, places=5)
        data.sensor_fit, data.sensor_height = "VERTICAL", 20
        self.assertEqual(self.one()["sensor_width_mm"], 20)
        self.assertEqual(self.one()["sensor_fit"], "vertical")

    def test_animated_values_are_those_of_each_frame(self):
        data = self.scene.camera.data
        for frame, scale in ((1, 1), (3, 2)):
            for owner, key, value in ((data.dof, "focus_distance", 4), (data.dof, "aperture_fstop", 1),
                                      (self.scene.render, "motion_blur_shutter", 0.5)):
                setattr(owner, key, value * scale)
                owner.keyframe_insert(key, frame=frame)
        self.scene.frame_set(17)
        found = self.one((1, 2, 3))
        self.assertEqual(found["frames"]["3"], {"focus_distance": 8, "f_stop": 2, "shutter_frames": 1})
        self.assertAlmostEqual(found["frames"]["2"]["focus_distance"], 6, places=5)
        self.assertEqual(self.scene.frame_current, 17)  # the scene stays where it was

    def test_focus_object_and_bone(self):
        eye = self.scene.camera
        target = bpy.data.objects.new("target", None)
        self.scene.collection.objects.link(target)
        target.location = 3, 5, -2  # the camera looks along +y: the distance is 5
        eye.data.dof.focus_object = target
        self.assertAlmostEqual(self.one()["focus_distance"], 5, places=5)
        eye.scale = 3, 3, 3  # of a camera, Blender ignores it
        self.assertAlmostEqual(self.one()["focus_distance"], 5, places=5)
        rows = Matrix(self.one()["camera_matrix_world"]["2"])
        self.assertLess((rows - Matrix.Rotation(math.pi / 2, 4, "X")).median_scale, 1e-6)

        armature = bpy.data.armatures.new("rig")
        rig = bpy.data.objects.new("rig", armature)
        self.scene.collection.objects.link(rig)
        bpy.context.view_layer.objects.active = rig
        bpy.ops.object.mode_set(mode="EDIT")
        bone = armature.edit_bones.new("hand")
        bone.head, bone.tail = (0, 6.5, 0), (0, 7, 0)
        bpy.ops.object.mode_set(mode="OBJECT")
        eye.data.dof.focus_object, eye.data.dof.focus_subtarget = rig, "hand"
        self.assertAlmostEqual(self.one()["focus_distance"], 6.5, places=5)

    def test_matrices_of_the_frames_around(self):
        eye = self.scene.camera
        for frame in (0, 4):
            eye.location.x = frame
            eye.keyframe_insert("location", frame=frame)
        for point in eye.animation_data.action.fcurves[0].keyframe_points:
            point.interpolation = "LINEAR"
        self.scene.frame_step = 2
        self.assertEqual(addon().camera.scene_frames(self.scene), [1, 3])
        matrices = self.one((1, 3))["camera_matrix_world"]
        self.assertEqual(list(matrices), ["0", "1", "2", "3", "4"])
        for frame, rows in matrices.items():
            self.assertAlmostEqual(rows[0][3], int(frame), places=5)
        self.says("frame step 2", wrong=False)

    def test_markers_switch_cameras(self):
        eye = self.scene.camera
        second = self.second_camera()
        second.data.lens, second.location.x = 85, 7
        self.cut({1: eye, 3: second, 5: eye})
        shots = self.describe(range(1, 6))
        self.assertEqual([frames for frames, _ in shots], [[1, 2], [3, 4], [5]])
        self.assertEqual([one["focal_length_mm"] for _, one in shots], [35, 85, 35])
        # The frame after the cut has the matrix of the camera before it.
        self.assertEqual(shots[0][1]["camera_matrix_world"]["3"][0][3], 0)
        self.assertEqual(shots[1][1]["camera_matrix_world"]["2"][0][3], 7)
        runs = addon().filter.runs
        chain = addon().properties.shipped("balanced")
        split = [(frames, json.loads(text)["passes"][0]["joint_blur"].get("neighbors"))
                 for frames, text in runs(([3, 4, 5], True, True), {"passes": chain})]
        self.assertEqual(split, [([3], "none"), ([4], None), ([5], "before")])
        self.assertEqual(len(runs(([3, 4, 5], False, False), {"passes": chain})), 1)
        for before, after in ((True, False), (False, True)):
            (_, text), = runs(([3], before, after), {"passes": chain})
            self.assertIn('"neighbors": "none"', text)
        at = addon().camera.camera_at
        self.assertEqual([at(self.scene, frame) for frame in (0, 2, 3, 4, 5, 9)],
                         [eye, eye, second, second, eye, eye])

    def test_scenes_without_a_camera_file(self):
        eye = self.scene.camera
        error = addon().camera.CameraError
        self.scene.camera = None
        for operator in (bpy.ops.postchain.prepare, bpy.ops.postchain.filter, bpy.ops.postchain.compare):
            self.fails(operator, "the scene has no camera")
        self.assertRaisesRegex(error, "frame 2: the scene has no camera", self.describe)
        self.scene.camera = bpy.data.objects["cube"]
        self.assertRaisesRegex(error, "'cube', the scene's camera, is not a camera", self.describe)
        self.scene.camera = eye
        eye.data.type = "PANO"
        self.assertRaisesRegex(error, "'eye' is panoramic.*Perspective", self.describe)
        self.fails(bpy.ops.postchain.prepare, "'eye' is panoramic", "Perspective")
        eye.data.type = "PERSP"
        parent = bpy.data.objects.new("parent", None)
        self.scene.collection.objects.link(parent)
        parent.scale, eye.parent, eye.rotation_euler.z = (1, 3, 1), parent, 0.5
        self.assertRaisesRegex(error, "'eye' is sheared.*apply", self.describe)
        self.assertRaisesRegex(error, "no frames", self.describe, [])

    def test_orthographic_camera_has_motion_blur_only(self):
        self.scene.camera.data.type = "ORTHO"
        self.assertNotIn("focal_length_mm", self.one())
        self.render()
        self.fails(bpy.ops.postchain.filter, "'eye' is orthographic", "'Motion blur only'")
        self.scene.postchain.order = "MOTION"
        bpy.ops.postchain.filter()
        self.assertEqual([one["pass"] for one in self.sidecar(2)["plan"]["passes"]],
                         ["motion_blur", "fxaa"])

    def test_linked_camera(self):
        library = os.path.join(self.folder, "library.blend")
        os.makedirs(self.folder, exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=library)
        self.scene = scenes.make(self.folder)
        bpy.data.objects.remove(self.scene.camera)
        with bpy.data.libraries.load(library, link=True) as (_, into):
            into.objects = ["eye"]
        eye, = into.objects
        self.scene.collection.objects.link(eye)
        self.scene.camera = eye
        self.assertEqual(self.one()["focal_length_mm"], 35)
        self.fails(bpy.ops.postchain.prepare, "linked from", "library override")
        own = eye.override_create(remap_local_usages=True)
        own.data.override_create(remap_local_usages=True)
        self.assertEqual(bpy.ops.postchain.prepare(), {"FINISHED"})
        self.assertFalse(self.scene.camera.data.dof.use_dof)
