"""Leaves on a swaying twig before a waving arm, a turning windmill, fur, a crate that comes in at the
picture's border and bulbs half behind leaves. With --transparent the sky is not there.

blender -b -P tests/cycles/garden.py -- OUT   (docs/scenes.md)
"""
import os
import random
import sys
from math import cos, pi, radians, sin

from mathutils import Euler, Matrix, Vector

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import model  # noqa: E402
import renderer  # noqa: E402

CAMERA = Matrix.Translation((0, 0, 0.4)) @ Euler((radians(90), 0, 0)).to_matrix().to_4x4()
FOCUS = 1.9


def leaf(made, base, along, width, material):
    """A flat leaf of ten corners from `base`, facing the camera."""
    along = Vector(along)
    side = along.cross(Vector((0, 1, 0.2))).normalized() * width
    base = Vector(base)
    shape = [(0, 0), (0.2, 0.7), (0.45, 1), (0.7, 0.8), (0.9, 0.35), (1, 0)]
    left = [base + along * u + side * v for u, v in shape]
    right = [base + along * u - side * v for u, v in shape[-2:0:-1]]
    made.face(left + right, material)


def build_twig(name, pose, seed, material, bark, frames):
    pick = random.Random(seed)
    made = model.Mesh(name)
    made.rod((-0.3, 0, 0.0), (0.3, 0, 0.05), 0.003, bark, segments=8)
    for i in range(15):
        x = -0.28 + 0.04 * i
        angle = pick.uniform(-0.9, 0.9) + (pi if i % 2 else 0)
        length = pick.uniform(0.05, 0.085)
        leaf(made, (x, pick.uniform(-0.01, 0.01), 0.025 + 0.08 * x),
             (length * sin(angle), 0, length * cos(angle)), length * 0.3, material)
    model.animate(made.finish(), pose, frames)


def build_arm(frames):
    sleeve = model.paint("sleeve", model.stripes(26, (0.75, 0.16, 0.12), (0.9, 0.8, 0.55), "Z"))
    skin = model.paint("skin", model.plain((0.75, 0.5, 0.36)), 0.06)

    def upper(t):
        return model.moved(-0.12 + 0.012 * t, FOCUS, 0.22, (0, -0.5 + 0.35 * sin(t / 2.2), 0))

    def lower(t):
        return upper(t) @ model.moved(0, 0, 0.2, (0, 0.8 * sin(t / 1.8 + 1), 0))
    made = model.Mesh("upper_arm")
    made.limb((0, 0, 0), (0, 0, 0.2), 0.045, sleeve)
    model.animate(made.finish(), upper, frames)
    made = model.Mesh("lower_arm")
    made.limb((0, 0, 0), (0, 0, 0.17), 0.035, skin)
    made.ball((0, 0, 0.22), 0.045, skin, (0.8, 0.6, 1.2))
    model.animate(made.finish(), lower, frames)


def build_windmill(frames):
    """Blades with fine stripes across; 14 degrees a frame."""
    stripes = model.paint("blades", model.stripes(45, (0.9, 0.88, 0.8), (0.1, 0.2, 0.5), "X"))
    post = model.paint("post", model.plain((0.3, 0.2, 0.12), 30))
    made = model.Mesh("windmill")
    for i in range(6):
        turn = Matrix.Rotation(i * pi / 3, 3, "Y")
        made.box(turn @ Vector((0.09, 0, 0)), (0.15, 0.004, 0.022), stripes, turn)
    made.ball((0, -0.01, 0), 0.016, post)
    model.animate(made.finish(), lambda t: model.moved(0.5, 2.1, 0.5, (0, radians(14) * t, 0)), frames)
    still = model.Mesh("post")
    still.rod((0.5, 2.12, -0.3), (0.5, 2.12, 0.5), 0.008, post)
    still.finish()


def build_fur(frames):
    """A ball with combed hair that rolls."""
    pick = random.Random(5)
    coat = model.paint("coat", model.plain((0.35, 0.2, 0.1), 40))
    tips = model.paint("tips", model.plain((0.8, 0.65, 0.4)))
    made = model.Mesh("fur")
    made.ball((0, 0, 0), 0.1, coat)
    for _ in range(1500):
        way = Vector((pick.gauss(0, 1), pick.gauss(0, 1), pick.gauss(0, 1))).normalized()
        made.rod(way * 0.095, way * 0.125 + Vector((0.012, 0, -0.01)), 0.0012,
                 tips if pick.random() < 0.5 else coat, 0.0003, segments=3)
    model.animate(made.finish(),
                  lambda t: model.moved(-0.62 + 0.02 * t, 1.7, 0.18, (0, 0.12 * t, 0)), frames)


def build_crate(frames):
    """Comes in from the left, 0.035 m a frame, close to the camera."""
    wood = model.paint("wood", model.bricks(9, (0.5, 0.33, 0.18), (0.42, 0.26, 0.13),
                                            (0.08, 0.05, 0.03)))
    made = model.Mesh("crate")
    made.box((0, 0, 0), (0.24, 0.2, 0.2), wood)
    model.animate(made.finish(), lambda t: model.moved(-0.67 + 0.035 * t, 1.3, 0.54, (0, 0.02 * t, 0.1)),
                  frames)


def build_bulbs():
    warm = model.lamp("warm", (1.0, 0.7, 0.35), 30)
    wire = model.paint("wire", model.plain((0.1, 0.1, 0.1)))
    made = model.Mesh("bulbs")
    points = [Vector((-0.9 + 0.2 * i, 2.8, 0.62 + 0.1 * ((i - 4.5) / 4.5) ** 2)) for i in range(10)]
    for start, end in zip(points, points[1:]):
        made.rod(start, end, 0.002, wire, segments=6)
    for point in points:
        made.ball(point - Vector((0, 0, 0.02)), 0.014, warm, segments=16)
    made.finish()


def build_ground():
    hedge = model.paint("hedge", model.mosaic(16, [(0.1, 0.25, 0.08), (0.16, 0.35, 0.1),
                                                   (0.08, 0.18, 0.07), (0.22, 0.4, 0.16)]))
    lawn = model.paint("lawn", model.checker(9, (0.16, 0.3, 0.09), (0.12, 0.24, 0.07)))
    made = model.Mesh("ground")
    made.box((0, 3.6, 0.1), (5, 0.1, 0.5), hedge)
    made.box((0, 2.4, -0.15), (5, 4.8, 0.02), lawn)
    made.finish()


def main():
    options = renderer.script_options(__doc__.split("\n\n", maxsplit=1)[0])
    frames = options.frames
    renderer.empty_scene()
    model.sky([(0.0, (0.2, 0.2, 0.2)), (0.5, (0.75, 0.8, 0.9)), (1.0, (0.2, 0.4, 0.8))])
    model.sun((0.4, 0.9, -0.7), 3.5)
    green = model.paint("leaf", model.plain((0.18, 0.42, 0.1), 60))
    bark = model.paint("bark", model.plain((0.2, 0.13, 0.08)))
    build_twig("near_twig", lambda t: model.moved(0.05 + 0.022 * t - 0.14, 0.9, 0.44,
                                            (0, 0.25 * sin(t / 2), 0)), 3, green, bark, frames)
    build_twig("far_twig", lambda t: model.moved(0.35 - 0.014 * t, 1.5, 0.6,
                                           (0, 0.6 + 0.2 * sin(t / 1.7), 0)), 8, green, bark, frames)
    build_arm(frames)
    build_windmill(frames)
    build_fur(frames)
    build_crate(frames)
    build_bulbs()
    if not options.transparent:
        build_ground()
    view = renderer.View(lambda t: CAMERA, lambda frame: FOCUS, focal_length_mm=45.0, f_stop=1.2)
    renderer.render_scene("garden", view, options)


main()
