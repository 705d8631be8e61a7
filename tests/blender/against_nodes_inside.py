"""Runs inside Blender for against_nodes.py: OUT FRAME filter CHAIN... | nodes."""
import itertools
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import node_blur  # noqa: E402
import scene as scenes  # noqa: E402

OUT, FRAME, WHAT, *CHAINS = sys.argv[sys.argv.index("--") + 1:]


def render_and_filter(scene):
    """The steps of a user: Prepare, render, Filter; then the ground truth."""
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
    blur = node_blur.NodeBlur(scene, os.path.join(OUT, "render", f"shot_{int(FRAME):04d}.exr"))
    for order, factor, curved, stop in itertools.product(
            node_blur.ORDERS, node_blur.FACTORS, (False, True), node_blur.STOPS):
        blur.render(os.path.join(OUT, "nodes", f"{order} factor {factor} "
                                 f"{'curved' if curved else 'straight'} stop {stop}.exr"),
                    order, factor, curved, stop)


(nodes if WHAT == "nodes" else render_and_filter)(bpy.context.scene)
