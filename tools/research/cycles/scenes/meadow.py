"""Grass in gusts of wind close to the lens, and a head with long hair that turns and nods; the camera
slides sideways."""
from math import pi, radians, sin

import numpy as np

from materials import mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene, sheets

BLADES = 7000
HAIRS = 5000


def camera_pose(t):
    return moved(-0.3 + 0.024 * t, 0, 0.2 + 0.004 * sin(t / 1.5), (radians(91), 0, radians(3 - 0.25 * t)))


def strips(count, points):
    """Faces of `count` strips of 2 x points vertices."""
    first = np.arange(count)[:, None] * 2 * points + np.arange(points - 1)[None] * 2
    return np.stack([first, first + 1, first + 3, first + 2], -1).reshape(-1, 4)


def ribbon(line, side):
    """Vertices of strips along lines (count x points x 3); side: half the width, as vectors."""
    return np.stack([line - side, line + side], 2).reshape(-1, 3)


def build_grass():
    pick = np.random.default_rng(11)
    points = 6
    y = 0.7 + 4.0 * pick.random(BLADES) ** 1.6
    x = (pick.random(BLADES) - 0.5) * (1.0 + 1.0 * y)
    tall = pick.uniform(0.1, 0.26, BLADES)
    lean = pick.normal(0, 0.35, BLADES)
    depth = pick.normal(0, 0.2, BLADES)
    wide = pick.uniform(0.0012, 0.003, BLADES)
    own = pick.uniform(0, 2 * pi, BLADES)
    up = np.linspace(0, 1, points)
    thin = (1 - up**2 * 0.9)

    def shape(t):
        gust = 0.4 * np.sin(3.1 * x + 1.3 * y - 0.6 * t) + 0.15 * np.sin(own + 1.9 * t)
        bend = (lean + gust)[:, None] * up
        line = np.stack([x[:, None] + tall[:, None] * up * np.sin(bend), y[:, None] + (tall * depth)[:, None] * up**2,
                         tall[:, None] * up * np.cos(bend)], -1)
        side = np.zeros_like(line)
        side[..., 0] = wide[:, None] * thin * np.cos(own)[:, None]
        side[..., 1] = wide[:, None] * thin * np.sin(own)[:, None]
        return ribbon(line, side)

    greens = [paint(f"grass{i}", plain(color), 0.06, 0.45)
              for i, color in enumerate([(0.12, 0.32, 0.05), (0.25, 0.45, 0.09), (0.45, 0.48, 0.14),
                                         (0.62, 0.5, 0.22)])]
    slots = np.repeat(pick.choice(4, BLADES, p=[0.35, 0.35, 0.2, 0.1]), points - 1)
    sheets("grass", strips(BLADES, points), greens, slots, shape)


def head_pose(t):
    return moved(0.12 + 0.03 * sin(t / 2), 1.5, 0.24 + 0.02 * sin(t / 1.3),
                 (0.12 * sin(t / 1.4), 0, -0.55 + 0.6 * sin(t / 2.4)))


def build_head():
    """Hairs hang from the crown and lag behind the turn of the head by up to three frames."""
    pick = np.random.default_rng(5)
    points = 8
    skin = paint("skin", plain((0.8, 0.56, 0.42)), 0.06)
    scarf = paint("scarf", stripes(30, (0.7, 0.1, 0.12), (0.9, 0.85, 0.7), "Z"))
    dark = paint("dark", plain((0.03, 0.02, 0.02)), 0.1)
    made = Mesh("head")
    made.ball((0, 0, 0), 0.1, skin, (0.85, 0.95, 1.12))
    made.rod((0, 0, -0.2), (0, 0, -0.07), 0.04, skin)
    made.rod((0, 0, -0.2), (0, 0, -0.11), 0.1, scarf, 0.06, 32)
    for x in (-0.034, 0.034):
        made.ball((x, -0.087, 0.015), 0.012, dark, segments=16)
    made.ball((0, -0.1, -0.015), 0.016, skin, segments=16)
    made.finish(head_pose)

    around = pick.uniform(0.12 * 2 * pi, 0.88 * 2 * pi, HAIRS) - pi / 2  # not over the face
    high = pick.uniform(0.1, 0.5 * pi, HAIRS)
    root = np.stack([0.088 * np.cos(around) * np.cos(high), 0.098 * np.sin(around) * np.cos(high),
                     0.114 * np.sin(high)], -1)
    out = np.stack([np.cos(around), np.sin(around), np.zeros(HAIRS)], -1)
    long = pick.uniform(0.12, 0.22, HAIRS)
    curl = pick.normal(0, 0.008, (HAIRS, 2))
    along = np.linspace(0, 1, points)
    rest = (root[:, None] * (1 + 0.06 * along[None, :, None])
            + out[:, None] * (0.045 * np.sin(along * pi / 2))[None, :, None])
    rest[..., 2] -= long[:, None] * along**1.3
    rest[..., 0] += curl[:, :1] * np.sin(9 * along)
    rest[..., 1] += curl[:, 1:] * np.sin(7 * along)

    def shape(t):
        line = np.empty_like(rest)
        for i, share in enumerate(along):
            turn = np.array(head_pose(t - 3 * share**1.5))
            line[:, i] = rest[:, i] @ turn[:3, :3].T + turn[:3, 3]
        side = np.zeros_like(line)
        side[..., 0] = 0.0005
        return ribbon(line, side)

    colors = [paint(f"hair{i}", plain(color), 0.12, 0.35)
              for i, color in enumerate([(0.32, 0.13, 0.05), (0.5, 0.24, 0.08), (0.18, 0.07, 0.03)])]
    slots = np.repeat(pick.integers(0, 3, HAIRS), points - 1)
    sheets("hair", strips(HAIRS, points), colors, slots, shape)


def build_ground():
    soil = paint("soil", mosaic(14, [(0.14, 0.2, 0.06), (0.2, 0.27, 0.08), (0.24, 0.2, 0.1), (0.1, 0.15, 0.05)]))
    trees = paint("trees", mosaic(5, [(0.07, 0.17, 0.06), (0.12, 0.26, 0.08), (0.22, 0.3, 0.1), (0.05, 0.12, 0.07)]))
    made = Mesh("ground")
    made.box((0, 6, -0.02), (30, 14, 0.04), soil)
    for i in range(14):
        made.ball((-6.5 + i, 8 + 0.5 * sin(5 * i), 0.2), 0.8 + 0.3 * sin(3 * i), trees)
    made.finish()


SCENE = Scene(camera=Camera(camera_pose, focus=1.42, focal_length_mm=50.0, f_stop=1.4),
              sky=[(0.0, (0.3, 0.3, 0.25)), (0.5, (1.6, 1.4, 1.1)), (0.6, (0.5, 0.75, 1.2)), (1.0, (0.2, 0.4, 0.9))],
              sun=((0.6, 0.45, -0.7), 4.5),
              parts=[build_grass, build_head, build_ground])
