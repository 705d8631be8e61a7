"""Runs inside Blender: installs the add-on and makes a small scene, as a user's file has it: PNG,
motion blur and depth of field on."""
import os

import bpy

MODULE = os.environ.get("POSTCHAIN_MODULE", "postchain_blender")


def install():
    path = os.environ["POSTCHAIN_ZIP"]
    if MODULE.startswith("bl_ext."):
        bpy.ops.extensions.package_install_files(filepath=path, repo=MODULE.split(".")[1], enable_on_install=False)
    else:
        bpy.ops.preferences.addon_install(filepath=path, overwrite=True)
    enable()


def enable():
    bpy.ops.preferences.addon_enable(module=MODULE)
    own = bpy.context.preferences.addons[MODULE].preferences
    own.command, own.device = os.environ["POSTCHAIN"], "software"


def eevee():
    """The engine's name: that of its first version, except in 4.2 to 4.5."""
    return "BLENDER_EEVEE_NEXT" if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"


def emission(material):
    """The socket of the emitted color, with strength 1: Emission before 4, where 1 is the default."""
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Emission Strength"].default_value = 1
    return inputs["Emission Color" if "Emission Color" in inputs else "Emission"]


def shutter_owner(scene):
    """The settings that have motion_blur_position: those of the engine before 4.2."""
    return scene.render if hasattr(scene.render, "motion_blur_position") else scene.cycles


def _mesh(scene, name, corners, faces):
    data = bpy.data.meshes.new(name)
    data.from_pydata(corners, [], faces)
    made = bpy.data.objects.new(name, data)
    scene.collection.objects.link(made)
    return made


def make(folder, size=(64, 36)):
    """A cube that moves to the right before a wall, and a camera that looks along +y and focuses on
    the wall."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    if MODULE not in bpy.context.preferences.addons:
        enable()
    scene = bpy.data.scenes[0]
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    cube = _mesh(scene, "cube", corners, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6),
                                          (0, 2, 6, 4), (1, 5, 7, 3)])
    cube.location = -1, 4, 0
    for frame, x in ((0, -1.0), (5, 1.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    for curve in cube.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    wall = _mesh(scene, "wall", [(-20, 8, -20), (20, 8, -20), (20, 8, 20), (-20, 8, 20)], [(0, 1, 2, 3)])
    glow = bpy.data.materials.new("glow")
    glow.use_nodes = True
    emission(glow).default_value = (1, 0.8, 0.5, 1)
    cube.data.materials.append(glow)
    pattern = bpy.data.materials.new("checker")
    pattern.use_nodes = True
    nodes = pattern.node_tree
    checker = nodes.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 1.5
    nodes.links.new(checker.outputs["Color"], emission(pattern))
    wall.data.materials.append(pattern)
    data = bpy.data.cameras.new("lens")
    data.lens, data.sensor_width = 35, 32
    data.dof.use_dof, data.dof.aperture_fstop = True, 0.05
    data.dof.focus_distance = 8
    camera = bpy.data.objects.new("eye", data)
    camera.rotation_euler = (1.5707963267948966, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.use_motion_blur = True
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = os.path.join(folder, "render", "shot_####")
    scene.postchain.output = os.path.join(folder, "out")
    scene.postchain.preset = "fast"
    return scene
