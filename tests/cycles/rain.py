"""Rain that falls, splashes and drips from an umbrella, seen against lamps, and sparks of a grinder that fly
on arcs; a passer-by walks ahead of the camera.

blender -b -P tests/cycles/rain.py -- OUT   (docs/dataset.md)
"""
import os
import sys
from math import cos, pi, radians, sin

import numpy as np
from mathutils import Euler, Matrix

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import model  # noqa: E402
import renderer  # noqa: E402

GRAVITY = 9.81 / 24**2  # meters per frame^2


def camera_pose(t):
    return (Matrix.Translation((0.01 * t, 0.035 * t, 0.75 + 0.012 * sin(t / 1.5)))
            @ Euler((radians(89), 0, radians(0.8 * sin(t / 3)))).to_matrix().to_4x4())


def drops(name, material, size, places):
    """Octahedra at the places that places(t) -> n x 3 gives; size: across and high, for each."""
    def build(frames):
        count = len(places(frames[0]))
        corners = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
        wide, high = (np.broadcast_to(np.asarray(one, float), count) for one in size)
        span = corners[None] * np.stack([wide, wide, high], 1)[:, None]
        faces = np.array([(i, (i + 1) % 4, 4) for i in range(4)] + [((i + 1) % 4, i, 5) for i in range(4)])
        every = (np.arange(count)[:, None, None] * 6 + faces).reshape(-1, 3)
        made = model.sheets(name, every, [material], [0] * len(every))
        model.deform(made, lambda t: (places(t)[:, None] + span).reshape(-1, 3), frames)
    return build


def build_rain(frames):
    pick = np.random.default_rng(2)
    count = 2600
    y = 0.95 + 5 * pick.random(count)
    x = (pick.random(count) - 0.5) * (0.5 + 0.85 * y)
    # 2 to 3 m/s: slower than real rain, so that it is within the picture in all frames.
    fall = pick.uniform(0.085, 0.125, count)
    z = pick.uniform(-0.2, 3.0, count) + fall * 11

    def places(t):
        return np.stack([x + 0.012 * t, y, z - fall * t], 1)
    wide = pick.uniform(0.0015, 0.0035, count)
    drops("rain", model.veil("water", (1.0, 1.1, 1.25), 0.6), (wide, 2.2 * wide), places)(frames)


def build_splashes(frames):
    pick = np.random.default_rng(4)
    count = 900
    y = 1.0 + 3.5 * pick.random(count)
    x = (pick.random(count) - 0.5) * 0.9 * y
    start = pick.uniform(6, 14, count)  # the frame of the impact
    way = pick.normal(0, 0.012, (count, 2))
    rise = pick.uniform(0.03, 0.06, count)

    def places(t):
        u = t - start
        z = np.where(u > 0, rise * u - 0.5 * GRAVITY * u * u, -0.05)
        return np.stack([x + way[:, 0] * u, y + way[:, 1] * u, np.maximum(z, -0.05)], 1)
    drops("splashes", model.veil("spray", (0.8, 0.85, 0.95), 0.7), (0.002, 0.002), places)(frames)


def build_sparks(frames):
    """From a grinder on the right; none has hit the ground before frame 16."""
    pick = np.random.default_rng(7)
    count = 420
    born = pick.uniform(2, 14, count)
    angle = pick.normal(2.6, 0.35, count)
    speed = pick.uniform(0.04, 0.12, count)
    deep = pick.normal(0, 0.02, count)

    def places(t):
        u = np.maximum(t - born, 0)
        return np.stack([0.62 + speed * np.cos(angle) * u, 2.25 + deep * u,
                         0.72 + speed * np.sin(angle) * u - 0.5 * GRAVITY * u * u], 1)
    for i, (color, strength) in enumerate([((1.0, 0.55, 0.15), 45), ((1.0, 0.8, 0.45), 80)]):
        drops(f"sparks{i}", model.lamp(f"spark{i}", color, strength), (0.0028, 0.0028),
              lambda t, i=i: places(t)[i::2])(frames)


def build_walker(frames):
    coat = model.paint("coat", model.stripes(9, (0.15, 0.2, 0.4), (0.2, 0.28, 0.5), "X"))
    cloth = model.paint("cloth", model.checker(5, (0.75, 0.12, 0.1), (0.85, 0.8, 0.7)), 0.1)
    dark = model.paint("dark", model.plain((0.04, 0.04, 0.05)))
    skin = model.paint("skin", model.plain((0.75, 0.5, 0.36)))

    def walk(t):
        return model.moved(-0.32 + 0.012 * t, 2.35 + 0.04 * t, 0.012 * sin(1.2 * t), (0, 0.03 * sin(0.6 * t), 0.2))
    made = model.Mesh("walker")
    made.rod((0, 0, 0.38), (0, 0, 0.95), 0.16, coat, 0.09, 32)
    made.ball((0, 0, 1.07), 0.09, skin)
    made.limb((0.09, -0.02, 0.88), (0.16, -0.08, 0.7), 0.035, coat)
    made.limb((0.16, -0.08, 0.7), (0.1, -0.12, 0.9), 0.03, coat)
    made.rod((0.1, -0.12, 0.8), (0.06, -0.06, 1.42), 0.008, dark)
    model.animate(made.finish(), walk, frames)
    umbrella = model.Mesh("umbrella")
    umbrella.rod((0, 0, 0), (0, 0, 0.2), 0.42, cloth, 0.02, 8)
    model.animate(umbrella.finish(), lambda t: walk(t) @ model.moved(0.06, -0.06, 1.2, (0.1, -0.1, 0.09 * t)),
                  frames)
    for side in (-1, 1):
        leg = model.Mesh(f"leg{side}")
        leg.limb((0, 0, 0), (0, 0, -0.36), 0.045, dark)
        leg.box((0, 0.05, -0.4), (0.07, 0.18, 0.05), dark)
        model.animate(leg.finish(), lambda t, side=side: walk(t) @ model.moved(
            0.06 * side, 0, 0.42, (0.5 * side * sin(0.6 * t), 0, 0)), frames)


def build_street():
    stones = model.mirrored(model.paint("stones", model.mosaic(6, [(0.12, 0.12, 0.14), (0.17, 0.16, 0.16),
                                                                   (0.1, 0.11, 0.13), (0.2, 0.19, 0.18)])),
                            0.7, 0.02)
    wall = model.paint("wall", model.bricks(3, (0.3, 0.15, 0.11), (0.24, 0.14, 0.11), (0.2, 0.19, 0.17)))
    iron = model.paint("iron", model.plain((0.05, 0.05, 0.06)), 0.2)
    shop = [model.lamp(f"shop{i}", color, strength) for i, (color, strength) in enumerate(
        [((1.0, 0.72, 0.4), 1.3), ((0.6, 0.8, 1.0), 0.9), ((1.0, 0.45, 0.35), 1.0)])]
    bulbs = [model.lamp("amber", (1.0, 0.65, 0.3), 26), model.lamp("white", (0.85, 0.92, 1.0), 26)]
    made = model.Mesh("street")
    made.box((0, 6, -0.03), (16, 16, 0.06), stones)
    made.box((0, 8, 2), (16, 0.3, 4.4), wall)
    for i in range(9):
        made.box((-4.4 + 1.1 * i, 7.82, 0.85), (0.8, 0.05, 1.1), shop[i % 3])
        made.box((-4.4 + 1.1 * i, 7.78, 1.6), (1.0, 0.3, 0.08), iron)
        made.box((-4.4 + 1.1 * i, 7.79, 0.85), (0.04, 0.05, 1.1), iron)
    for i in range(14):
        made.ball((-3.2 + 0.5 * i, 5.2, 1.55 + 0.12 * sin(2 * i)), 0.025, bulbs[i % 2], segments=16)
    for x, y in ((-1.0, 3.2), (1.25, 3.9), (-1.9, 5.0)):
        made.rod((x, y, 0), (x, y, 1.7), 0.03, iron)
        made.ball((x, y, 1.75), 0.08, bulbs[0], segments=24)
    made.box((0.75, 2.3, 0.35), (0.2, 0.3, 0.7), iron)  # the grinder
    made.rod((0.64, 2.15, 0.72), (0.64, 2.35, 0.72), 0.07, iron, segments=24)
    made.finish(reflected=True)


def main():
    options = renderer.script_options(__doc__.split("\n\n", maxsplit=1)[0])
    renderer.empty_scene()
    model.sky([(0.0, (0.05, 0.05, 0.06)), (0.5, (0.16, 0.18, 0.24)), (1.0, (0.05, 0.06, 0.1))])
    model.sun((-0.4, 0.5, -0.8), 1.6)
    build_street()
    build_walker(options.frames)
    build_rain(options.frames)
    build_splashes(options.frames)
    build_sparks(options.frames)
    view = renderer.View(camera_pose, lambda frame: 2.15 + 0.005 * (frame - 11), focal_length_mm=45.0, f_stop=1.2)
    renderer.render_scene("rain", view, options, bounces=1)


main()
