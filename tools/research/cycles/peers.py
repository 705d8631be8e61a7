"""Blender's Vector Blur and Defocus nodes with the settings that are best on the ground truth of a scene, of
each kind that the frame has: peer_*.####.exr and peers.####.json, the settings.

blender -b -P tools/research/cycles/peers.py -- SCENE_FOLDER FRAME   (docs/scenes.md)
"""
import itertools
import json
import os
import sys
from math import log10, radians

import bpy
import numpy as np

ORDERS = ("lens_motion", "motion_lens")
FACTORS = (0.35, 0.5, 0.6, 0.7, 0.85, 1)
STOPS = (0.7, 0.85, 1, 1.2, 1.4)  # times that of a thin lens
BOKEH = {3: "TRIANGLE", 4: "SQUARE", 5: "PENTAGON", 6: "HEXAGON", 7: "HEPTAGON", 8: "OCTAGON"}
FOLDER, FRAME = sys.argv[sys.argv.index("--") + 1:]


class NodeBlur:
    """path: a multilayer EXR. The scene has its camera and size."""

    def __init__(self, scene, path):
        self.scene = scene
        scene.use_nodes = scene.render.use_compositing = True
        self.tree = scene.node_tree
        self.tree.nodes.clear()
        self.source = self.tree.nodes.new("CompositorNodeImage")
        self.source.image = bpy.data.images.load(path)
        self.blur = self.tree.nodes.new("CompositorNodeVecBlur")
        self.blur.samples, self.blur.speed_max = 128, 0
        self.defocus = self.tree.nodes.new("CompositorNodeDefocus")
        self.defocus.use_zbuffer, self.defocus.use_preview, self.defocus.scene = True, False, scene
        self.defocus.threshold, self.defocus.blur_max = 1, 100
        dof = scene.camera.data.dof
        self.defocus.bokeh = BOKEH.get(dof.aperture_blades, "CIRCLE")
        self.defocus.angle = dof.aperture_rotation
        # With this stop the node is a thin lens. It is one by itself in 4.3; in 3.4 it takes the camera's width for a
        # meter. Versions between have not been measured.
        is_thin_lens = bpy.app.version >= (4, 2, 0)
        self.thin_lens = dof.aperture_fstop * (1 if is_thin_lens else 1000 / scene.camera.data.sensor_width)
        self.result = self.tree.nodes.new("CompositorNodeComposite")
        for node in (self.blur, self.defocus):
            self.tree.links.new(self.source.outputs["Depth"], node.inputs["Z"])
        self.tree.links.new(self.source.outputs["Vector"], self.blur.inputs["Speed"])
        image = scene.render.image_settings
        image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"

    def render(self, path, order, factor=0.5, curved=False, stop=1):
        """order: of ORDERS, or one of "lens" and "motion"."""
        self.blur.factor, self.blur.use_curved = factor, curved
        self.defocus.f_stop = self.thin_lens * stop
        last = self.source.outputs["Combined"]
        for one in order.split("_"):
            node = self.defocus if one == "lens" else self.blur
            self.tree.links.new(last, node.inputs["Image"])
            last = node.outputs["Image"]
        self.tree.links.new(last, self.result.inputs["Image"])
        self.scene.render.filepath = path
        bpy.ops.render.render(write_still=True)


def file(name, extension="exr"):
    return os.path.join(os.path.abspath(FOLDER), f"{name}.{int(FRAME):04d}.{extension}")


def displayed(path):
    """Values after x/(1+x) and gamma 2.2, as postchain diff compares them."""
    image = bpy.data.images.load(path)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    values = np.maximum(values.reshape(-1, 4)[:, :3], 0)
    return (values / (1 + values))**(1 / 2.2)


def set_up():
    """A scene with the camera of camera.json; the node reads lens and focus only."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with open(os.path.join(FOLDER, "camera.json"), encoding="utf8") as camera_file:
        content = json.load(camera_file)
    content.update(content["frames"].get(FRAME, {}))
    data = bpy.data.cameras.new("camera")
    data.lens, data.sensor_width = content["focal_length_mm"], content["sensor_width_mm"]
    data.clip_end = content["far_clip"]
    data.dof.use_dof = True
    data.dof.focus_distance, data.dof.aperture_fstop = content["focus_distance"], content["f_stop"]
    data.dof.aperture_blades = content["aperture_blades"]
    data.dof.aperture_rotation = radians(content["aperture_rotation_deg"])
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = content["resolution"]
    scene.render.use_file_extension = False
    return NodeBlur(scene, file("sharp"))


def best(blur, name, truth, choices):
    """Keeps the image of the best choice as `name`; (PSNR, choice). A choice: options of render()."""
    reference, found = displayed(file(truth)), (-1, None)
    for choice in choices:
        blur.render(file("trial"), **choice)
        psnr = -10 * log10(float(np.mean((displayed(file("trial")) - reference)**2)))
        if psnr > found[0]:
            found = psnr, choice
            os.replace(file("trial"), file(name))
    if os.path.exists(file("trial")):
        os.remove(file("trial"))
    return found


def main():
    blur = set_up()
    motion = [{"factor": factor, "curved": curved} for factor, curved in
              itertools.product(FACTORS, (False, True))]
    found = {}
    if os.path.exists(file("mb")):
        found["peer_vectorblur_best"] = best(blur, "peer_vectorblur_best", "mb", [
            {"order": "motion", **one} for one in motion])
    if os.path.exists(file("dof")):
        found["peer_defocus"] = best(blur, "peer_defocus", "dof", [
            {"order": "lens", "stop": stop} for stop in STOPS])
    if os.path.exists(file("both")):
        _, start = best(blur, "peer_both_best", "both", [
            {"order": order, **one} for order in ORDERS for one in motion])
        found["peer_both_best"] = best(blur, "peer_both_best", "both", [
            {**start, "stop": stop} for stop in STOPS])
    with open(file("peers", "json"), "w", encoding="utf8") as out:
        json.dump({name: {"psnr": psnr, **choice} for name, (psnr, choice) in found.items()}, out,
                  indent=1)
        out.write("\n")


main()
