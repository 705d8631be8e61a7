"""Architecture through a long lens: window after window of a far front, towers behind it, a tram and flags
that cross, railings and a lantern out of focus in front; the camera pans slowly on a tripod."""
import random
from math import radians, sin

import numpy as np
from mathutils import Matrix

from materials import bricks, checker, lamp, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene


def camera_pose(t):
    return moved(0, 0, 5.0, (radians(90 + 0.02 * sin(t)), 0, radians(-0.27 * (t - 11))))


def build_front():
    pick = random.Random(8)
    stone = paint("stone", bricks(0.9, (0.62, 0.55, 0.42), (0.56, 0.49, 0.38), (0.4, 0.36, 0.3)))
    trim = paint("trim", plain((0.75, 0.7, 0.6), 3))
    pane = [paint(f"pane{i}", plain(color), 0.1, 0.4)
            for i, color in enumerate([(0.08, 0.12, 0.18), (0.16, 0.2, 0.26), (0.5, 0.42, 0.25)])]
    roof = paint("roof", stripes(1.4, (0.35, 0.16, 0.1), (0.25, 0.11, 0.08), "X"))
    shade = paint("shade", stripes(2.5, (0.75, 0.2, 0.15), (0.9, 0.85, 0.75), "X"))
    made = Mesh("front")
    made.box((0, 62, 7), (60, 2, 16), stone)
    made.box((0, 62, 15.4), (60, 3.4, 0.9), roof)
    for floor in range(5):
        z = 1.2 + 3.0 * floor
        made.box((0, 60.9, z - 1.35), (60, 0.3, 0.22), trim)
        for i in range(44):
            x = -28.4 + 1.32 * i
            made.box((x, 60.95, z + 0.1), (0.8, 0.1, 1.7), pick.choice(pane))
            for side in (-1, 1):
                made.box((x + 0.46 * side, 60.85, z + 0.1), (0.1, 0.3, 1.9), trim)
            made.box((x, 60.85, z + 1.08), (1.1, 0.4, 0.16), trim)
            made.box((x, 60.88, z + 0.1), (0.05, 0.08, 1.7), trim)
            for k in range(3):
                made.box((x, 60.88, z - 0.4 + 0.45 * k), (0.8, 0.08, 0.04), trim)
            if (i + 2 * floor) % 5 == 0:
                made.box((x, 60.3, z + 0.95), (1.2, 1.2, 0.06), shade, Matrix.Rotation(0.5, 3, "X"))
            if (3 * i + floor) % 7 == 0:  # a balcony
                made.box((x, 60.4, z - 0.85), (1.3, 1.0, 0.08), trim)
                for k in range(9):
                    made.rod((x - 0.6 + 0.15 * k, 59.95, z - 0.8), (x - 0.6 + 0.15 * k, 59.95, z - 0.05), 0.015,
                             pane[0], segments=6)
                made.rod((x - 0.62, 59.95, z - 0.05), (x + 0.62, 59.95, z - 0.05), 0.025, pane[0], segments=6)
    for i in range(7):  # towers far behind
        x = -40 + 13 * i + 3 * sin(5 * i)
        made.box((x, 150, 14), (7, 7, 34 + 6 * sin(3 * i)), stone)
        for k in range(12):
            made.box((x, 146.4, 2.6 * k), (6, 0.2, 0.7), pane[k % 2])
    made.finish()


def build_square():
    paving = paint("paving", checker(0.7, (0.5, 0.48, 0.44), (0.42, 0.4, 0.37)))
    iron = paint("iron", plain((0.05, 0.06, 0.06)), 0.15)
    gold = lamp("gold", (1.0, 0.75, 0.4), 12)
    green = paint("green", mosaic(2.5, [(0.1, 0.25, 0.07), (0.16, 0.35, 0.1), (0.07, 0.17, 0.06)]))
    made = Mesh("square")
    made.box((0, 60, -1.05), (120, 200, 0.1), paving)
    for i in range(24):  # a railing of a balcony close by
        made.rod((-1.6 + 0.14 * i, 13, 3.7), (-1.6 + 0.14 * i, 13, 4.45), 0.012, iron)
    made.rod((-3, 13, 4.45), (3, 13, 4.45), 0.02, iron)
    for i in range(8):
        x = -13 + 4 * i
        made.rod((x, 48, -1), (x, 48, 5.2), 0.07, iron)
        made.ball((x, 48, 5.4), 0.22, gold, segments=24)
        made.ball((x + 2, 52, 1.4), 1.0, green, (1, 1, 1.3), 24)
        made.rod((x + 2, 52, -1), (x + 2, 52, 1), 0.12, iron)
    for i in range(5):  # wires of the tram
        made.rod((-30, 44 + 0.4 * i, 6.5 + 0.25 * i), (30, 44 + 0.4 * i, 6.7 + 0.2 * i), 0.012, iron, segments=6)
    made.finish()


def build_tram():
    red = paint("red", stripes(0.5, (0.75, 0.1, 0.08), (0.9, 0.85, 0.75), "Z"), 0.06)
    dark = paint("dark", plain((0.05, 0.07, 0.1)), 0.1, 0.4)
    lit = lamp("lit", (1.0, 0.95, 0.85), 18)
    made = Mesh("tram")
    made.box((0, 0, 2.6), (9, 2.2, 3.0), red)
    made.box((0, 0, 4.2), (8.6, 1.9, 0.3), dark)
    for i in range(8):
        made.box((-3.9 + 1.1 * i, -1.12, 3.1), (0.85, 0.04, 1.2), dark)
    for x in (-4.3, 4.3):
        made.ball((x, -1.0, 1.8), 0.14, lit, segments=16)
    made.rod((0, 0, 4.3), (1.6, 0, 6.4), 0.04, dark)
    made.finish(lambda t: moved(-4.2 + 0.42 * (t - 11), 43, -0.6))
    pigeon = paint("pigeon", plain((0.3, 0.3, 0.34)))
    for i in range(14):
        body = Mesh(f"pigeon{i}")
        body.ball((0, 0, 0), 0.09, pigeon, (1.6, 0.8, 0.8), 16)
        body.face([(-0.05, -0.05, 0.02), (0.08, -0.05, 0.02), (0.0, -0.32, 0.1 * sin(i))], pigeon)
        body.face([(-0.05, 0.05, 0.02), (0.08, 0.05, 0.02), (0.0, 0.32, -0.1 * sin(i))], pigeon)
        x, y, z = -4 + 0.63 * i, 30 + (11 * i) % 9, 5.1 + 1.1 * sin(2.3 * i)
        body.finish(lambda t, x=x, y=y, z=z, i=i: moved(x + (0.14 + 0.03 * sin(i)) * (t - 11), y,
                                                        z + 0.05 * sin(t + i),
                                                        (0.5 * sin(1.2 * t + i), 0, 0.3 * sin(i))))


def build_flags():
    iron = paint("pole", plain((0.7, 0.7, 0.7)), 0.1)
    poles = Mesh("poles")
    across, down = np.meshgrid(np.linspace(0, 1, 24), np.linspace(0, 1, 12))
    for i, colors in enumerate([((0.1, 0.25, 0.6), (0.9, 0.9, 0.85)), ((0.45, 0.12, 0.45), (0.95, 0.85, 0.6)),
                                ((0.1, 0.4, 0.2), (0.9, 0.9, 0.9))]):
        x, y, z = -5.2 + 4.6 * i, 36.0 + 2 * i, 7.2 - 0.3 * i
        poles.rod((x, y, -1), (x, y, z + 0.1), 0.04, iron)
        cloth = paint(f"cloth{i}", stripes(0.4, *colors, "Y"), wrapped=True)
        made = Mesh(f"flag{i}")
        made.grid(12, 24, cloth)

        def shape(t, x=x, y=y, z=z, i=i):
            wave = 7 * across - 1.1 * t + 2 * i + down
            return np.stack([x + 1.7 * across + 0.06 * across * np.cos(wave), y + 0.25 * across * np.sin(wave),
                             z - 1.1 * down - 0.12 * across + 0.08 * across * np.sin(0.8 * wave)], -1).reshape(-1, 3)
        made.finish(shape=shape)
    poles.finish()


SCENE = Scene(camera=Camera(camera_pose, focus=43.0, focal_length_mm=150.0, f_stop=1.8, blades=9, far=400.0),
              sky=[(0.0, (0.3, 0.3, 0.3)), (0.5, (1.3, 1.3, 1.3)), (0.55, (0.6, 0.85, 1.4)), (1.0, (0.2, 0.4, 0.9))],
              sun=((0.7, 0.6, -0.75), 4.5),
              parts=[build_front, build_square, build_tram, build_flags])
