"""Rain that falls, splashes and drips from an umbrella, seen against lamps, and sparks of a grinder that fly
on arcs; a passer-by walks ahead of the camera."""
from math import radians, sin

import numpy as np

from materials import bricks, checker, lamp, mirrored, mosaic, paint, plain, stripes, veil
from model import Camera, Mesh, moved, Scene, sheets

GRAVITY = 9.81 / 24**2  # meters per frame^2


def camera_pose(t):
    return moved(0.01 * t, 0.035 * t, 0.75 + 0.012 * sin(t / 1.5), (radians(89), 0, radians(0.8 * sin(t / 3))))


def build_drops(name, material, size, places):
    """Octahedra at the places that places(t) -> n x 3 gives; size: across and high, for each."""
    count = len(places(0))
    corners = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
    wide, high = (np.broadcast_to(np.asarray(one, float), count) for one in size)
    span = corners[None] * np.stack([wide, wide, high], 1)[:, None]
    faces = np.array([(i, (i + 1) % 4, 4) for i in range(4)] + [((i + 1) % 4, i, 5) for i in range(4)])
    every = (np.arange(count)[:, None, None] * 6 + faces).reshape(-1, 3)
    sheets(name, every, [material], [0] * len(every), lambda t: (places(t)[:, None] + span).reshape(-1, 3))


def build_rain():
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
    build_drops("rain", veil("water", (1.0, 1.1, 1.25), 0.6), (wide, 2.2 * wide), places)


def build_splashes():
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
    build_drops("splashes", veil("spray", (0.8, 0.85, 0.95), 0.7), (0.002, 0.002), places)


def build_sparks():
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
        build_drops(f"sparks{i}", lamp(f"spark{i}", color, strength), (0.0028, 0.0028), lambda t, i=i: places(t)[i::2])


def build_walker():
    coat = paint("coat", stripes(9, (0.15, 0.2, 0.4), (0.2, 0.28, 0.5), "X"))
    cloth = paint("cloth", checker(5, (0.75, 0.12, 0.1), (0.85, 0.8, 0.7)), 0.1)
    dark = paint("dark", plain((0.04, 0.04, 0.05)))
    skin = paint("skin", plain((0.75, 0.5, 0.36)))

    def walk(t):
        return moved(-0.32 + 0.012 * t, 2.35 + 0.04 * t, 0.012 * sin(1.2 * t), (0, 0.03 * sin(0.6 * t), 0.2))
    made = Mesh("walker")
    made.rod((0, 0, 0.38), (0, 0, 0.95), 0.16, coat, 0.09, 32)
    made.ball((0, 0, 1.07), 0.09, skin)
    made.limb((0.09, -0.02, 0.88), (0.16, -0.08, 0.7), 0.035, coat)
    made.limb((0.16, -0.08, 0.7), (0.1, -0.12, 0.9), 0.03, coat)
    made.rod((0.1, -0.12, 0.8), (0.06, -0.06, 1.42), 0.008, dark)
    made.finish(walk)
    umbrella = Mesh("umbrella")
    umbrella.rod((0, 0, 0), (0, 0, 0.2), 0.42, cloth, 0.02, 8)
    umbrella.finish(lambda t: walk(t) @ moved(0.06, -0.06, 1.2, (0.1, -0.1, 0.09 * t)))
    for side in (-1, 1):
        leg = Mesh(f"leg{side}")
        leg.limb((0, 0, 0), (0, 0, -0.36), 0.045, dark)
        leg.box((0, 0.05, -0.4), (0.07, 0.18, 0.05), dark)
        leg.finish(lambda t, side=side: walk(t) @ moved(0.06 * side, 0, 0.42, (0.5 * side * sin(0.6 * t), 0, 0)))


def build_street():
    stones = mirrored(paint("stones",
                            mosaic(6, [(0.12, 0.12, 0.14), (0.17, 0.16, 0.16), (0.1, 0.11, 0.13), (0.2, 0.19, 0.18)])),
                      0.7, 0.02)
    wall = paint("wall", bricks(3, (0.3, 0.15, 0.11), (0.24, 0.14, 0.11), (0.2, 0.19, 0.17)))
    iron = paint("iron", plain((0.05, 0.05, 0.06)), 0.2)
    shop = [lamp(f"shop{i}", color, strength)
            for i, (color, strength) in enumerate([((1.0, 0.72, 0.4), 1.3), ((0.6, 0.8, 1.0), 0.9),
                                                   ((1.0, 0.45, 0.35), 1.0)])]
    bulbs = [lamp("amber", (1.0, 0.65, 0.3), 26), lamp("white", (0.85, 0.92, 1.0), 26)]
    made = Mesh("street")
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


SCENE = Scene(camera=Camera(camera_pose, lambda frame: 2.15 + 0.005 * (frame - 11), focal_length_mm=45.0, f_stop=1.2),
              sky=[(0.0, (0.05, 0.05, 0.06)), (0.5, (0.16, 0.18, 0.24)), (1.0, (0.05, 0.06, 0.1))],
              sun=((-0.4, 0.5, -0.8), 1.6),
              parts=[build_street, build_walker, build_rain, build_splashes, build_sparks], bounces=1)
