"""Architecture through a long lens: window after window of a far front, towers behind it, a tram and flags
that cross, railings and a lantern out of focus in front; the camera pans slowly on a tripod.

blender -b -P tests/cycles/facade.py -- OUT   (docs/dataset.md)
"""
import os
import random
import sys
from math import pi, radians, sin

import numpy as np
from mathutils import Euler, Matrix

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import model  # noqa: E402
import renderer  # noqa: E402


def camera_pose(t):
    return (Matrix.Translation((0, 0, 5.0))
            @ Euler((radians(90 + 0.02 * sin(t)), 0, radians(-0.27 * (t - 11)))).to_matrix().to_4x4())


def build_front():
    pick = random.Random(8)
    stone = model.paint("stone", model.bricks(0.9, (0.62, 0.55, 0.42), (0.56, 0.49, 0.38), (0.4, 0.36, 0.3)))
    trim = model.paint("trim", model.plain((0.75, 0.7, 0.6), 3))
    pane = [model.paint(f"pane{i}", model.plain(color), 0.1, 0.4) for i, color in enumerate(
        [(0.08, 0.12, 0.18), (0.16, 0.2, 0.26), (0.5, 0.42, 0.25)])]
    roof = model.paint("roof", model.stripes(1.4, (0.35, 0.16, 0.1), (0.25, 0.11, 0.08), "X"))
    shade = model.paint("shade", model.stripes(2.5, (0.75, 0.2, 0.15), (0.9, 0.85, 0.75), "X"))
    made = model.Mesh("front")
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
    paving = model.paint("paving", model.checker(0.7, (0.5, 0.48, 0.44), (0.42, 0.4, 0.37)))
    iron = model.paint("iron", model.plain((0.05, 0.06, 0.06)), 0.15)
    gold = model.lamp("gold", (1.0, 0.75, 0.4), 12)
    green = model.paint("green", model.mosaic(2.5, [(0.1, 0.25, 0.07), (0.16, 0.35, 0.1), (0.07, 0.17, 0.06)]))
    made = model.Mesh("square")
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


def build_tram(frames):
    red = model.paint("red", model.stripes(0.5, (0.75, 0.1, 0.08), (0.9, 0.85, 0.75), "Z"), 0.06)
    dark = model.paint("dark", model.plain((0.05, 0.07, 0.1)), 0.1, 0.4)
    lit = model.lamp("lit", (1.0, 0.95, 0.85), 18)
    made = model.Mesh("tram")
    made.box((0, 0, 2.6), (9, 2.2, 3.0), red)
    made.box((0, 0, 4.2), (8.6, 1.9, 0.3), dark)
    for i in range(8):
        made.box((-3.9 + 1.1 * i, -1.12, 3.1), (0.85, 0.04, 1.2), dark)
    for x in (-4.3, 4.3):
        made.ball((x, -1.0, 1.8), 0.14, lit, segments=16)
    made.rod((0, 0, 4.3), (1.6, 0, 6.4), 0.04, dark)
    model.animate(made.finish(), lambda t: model.moved(-4.2 + 0.42 * (t - 11), 43, -0.6), frames)
    pigeon = model.paint("pigeon", model.plain((0.3, 0.3, 0.34)))
    for i in range(14):
        body = model.Mesh(f"pigeon{i}")
        body.ball((0, 0, 0), 0.09, pigeon, (1.6, 0.8, 0.8), 16)
        body.face([(-0.05, -0.05, 0.02), (0.08, -0.05, 0.02), (0.0, -0.32, 0.1 * sin(i))], pigeon)
        body.face([(-0.05, 0.05, 0.02), (0.08, 0.05, 0.02), (0.0, 0.32, -0.1 * sin(i))], pigeon)
        x, y, z = -4 + 0.63 * i, 30 + (11 * i) % 9, 5.1 + 1.1 * sin(2.3 * i)
        model.animate(body.finish(), lambda t, x=x, y=y, z=z, i=i: model.moved(
            x + (0.14 + 0.03 * sin(i)) * (t - 11), y, z + 0.05 * sin(t + i),
            (0.5 * sin(1.2 * t + i), 0, 0.3 * sin(i))), frames)


def build_flags(frames):
    iron = model.paint("pole", model.plain((0.7, 0.7, 0.7)), 0.1)
    poles = model.Mesh("poles")
    across, down = np.meshgrid(np.linspace(0, 1, 24), np.linspace(0, 1, 12))
    for i, colors in enumerate([((0.1, 0.25, 0.6), (0.9, 0.9, 0.85)), ((0.45, 0.12, 0.45), (0.95, 0.85, 0.6)),
                                ((0.1, 0.4, 0.2), (0.9, 0.9, 0.9))]):
        x, y, z = -5.2 + 4.6 * i, 36.0 + 2 * i, 7.2 - 0.3 * i
        poles.rod((x, y, -1), (x, y, z + 0.1), 0.04, iron)
        cloth = model.paint(f"cloth{i}", model.stripes(0.4, *colors, "Y"), wrapped=True)
        made = model.Mesh(f"flag{i}")
        made.grid(12, 24, cloth)

        def shape(t, x=x, y=y, z=z, i=i):
            wave = 7 * across - 1.1 * t + 2 * i + down
            return np.stack([x + 1.7 * across + 0.06 * across * np.cos(wave), y + 0.25 * across * np.sin(wave),
                             z - 1.1 * down - 0.12 * across + 0.08 * across * np.sin(0.8 * wave)],
                            -1).reshape(-1, 3)
        model.deform(made.finish(), shape, frames)
    poles.finish()


def main():
    options = renderer.script_options(__doc__.split("\n\n", maxsplit=1)[0])
    renderer.empty_scene()
    model.sky([(0.0, (0.3, 0.3, 0.3)), (0.5, (1.3, 1.3, 1.3)), (0.55, (0.6, 0.85, 1.4)), (1.0, (0.2, 0.4, 0.9))])
    model.sun((0.7, 0.6, -0.75), 4.5)
    build_front()
    build_square()
    build_tram(options.frames)
    build_flags(options.frames)
    view = renderer.View(camera_pose, lambda frame: 43.0, focal_length_mm=150.0, f_stop=1.8, blades=9,
                         far=400.0)
    renderer.render_scene("facade", view, options)


main()
