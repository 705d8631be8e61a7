"""Renders the frames of this folder: layers, data and a cryptomatte as Blender's Cycles writes them.

usage: blender -b --factory-startup --python-exit-code 1 -P render.py

A ball rolls past a post in front of a wall, three light groups (key, fill, glow) light all there
is, so they add up to Combined. Writes layers.0001.exr and layers.0002.exr beside this script:
96 x 54, color as half where Blender writes it so, everything else float.
"""
import os
import sys

import bpy
from mathutils import Matrix

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(FOLDER, "../../cycles"))
import materials  # pylint: disable=wrong-import-position
import model  # pylint: disable=wrong-import-position

FRAMES = [1, 2]
GROUPS = ["key", "fill", "glow"]


def surface(name, color, gloss):
    """Diffuse and, by the share `gloss`, a mirror of roughness 0.3."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = materials.Nodes(made.node_tree)
    diffuse = nodes.add("ShaderNodeBsdfDiffuse", {"Color": (*color, 1)}).outputs["BSDF"]
    mirror = nodes.add("ShaderNodeBsdfGlossy", {"Color": (1, 1, 1, 1), "Roughness": 0.3}).outputs["BSDF"]
    nodes.end(nodes.mix(gloss, diffuse, mirror))
    return made


def light(group, direction, strength, color):
    placed = model.add_lamp(group, "SUN", direction)
    placed.lightgroup = group
    placed.data.angle, placed.data.energy, placed.data.color = 0, strength, color


def build():
    wall = model.Mesh("wall")
    wall.box((0, 3, 1), (12, 0.2, 6), surface("plaster", (0.5, 0.55, 0.6), 0))
    wall.finish()
    post = model.Mesh("post")
    post.box((0.35, -0.4, 0.4), (0.16, 0.16, 2.2), surface("paint", (0.15, 0.5, 0.2), 0.2))
    post.finish()
    lamp = model.Mesh("lamp")
    lamp.ball((-1.1, 1.2, 1.25), 0.22, materials.lamp("glowing", (1, 0.7, 0.3), 6.0))
    lamp.finish().lightgroup = "glow"
    ball = model.Mesh("ball")
    ball.ball((0, 0, 0), 0.42, surface("rubber", (0.8, 0.15, 0.1), 0.35))
    ball.finish(lambda t: model.moved(-0.9 + 0.3 * t, 0, 0.35))
    light("key", (0.6, 0.8, -0.7), 3.0, (1, 0.95, 0.85))
    light("fill", (-0.8, 0.7, -0.1), 0.8, (0.6, 0.75, 1))


def set_up():
    scene = bpy.context.scene
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    layer.name = "ViewLayer"
    for group in GROUPS:
        bpy.ops.scene.view_layer_add_lightgroup(name=group)
    layer.use_pass_z = layer.use_pass_vector = layer.use_pass_normal = True
    layer.use_pass_object_index = True
    layer.use_pass_diffuse_direct = layer.use_pass_glossy_direct = layer.use_pass_emit = True
    layer.use_pass_cryptomatte_object = True
    layer.pass_cryptomatte_depth = 4
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 96, 54, 100
    render.use_compositing = render.use_sequencer = False
    render.use_file_extension = False
    render.film_transparent = True
    cycles.device = "CPU"
    cycles.max_bounces = 0  # direct light only: few samples give no noise
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.samples = 16
    camera = bpy.data.cameras.new("camera")
    camera.lens, camera.sensor_width, camera.sensor_fit = 35, 36, "HORIZONTAL"
    placed = bpy.data.objects.new("camera", camera)
    placed.matrix_world = Matrix.Translation((0, -4, 0.7)) @ Matrix.Rotation(1.5708, 4, "X")
    scene.collection.objects.link(placed)
    scene.camera = placed
    image = render.image_settings
    image.file_format, image.color_mode = "OPEN_EXR_MULTILAYER", "RGBA"
    image.color_depth, image.exr_codec = "32", "ZIP"


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FRAMES
    set_up()
    build()
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        bpy.context.scene.render.filepath = os.path.join(FOLDER, f"layers.{frame:04d}.exr")
        bpy.ops.render.render(write_still=True)


main()
