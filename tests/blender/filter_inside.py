"""Inside Blender: Filter on sequences and on the render result."""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import unittest.mock

import bpy

import scene as scenes
from addon_case import Case, addon, outcome

DOCUMENTS = pathlib.Path(__file__).resolve().parents[2] / "docs"


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
            {"fxaa": {"mode": "directional", "where": "blurred"}}])
        bpy.ops.postchain.reset(name="joint_blur")
        self.assertEqual(addon().properties.chain(self.scene)["passes"][0][1]["starts"], 5)  # of the chain `fast`

        self.scene.postchain.motion_blur.center_weight = 5
        self.scene.postchain.order = "MOTION"
        self.fails(bpy.ops.postchain.filter, "center_weight", "has no effect")
        self.scene.postchain.existing = "fail"
        bpy.ops.postchain.reset(name="motion_blur")
        self.fails(bpy.ops.postchain.filter, "shot_0002.exr", "exists")

    def test_a_still_sky_and_a_cryptomatte(self):
        bpy.data.objects["wall"].hide_render = True  # what is left moves, before the sky
        self.scene.postchain.cryptomatte, self.scene.frame_end = True, 1
        self.render()
        bpy.ops.postchain.filter()
        self.assertEqual(outcome(), f"INFO\n1 frame is in {self.folder}/out")
        matte, = self.sidecar(1)["layers"]["cryptomattes"]
        self.assertEqual((matte["name"], matte["ids"]), ("ViewLayer.CryptoObject", 1))

    def test_without_file_extensions(self):
        self.scene.render.use_file_extension = False
        self.scene.frame_end = 1
        self.render()
        self.assertEqual(os.listdir(self.folder + "/render"), ["shot_0001"])
        bpy.ops.postchain.behind()
        bpy.ops.postchain.filter()
        self.assertEqual(self.sidecar(1)["inputs"]["behind"], self.folder + "/render/behind/shot_0001")

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

    def test_preview_of_one_frame(self):
        self.scene.postchain.preset, self.scene.postchain.samples = "balanced", 4
        self.scene.postchain.result, self.scene.postchain.existing = "NONE", "fail"
        self.render()
        self.scene.frame_set(2)
        for _ in range(2):
            self.assertEqual(bpy.ops.postchain.filter(source="FRAME"), {"FINISHED"})
        self.assertFalse(self.out("").exists())
        folder = outcome().partition("1 frame is in ")[2]
        made = json.loads(pathlib.Path(folder, "shot_0002.exr.json").read_text("utf8"))
        self.assertNotIn("missing_neighbors", made["plan"])
        self.assertEqual(os.path.dirname(bpy.path.abspath(bpy.data.images["postchain shot_0002.exr"].filepath)), folder)
        self.scene.frame_set(9)
        self.fails(bpy.ops.postchain.filter, "1 of 1 frames have not been rendered (first: 9)", source="FRAME")

    def test_cpu_warning_once(self):
        self.cut({1: self.scene.camera, 3: self.second_camera()})  # two calls of the command
        self.render()
        own = bpy.context.preferences.addons[scenes.MODULE].preferences
        own.device = "auto"
        self.addCleanup(setattr, own, "device", "software")
        self.enterContext(unittest.mock.patch.dict(os.environ, XDG_STATE_HOME=str(self.out("state"))))
        bpy.ops.postchain.filter()
        if "CPU" not in outcome():
            self.skipTest("a GPU")
        self.assertEqual(outcome().count("no GPU with OpenGL 4.5"), 1)
        self.assertIn("choose the device CPU in Preferences", outcome())
        self.scene.postchain.existing = "overwrite"
        bpy.ops.postchain.filter()
        self.assertNotIn("CPU", outcome())

    def test_reason_of_a_failed_process(self):
        command = addon().command
        failing = "import sys; print('Blender quit', file=sys.%s); raise RuntimeError('no channel\\nin it')"
        for stream in ("stdout", "stderr"):
            job = command.Job([command.Step("Test", [sys.executable, "-c", failing % stream], lambda line: None)])
            job.start()
            with self.assertRaises(command.CommandError) as caught:
                while not job.poll():
                    job.wait(1)
            self.assertEqual(str(caught.exception), "Test: no channel\nin it")
        self.assertEqual(command.reason(["Blender 3.4.1", "", "a", "b", "c"]), "a; b; c")
        self.assertEqual(command.reason(["Error: Python: Traceback (most recent call last):", '  File "x"',
                                         "KeyError: 'a'", "", "Error: script failed"]), "KeyError: 'a'")

    def test_render_results(self):
        self.fails(bpy.ops.postchain.filter, "not OpenEXR MultiLayer", source="RENDER")
        bpy.ops.postchain.prepare()
        bpy.context.preferences.edit.use_negative_frames = True
        for frame in (2, -2):
            self.scene.frame_set(frame)
            bpy.ops.render.render()
            self.assertEqual(bpy.ops.postchain.filter(source="RENDER"), {"FINISHED"})
        self.assertIn("postchain render_0002.exr", bpy.data.images)
        self.assertEqual(sorted(addon().filter.on_disk(self.folder + "/out/render_####.exr")), [-2, 2])

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

    def test_documented_compositor_and_frame_step(self):
        page = pathlib.Path(DOCUMENTS, "recipes.md").read_text("utf8")
        code = re.search(r"<!-- compositor -->\n+```python\n(.*?)```", page, re.S)[1]
        self.scene.frame_step, self.scene.postchain.preset = 2, "balanced"
        self.scene.postchain.samples = 4
        self.render()
        self.scene.use_nodes = True
        exec(code, {"bpy": bpy, "scene": self.scene})
        link, = self.scene.node_tree.nodes["Composite"].inputs["Image"].links
        self.assertEqual(link.from_node.name, "postchain")
        self.assertEqual(link.from_socket.name, "Combined")
        self.assertEqual(sorted(addon().filter.on_disk(self.folder + "/out/shot_####.exr")), [1, 3])
        self.assertEqual(len(self.sidecar(3)["plan"]["missing_neighbors"]), 2)

    def test_camera_cut(self):
        second = self.second_camera()
        second.location.x = 5
        self.cut({1: self.scene.camera, 3: second})
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
        self.fails(bpy.ops.postchain.compare, "another job of postchain is running")
        process = job._process
        command.cancel_all()
        self.assertEqual(process.returncode, -signal.SIGTERM)  # not by SIGKILL, after 20 s
        self.assertFalse(command.Job.running)

    def test_files_of_any_name(self):
        files = addon().filter.files
        for path, pattern in (("/a/b_##", "/a/b_##.exr"), ("/a/b", "/a/b####.exr"),
                              ("/a/b_###_c.exr", "/a/b_###_c.exr"), ("/a/", "/a/####.exr")):
            self.scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
            self.scene.render.filepath = path
            self.assertEqual(files(self.scene), pattern)
