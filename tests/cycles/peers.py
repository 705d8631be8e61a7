"""Blender's nodes with the settings that are best on the ground truth of a scene, of each kind that the
frame has: peer_*.####.exr and peers.####.json, the settings.

blender -b -P tests/cycles/peers.py -- SCENE_FOLDER FRAME   (docs/scenes.md)
"""
import itertools
import json
import os
import sys
from math import log10, radians

import bpy
import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import node_blur  # noqa: E402

FOLDER, FRAME = sys.argv[sys.argv.index("--") + 1:]


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
    return node_blur.NodeBlur(scene, file("sharp"))


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
              itertools.product(node_blur.FACTORS, (False, True))]
    found = {}
    if os.path.exists(file("mb")):
        found["peer_vectorblur_best"] = best(blur, "peer_vectorblur_best", "mb", [
            {"order": "motion", **one} for one in motion])
    if os.path.exists(file("dof")):
        found["peer_defocus"] = best(blur, "peer_defocus", "dof", [
            {"order": "lens", "stop": stop} for stop in node_blur.STOPS])
    if os.path.exists(file("both")):
        _, start = best(blur, "peer_both_best", "both", [
            {"order": order, **one} for order in node_blur.ORDERS for one in motion])
        found["peer_both_best"] = best(blur, "peer_both_best", "both", [
            {**start, "stop": stop} for stop in node_blur.STOPS])
    with open(file("peers", "json"), "w", encoding="utf8") as out:
        json.dump({name: {"psnr": psnr, **choice} for name, (psnr, choice) in found.items()}, out,
                  indent=1)
        out.write("\n")


main()
