"""A still brick wall and a lens that zooms: what Cycles' motion vectors leave out. For tests only."""
from math import radians

from materials import bricks, paint
from model import Camera, Mesh, moved, Scene

CAMERA = moved(0, 0, 0, (radians(90), 0, 0))


def build_wall():
    wall = Mesh("wall")
    wall.box((0, 4.1, 0), (12, 0.2, 8),
             paint("wall", bricks(3, (0.8, 0.2, 0.1), (0.3, 0.2, 0.6), (0.9, 0.9, 0.8), "xz")))
    wall.finish()


SCENE = Scene(camera=Camera(lambda t: CAMERA, focus=4, focal_length_mm=lambda t: 30 * 1.25**(t - 11), f_stop=8),
              sun=((0.3, 0.8, -0.5), 4), parts=[build_wall])
