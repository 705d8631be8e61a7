"""The base of the tests that run inside Blender: a scene in a folder of its own, and checks of the
add-on's messages. The folder of all tests comes after "--"."""
import importlib
import json
import os
import pathlib
import sys
import unittest

import bpy

import scene as scenes

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

    def second_camera(self):
        """A copy of the scene's camera with data of its own."""
        made = self.scene.camera.copy()
        made.data = made.data.copy()
        self.scene.collection.objects.link(made)
        return made

    def cut(self, cameras):
        """Markers: the frame -> the camera from there on."""
        for frame, camera in cameras.items():
            self.scene.timeline_markers.new("cut", frame=frame).camera = camera

    def peel(self):
        return importlib.import_module(scenes.MODULE + ".peel")

    def out(self, name):
        return pathlib.Path(self.folder, "out", name)

    def sidecar(self, frame):
        return json.loads(self.out(f"shot_{frame:04d}.exr.json").read_text("utf8"))
