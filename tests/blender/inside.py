"""Runs inside Blender: the add-on's operators, properties and files. Called by addon_test.py with a
folder after "--"; leaves shot.blend there."""
import contextlib
import io
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest

import bpy
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as scenes  # noqa: E402

DOCUMENTS = pathlib.Path(__file__).resolve().parents[2] / "docs"
FOLDER = sys.argv[sys.argv.index("--") + 1]


def outcome():
    return bpy.context.window_manager.postchain_outcome


def addon():
    return sys.modules[scenes.MODULE]


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = os.path.join(FOLDER, self.id().rpartition(".")[2])
        self.scene = scenes.make(self.folder)

    def fails(self, operator, *words, **options):
        """Calls an operator, which must fail with these words in its report and in the panel."""
        with self.assertRaises(RuntimeError) as caught:
            operator(**options)
        for word in words:
            self.assertIn(word, str(caught.exception))
        if operator.idname_py() != "postchain.prepare":  # the panel lists its problems always
            for word in words:
                self.assertIn(word, outcome())

    def problems(self):
        return addon().prepare.problems(self.scene, **addon().properties.blurs(self.scene))

    def says(self, word, wrong):
        self.assertTrue([text for error, text in self.problems() if word in text and error == wrong],
                        self.problems())

    def render(self):
        bpy.ops.postchain.prepare()
        bpy.ops.render.render(animation=True)

    def out(self, name):
        return pathlib.Path(self.folder, "out", name)

    def sidecar(self, frame):
        return json.loads(self.out(f"shot_{frame:04d}.exr.json").read_text("utf8"))


class Registration(Case):
    def test_nothing_is_left_behind(self):
        bpy.ops.preferences.addon_disable(module=scenes.MODULE)
        handlers = {name: list(getattr(bpy.app.handlers, name)) for name in dir(bpy.app.handlers)
                    if isinstance(getattr(bpy.app.handlers, name), list)}
        types = set(dir(bpy.types))
        self.assertFalse([name for name in types if "POSTCHAIN" in name.upper()])
        self.assertFalse(hasattr(bpy.types.Scene, "postchain"))
        self.assertFalse(hasattr(bpy.types.WindowManager, "postchain_outcome"))
        self.assertFalse(hasattr(bpy.types, "POSTCHAIN_OT_filter"))
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


class Prepare(Case):
    def state(self):
        image, layer = self.scene.render.image_settings, self.scene.view_layers[0]
        return (image.file_format, image.color_depth, image.exr_codec, layer.use_pass_z,
                layer.use_pass_vector, layer.use_pass_cryptomatte_object, layer.pass_cryptomatte_depth,
                self.scene.render.use_motion_blur, self.scene.eevee.use_motion_blur,
                self.scene.camera.data.dof.use_dof)

    PREPARED = ("OPEN_EXR_MULTILAYER", "32", "ZIP", True, True, True, 6, False, False, False)

    def prepare(self):
        self.scene.postchain.cryptomatte = True
        self.scene.eevee.use_motion_blur = True
        self.scene.render.image_settings.color_depth = "16"  # PNG's
        before = self.state()
        bpy.ops.postchain.prepare()
        self.assertEqual(self.state(), self.PREPARED)
        texts = [change.text for change in self.scene.postchain.changes]
        self.assertIn("lens: depth of field off", texts)
        return before

    def test_sets_and_puts_back(self):
        before = self.prepare()
        self.assertEqual(addon().prepare.missing(self.scene), [])
        self.assertEqual(bpy.ops.postchain.prepare(), {"FINISHED"})  # changes nothing more
        bpy.ops.postchain.put_back()
        self.assertEqual(self.state(), before)
        self.assertFalse(bpy.ops.postchain.put_back.poll())

    def test_twice_keeps_the_first_values(self):
        before = self.prepare()
        self.scene.camera.data.dof.use_dof = True
        self.scene.render.image_settings.file_format = "OPEN_EXR"
        bpy.ops.postchain.prepare()
        self.assertEqual(self.state(), self.PREPARED)
        bpy.ops.postchain.put_back()
        self.assertEqual(self.state(), before)

    def test_state_is_in_the_file(self):
        before = self.prepare()
        os.makedirs(self.folder, exist_ok=True)
        path = os.path.join(self.folder, "prepared.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.scene = bpy.context.scene
        self.assertEqual(self.state(), self.PREPARED)
        bpy.ops.postchain.put_back()
        self.assertEqual(self.state(), before)

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
        bpy.ops.postchain.put_back()
        self.assertEqual(self.state(), before)

    def test_later_changes_are_kept(self):
        self.prepare()
        self.scene.view_layers[0].use_pass_vector = False
        self.scene.camera.data.name = "renamed"
        bpy.ops.postchain.put_back()
        self.assertFalse(self.scene.view_layers[0].use_pass_vector)
        self.assertTrue(self.scene.camera.data.dof.use_dof)
        self.assertEqual(self.scene.render.image_settings.file_format, "PNG")

    def test_every_camera_of_the_markers(self):
        second = self.scene.camera.copy()
        second.data = self.scene.camera.data.copy()
        self.scene.collection.objects.link(second)
        self.scene.timeline_markers.new("cut", frame=2).camera = second
        bpy.ops.postchain.prepare()
        self.assertFalse(second.data.dof.use_dof)
        bpy.ops.postchain.put_back()
        self.assertTrue(second.data.dof.use_dof)


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
        self.scene.cycles.motion_blur_position = "START"
        self.scene.unit_settings.scale_length = 0.01  # Blender's lens does not follow it
        found = self.one()
        for key, value in {
                "resolution": [64, 36], "near_clip": 0.25, "far_clip": 80, "focal_length_mm": 35,
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
        for frame, value in ((1, 4.0), (3, 8.0)):
            data.dof.focus_distance = value
            data.dof.keyframe_insert("focus_distance", frame=frame)
            data.dof.aperture_fstop = value / 4
            data.dof.keyframe_insert("aperture_fstop", frame=frame)
            self.scene.render.motion_blur_shutter = value / 8
            self.scene.render.keyframe_insert("motion_blur_shutter", frame=frame)
        self.scene.frame_set(17)
        found = self.one((1, 2, 3))
        self.assertEqual(found["frames"]["1"], {"focus_distance": 4, "f_stop": 1,
                                                "shutter_frames": 0.5})
        self.assertEqual(found["frames"]["3"], {"focus_distance": 8, "f_stop": 2,
                                                "shutter_frames": 1})
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

    def test_negative_frames(self):
        self.scene.frame_start, self.scene.frame_end = -2, 0
        self.assertEqual(list(self.one(range(-2, 1))["frames"]), ["-2", "-1", "0"])

    def test_markers_switch_cameras(self):
        eye = self.scene.camera
        second = eye.copy()
        second.data = eye.data.copy()
        second.data.lens, second.location.x = 85, 7
        self.scene.collection.objects.link(second)
        for frame, camera in ((1, eye), (3, second), (5, eye)):
            self.scene.timeline_markers.new("cut", frame=frame).camera = camera
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

    def test_resolution_is_blenders(self):
        self.scene.render.resolution_x, self.scene.render.resolution_y = 1100, 300
        self.scene.render.resolution_percentage = 29
        (_, content), = self.describe([1])
        self.assertEqual(content["resolution"], [319, 87])

    def test_scenes_without_a_camera_file(self):
        eye = self.scene.camera
        error = addon().camera.CameraError
        self.scene.camera = None
        self.fails(bpy.ops.postchain.prepare, "the scene has no camera", "Scene properties, Camera")
        self.fails(bpy.ops.postchain.filter, "the scene has no camera")
        self.fails(bpy.ops.postchain.compare, "the scene has no camera")
        self.assertRaisesRegex(error, "frame 2: the scene has no camera", self.describe)
        self.scene.camera = bpy.data.objects["cube"]
        self.assertRaisesRegex(error, "'cube', the scene's camera, is not a camera", self.describe)
        self.fails(bpy.ops.postchain.prepare, "the scene has no camera")
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


class Problems(Case):
    def test_settings_that_cannot_be_filtered(self):
        render = self.scene.render
        render.engine = "BLENDER_WORKBENCH"
        self.fails(bpy.ops.postchain.prepare, "Workbench has neither depth nor motion vectors")
        render.engine = "BLENDER_EEVEE"
        self.says("EEVEE has no motion vectors", wrong=bpy.app.version < (4, 2, 0))
        self.scene.postchain.order = "LENS"
        self.assertEqual(self.problems(), [])
        self.scene.postchain.order = "JOINT"
        render.engine = "CYCLES"
        render.use_border = render.use_crop_to_border = True
        self.says("Crop to Render Region off", wrong=True)
        render.use_border = False
        dof = self.scene.camera.data.dof
        dof.keyframe_insert("use_dof", frame=1)
        self.says("switched by an animation", wrong=True)
        self.scene.camera.data.animation_data_clear()
        dof.aperture_ratio = 0.05
        self.says("outside 0.1 to 10", wrong=True)
        dof.aperture_ratio, dof.focus_distance = 1, 0
        self.says("focuses at distance 0", wrong=True)
        dof.focus_distance = 8
        self.scene.sequence_editor_create().sequences.new_scene("s", self.scene, 1, 1)
        self.says("Sequencer off", wrong=True)
        render.use_sequencer = False
        self.assertEqual(self.problems(), [])
        self.scene.cycles.motion_blur_position = "END"
        self.says("not Center on Frame", wrong=False)
        self.scene.camera.data.shift_y = 0.1
        self.says("shifted lens", wrong=False)
        render.pixel_aspect_x = 2
        self.says("pixel aspect", wrong=False)


class Filter(Case):
    def test_sequence_then_other_chains(self):
        self.fails(bpy.ops.postchain.filter, "not OpenEXR MultiLayer", "press Prepare")
        self.scene.postchain.output = os.path.join(self.folder, "render")
        bpy.ops.postchain.prepare()
        self.fails(bpy.ops.postchain.filter, "3 of 3 frames have not been rendered (first: 1)")
        self.render()
        self.fails(bpy.ops.postchain.filter, "is that of the render")
        self.scene.postchain.output = os.path.join(self.folder, "out")
        self.scene.postchain.result = "NODE"
        self.assertEqual(bpy.ops.postchain.filter(), {"FINISHED"})
        self.assertEqual(outcome(), f"INFO\n3 frames are in {self.folder}/out")
        node = self.scene.node_tree.nodes["postchain"]
        self.assertEqual((node.image.source, node.frame_duration, node.frame_start, node.frame_offset),
                         ("SEQUENCE", 3, 1, 0))
        self.assertIn("Combined", node.outputs)
        self.assertGreater(len(self.out("shot_0002.exr").read_bytes()), 5000)

        first = self.out("shot_0002.exr").stat().st_mtime_ns
        bpy.ops.postchain.filter()  # kept: the same chain and input
        self.assertEqual(self.out("shot_0002.exr").stat().st_mtime_ns, first)
        self.assertEqual(len(self.scene.node_tree.nodes), len({one.name for one in
                                                               self.scene.node_tree.nodes}))
        self.scene.frame_start = self.scene.frame_end = 2
        self.scene.postchain.joint_blur.starts = 2
        self.scene.postchain.samples = 8
        bpy.ops.postchain.filter()
        self.assertNotEqual(self.out("shot_0002.exr").stat().st_mtime_ns, first)
        written = json.loads(self.out("shot_chain.json").read_text("utf8"))
        self.assertEqual(written["passes"], [
            {"joint_blur": {"samples": 8, "neighbors": "none", "starts": 2}},
            {"fxaa": {"mode": "directional"}}])
        bpy.ops.postchain.reset(name="joint_blur")
        self.assertNotIn("starts", addon().properties.chain(self.scene)["passes"][0][1])

        self.scene.postchain.motion_blur.center_weight = 5
        self.scene.postchain.order = "MOTION"
        self.fails(bpy.ops.postchain.filter, "center_weight", "has no effect")
        self.scene.postchain.existing = "fail"
        bpy.ops.postchain.reset(name="motion_blur")
        self.fails(bpy.ops.postchain.filter, "shot_0002.exr", "exists")

    def test_a_camera_that_stands_still_has_a_still_sky(self):
        bpy.data.objects["wall"].hide_render = True  # what is left moves, before the sky
        self.scene.frame_end = 1
        self.render()
        bpy.ops.postchain.filter()
        self.assertEqual(outcome(), f"INFO\n1 frame is in {self.folder}/out")

    def test_missing_pass(self):
        self.render()
        self.scene.view_layers[0].use_pass_z = False
        bpy.ops.render.render(animation=True)
        self.fails(bpy.ops.postchain.filter, "shot_0001.exr", "depth")
        self.scene.view_layers[0].use_pass_z = True
        self.scene.view_layers[0].use_pass_vector = False
        bpy.ops.render.render(animation=True)
        self.fails(bpy.ops.postchain.filter, "shot_0001.exr has no motion vectors", "Prepare")
        self.scene.postchain.order = "LENS"
        self.assertEqual(bpy.ops.postchain.filter(), {"FINISHED"})

    def test_render_result(self):
        self.fails(bpy.ops.postchain.filter, "not OpenEXR MultiLayer", source="RENDER")
        bpy.ops.postchain.prepare()
        self.scene.frame_set(2)
        bpy.ops.render.render()
        self.assertEqual(bpy.ops.postchain.filter(source="RENDER"), {"FINISHED"})
        self.assertTrue(self.out("render_0002.exr").exists())
        self.assertIn("postchain render_0002.exr", bpy.data.images)

    def test_negative_frames(self):
        bpy.ops.postchain.prepare()
        bpy.context.preferences.edit.use_negative_frames = True
        self.scene.frame_set(-2)
        self.assertEqual(self.scene.frame_current, -2)
        bpy.ops.render.render()
        self.assertEqual(bpy.ops.postchain.filter(source="RENDER"), {"FINISHED"})
        self.assertEqual(list(addon().filter.on_disk(self.folder + "/out/render_####.exr")), [-2])

    def test_both_eyes(self):
        render = self.scene.render
        render.use_multiview = True
        render.image_settings.views_format = "INDIVIDUAL"
        self.scene.frame_end = 1
        self.render()
        self.assertEqual(render.image_settings.views_format, "MULTIVIEW")
        bpy.ops.postchain.filter()
        for view in ("left", "right"):
            done = subprocess.run(
                [os.environ["POSTCHAIN"], "diff", os.path.join(self.folder, "render/shot_0001.exr"),
                 str(self.out("shot_0001.exr")), "--view", view, "--metric", "psnr", "--json"],
                capture_output=True, text=True, check=True)
            self.assertLess(json.loads(done.stdout)["psnr"], 40, view)
        bpy.ops.postchain.put_back()

    def test_cryptomatte(self):
        self.scene.postchain.cryptomatte, self.scene.frame_end = True, 1
        self.render()
        bpy.ops.postchain.filter()
        matte, = self.sidecar(1)["layers"]["cryptomattes"]
        self.assertEqual((matte["name"], matte["ids"]), ("ViewLayer.CryptoObject", 2))

    def test_documented_compositor(self):
        page = pathlib.Path(DOCUMENTS, "recipes.md").read_text("utf8")
        code = re.search(r"<!-- compositor -->\n+```python\n(.*?)```", page, re.S)[1]
        self.render()
        self.scene.use_nodes = True
        exec(code, {"bpy": bpy, "scene": self.scene})
        link, = self.scene.node_tree.nodes["Composite"].inputs["Image"].links
        self.assertEqual(link.from_node.name, "postchain")
        self.assertEqual(link.from_socket.name, "Combined")

    def test_frame_step(self):
        self.scene.frame_step, self.scene.postchain.preset = 2, "balanced"
        self.scene.postchain.samples = 4
        self.render()
        bpy.ops.postchain.filter()
        self.assertEqual(sorted(addon().filter.on_disk(self.folder + "/out/shot_####.exr")), [1, 3])
        self.assertEqual(len(self.sidecar(3)["plan"]["missing_neighbors"]), 2)

    def test_camera_cut(self):
        second = self.scene.camera.copy()
        second.location.x = 5
        self.scene.collection.objects.link(second)
        for frame, camera in ((1, self.scene.camera), (3, second)):
            self.scene.timeline_markers.new("cut", frame=frame).camera = camera
        self.scene.postchain.preset, self.scene.postchain.samples = "balanced", 4
        self.render()
        bpy.ops.postchain.filter()
        self.assertTrue(self.out("shot_camera.2.json").exists())
        used = [self.sidecar(frame)["plan"]["passes"][0]["parameters"] for frame in (1, 2, 3)]
        for parameters, neighbors in zip(used, ("both", "before", "none")):
            self.assertIn(f"neighbors={neighbors}", parameters)

    def test_without_the_command(self):
        self.render()
        own = bpy.context.preferences.addons[scenes.MODULE].preferences
        own.command = "/nowhere/postchain"
        self.fails(bpy.ops.postchain.filter, "/nowhere/postchain is not a program", "Preferences")
        own.command = ""
        path, home = os.environ["PATH"], os.environ["HOME"]
        try:
            os.environ["PATH"] = os.environ["HOME"] = "/nowhere"
            self.fails(bpy.ops.postchain.filter, "was not found", "install")
            self.fails(bpy.ops.postchain.compare, "was not found", "install")
            os.environ["PATH"] = os.path.dirname(os.environ["POSTCHAIN"])
            self.assertEqual(addon().command.path(), os.environ["POSTCHAIN"])
        finally:
            os.environ["PATH"], os.environ["HOME"] = path, home
            own.command = os.environ["POSTCHAIN"]

    def test_cancel(self):
        command = addon().command
        job = command.Job([command.Step("sleep", ["sleep", "600"], lambda line: None)])
        job.start()
        self.assertFalse(job.poll())
        start = time.monotonic()
        self.fails(bpy.ops.postchain.compare, "another job of postchain is running")
        command.cancel_all()
        self.assertLess(time.monotonic() - start, 15)  # by SIGTERM, not by SIGKILL after 20 s
        self.assertFalse(command.Job.running)

    def test_files_of_any_name(self):
        files = addon().filter.files
        for path, pattern in (("/a/b_##", "/a/b_##.exr"), ("/a/b", "/a/b####.exr"),
                              ("/a/b_###_c.exr", "/a/b_###_c.exr"), ("/a/", "/a/####.exr")):
            self.scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
            self.scene.render.filepath = path
            self.assertEqual(files(self.scene), pattern)


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
                value = getattr(group, row["key"])
                if row["default"] is not None:
                    self.assertEqual(str(value) if "allowed" not in row else int(value),
                                     str(row["default"]) if "allowed" not in row else row["default"]
                                     ) if isinstance(row["default"], str) or "allowed" in row else \
                        self.assertAlmostEqual(value, row["default"], places=5)
        bpy.ops.postchain.own(name="joint_blur", key="samples")
        self.assertTrue(self.scene.postchain.joint_blur.is_property_set("samples"))
        self.assertEqual(self.scene.postchain.joint_blur.samples, 16)  # of the chain `fast`
        bpy.ops.postchain.own(name="joint_blur", key="f_stop")  # no value yet
        bpy.ops.postchain.own(name="fxaa", key="preset")
        self.assertEqual(addon().properties.chain(self.scene)["passes"][1][1]["preset"], 12)
        bpy.ops.postchain.reset(name="joint_blur", key="samples")
        self.assertFalse(self.scene.postchain.joint_blur.is_property_set("samples"))
        bpy.ops.postchain.reset(name="joint_blur")
        self.assertFalse(self.scene.postchain.joint_blur.is_property_set("f_stop"))
        self.scene.postchain.fxaa.preset = "39"
        self.scene.postchain.fxaa.subpix = 0.5
        self.scene.postchain.fxaa.matte = "cryptomatte:hero"
        values = addon().properties.chain(self.scene)["passes"][1][1]
        self.assertEqual(values, {"mode": "directional", "preset": 39, "subpix": 0.5,
                                  "matte": "cryptomatte:hero"})


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


class Shot(Case):
    def test_file_for_the_farm(self):
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "shot.blend"), copy=True)


scenes.install()
printed = io.StringIO()
with contextlib.redirect_stdout(sys.stdout):
    result = unittest.main(argv=["inside"], exit=False, verbosity=1).result
sys.stdout.flush()
if not result.wasSuccessful():
    raise SystemExit(1)
print("\nOK\n", flush=True)
