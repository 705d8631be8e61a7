"""A still brick wall and a lens that zooms: what Cycles' motion vectors leave out. For tests only.

blender -b -P tests/cycles/zoom.py -- OUT
"""
import os
import sys
from math import radians

from mathutils import Euler

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import model  # noqa: E402
import renderer  # noqa: E402


def main():
    options = renderer.script_options(__doc__.split("\n\n", maxsplit=1)[0])
    renderer.empty_scene()
    model.sun((0.3, 0.8, -0.5), 4)
    wall = model.Mesh("wall")
    wall.box((0, 4.1, 0), (12, 0.2, 8), model.paint("wall", model.bricks(
        3, (0.8, 0.2, 0.1), (0.3, 0.2, 0.6), (0.9, 0.9, 0.8), "xz")))
    wall.finish()
    pose = Euler((radians(90), 0, 0)).to_matrix().to_4x4()
    view = renderer.View(lambda t: pose, lambda frame: 4, focal_length_mm=lambda t: 30 * 1.25**(t - 11),
                         f_stop=8)
    renderer.render_scene("zoom", view, options)


main()
