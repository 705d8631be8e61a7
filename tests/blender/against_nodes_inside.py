"""Runs inside Blender for against_nodes.py: OUT FRAME filter CHAIN... | nodes."""
import itertools
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene as scenes  # noqa: E402

OUT, FRAME, WHAT, *CHAINS = sys.argv[sys.argv.index("--") + 1:]


def render_and_filter(scene):
    """What a user does: Prepare, render, Filter; then the ground truth."""
    scenes.install()
    addon = sys.modules[scenes.MODULE]
    scene.render.filepath = os.path.join(OUT, "render", "shot_####")
    scene.render.use_file_extension = True
    bpy.ops.postchain.prepare()
    bpy.ops.render.render(animation=True)
    for chain in CHAINS:
        scene.postchain.preset, scene.postchain.output = chain, os.path.join(OUT, chain)
        bpy.ops.postchain.filter()
    bpy.ops.postchain.put_back()
    addon.compare.set_truth(scene, 256, lens=True, motion=True)
    scene.frame_set(int(FRAME))
    image = scene.render.image_settings
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"
    scene.render.filepath = os.path.join(OUT, "truth.exr")
    bpy.ops.render.render(write_still=True)


def nodes(scene):
    """The frame through Blender's nodes, in both orders and with every setting that changes them."""
    scene.frame_set(int(FRAME))
    scene.use_nodes = scene.render.use_compositing = True
    tree = scene.node_tree
    tree.nodes.clear()
    source = tree.nodes.new("CompositorNodeImage")
    source.image = bpy.data.images.load(os.path.join(OUT, "render", f"shot_{int(FRAME):04d}.exr"))
    blur = tree.nodes.new("CompositorNodeVecBlur")
    blur.samples, blur.speed_max = 128, 0
    defocus = tree.nodes.new("CompositorNodeDefocus")
    defocus.use_zbuffer, defocus.use_preview, defocus.scene = True, False, scene
    defocus.threshold, defocus.blur_max = 1, 100
    dof = scene.camera.data.dof
    defocus.bokeh = "HEXAGON" if dof.aperture_blades == 6 else "CIRCLE"
    defocus.angle = dof.aperture_rotation
    result = tree.nodes.new("CompositorNodeComposite")
    for node in (blur, defocus):
        tree.links.new(source.outputs["Depth"], node.inputs["Z"])
    tree.links.new(source.outputs["Vector"], blur.inputs["Speed"])
    image = scene.render.image_settings
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"
    # The node takes the camera's width for a meter: with this stop it is a thin lens.
    thin_lens = dof.aperture_fstop * 1000 / scene.camera.data.sensor_width
    for order, factor, curved, stop in itertools.product(
            ("lens_motion", "motion_lens"), (0.35, 0.5, 0.6, 0.7, 0.85, 1), (False, True),
            (0.7, 0.85, 1, 1.2, 1.4)):
        blur.factor, blur.use_curved, defocus.f_stop = factor, curved, thin_lens * stop
        first, second = (defocus, blur) if order == "lens_motion" else (blur, defocus)
        tree.links.new(source.outputs["Combined"], first.inputs["Image"])
        tree.links.new(first.outputs["Image"], second.inputs["Image"])
        tree.links.new(second.outputs["Image"], result.inputs["Image"])
        scene.render.filepath = os.path.join(
            OUT, "nodes", f"{order} factor {factor} {'curved' if curved else 'straight'} stop {stop}.exr")
        bpy.ops.render.render(write_still=True)


(nodes if WHAT == "nodes" else render_and_filter)(bpy.context.scene)
