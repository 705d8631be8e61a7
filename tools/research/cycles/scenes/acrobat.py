"""A figure of one bending skin does a cartwheel, with a cape and ribbons that bend too, before an audience
and lamps; the camera follows at half the speed."""
from math import pi, radians, sin

import numpy as np

from materials import bricks, checker, lamp, paint, plain, stripes
from model import Camera, Mesh, moved, Scene, tube

FOCUS = 2.0


def camera_pose(t):
    return moved(-0.26 + 0.022 * t, 0, 0.52 + 0.01 * sin(t / 2), (radians(90), 0, radians(0.6 * sin(t / 3))))


def body(t):
    """The figure's space, origin in the hips, z up: it turns in the picture's plane and travels."""
    turn = 0.21 * (t - 8)
    return moved(-0.55 + 0.05 * t, FOCUS + 0.05 * sin(t / 3), 0.5 + 0.06 * sin(2 * turn),
                 (0.15 * sin(t / 3), turn, 0.5 * sin(t / 4)))


def in_world(points, t, pose=body):
    turn = np.array(pose(t))
    return np.asarray(points) @ turn[:3, :3].T + turn[:3, 3]


def bend(joints, count):
    """A smooth curve of `count` points from the first to the last joint, near those between."""
    u = np.linspace(0, 1, count)[:, None]
    points = [np.asarray(joint, float)[None] for joint in joints]
    while len(points) > 1:  # de Casteljau
        points = [(1 - u) * one + u * two for one, two in zip(points, points[1:])]
    return points[0] + 0 * u


def limb_joints(name, t):
    """Shoulder or hip, two points about the elbow or knee, wrist or ankle; all in body space."""
    side = 1 if name.endswith("l") else -1
    if name.startswith("arm"):
        swing = 0.5 * sin(t / 1.7 + side)
        elbow = np.array((side * 0.16, -0.05 - 0.06 * swing, 0.33 + 0.07 * swing))
        return [(side * 0.055, 0, 0.2), elbow, elbow, elbow + (side * 0.06 * (1 + swing), -0.09 * swing, 0.15)]
    kick = 0.6 * sin(t / 1.9 + 1.5 * side)
    knee = np.array((side * (0.11 + 0.06 * kick), -0.1 - 0.1 * kick, -0.16))
    return [(side * 0.04, 0, -0.02), knee, knee, knee + (side * 0.08, 0.12 + 0.12 * kick, -0.17)]


def build_figure():
    suit = paint("suit", stripes(4.5, (0.85, 0.15, 0.12), (0.95, 0.8, 0.25), "Y"), 0.05, wrapped=True)
    skin = paint("skin", plain((0.75, 0.5, 0.36)), 0.06)
    hair = paint("hair", plain((0.08, 0.05, 0.04)))
    rows, sides = 22, 20
    for name in ("arm_l", "arm_r", "leg_l", "leg_r"):
        thick = 0.024 if name.startswith("arm") else 0.032
        # A skin that bulges about the bend and ends in a fist or foot, closed at both ends.
        u = np.linspace(0, 1, rows)
        radii = thick * (1.05 - 0.45 * u + 0.25 * np.exp(-((u - 0.93) / 0.06)**2))
        radii[0] = radii[-1] = 0.002
        made = Mesh(name)
        made.grid(rows, sides, suit if name.startswith("leg") else skin, closed=True)

        def shape(t, name=name, radii=radii):
            swell = 1 + 0.18 * np.sin(pi * u) * sin(t / 1.8)
            return tube(in_world(bend(limb_joints(name, t), rows), t), radii * swell, sides)
        made.finish(shape=shape)
    made = Mesh("trunk")
    made.grid(rows, 28, suit, closed=True)
    u = np.linspace(0, 1, rows)
    outline = 0.062 + 0.014 * np.cos(2 * pi * u) + 0.01 * u
    outline[0], outline[1], outline[-2], outline[-1] = 0.002, 0.045, 0.05, 0.002

    def trunk(t):
        line = bend([(0, 0, -0.06), (0.05 * sin(t / 2), 0.03, 0.08), (0, 0, 0.23)], rows)
        return tube(in_world(line, t), np.stack([outline, 0.75 * outline], 1), 28)
    made.finish(shape=trunk)
    head = Mesh("head")
    head.rod((0, 0, 0.2), (0, 0, 0.28), 0.02, skin)
    head.ball((0, 0, 0.32), 0.06, skin, (0.9, 0.95, 1.1))
    head.ball((0, 0.012, 0.335), 0.06, hair, (0.93, 0.93, 1.0))
    for x in (-0.022, 0.022):
        head.ball((x, -0.052, 0.325), 0.008, hair, segments=12)
    head.finish(body)


def build_cloth():
    """A cape from the shoulders and a ribbon from each hand: what they are tied to moves first."""
    lining = paint("cape", checker(12, (0.1, 0.25, 0.65), (0.85, 0.8, 0.3)), 0.05, wrapped=True)
    rows, columns = 30, 24
    made = Mesh("cape")
    made.grid(rows, columns, lining)
    across = np.linspace(-1, 1, columns)

    def cape(t):
        places = []
        for i in range(rows):
            u = i / (rows - 1)
            ripple = 0.03 * u * np.sin(5 * across + 9 * u - 1.4 * t)
            row = np.stack([(0.055 + 0.12 * u) * across + 0.03 * u * sin(t / 1.5 - 3 * u),
                            0.055 + 0.12 * u + ripple + 0.06 * u * np.sin(1.1 * t - 4 * u),
                            0.21 - 0.33 * u + 0 * across], -1)
            places.append(in_world(row, t - 2.2 * u))
        return np.concatenate(places)
    made.finish(shape=cape)
    silk = paint("silk", plain((0.95, 0.35, 0.55)), 0.1)
    for name in ("arm_l", "arm_r"):
        made = Mesh(f"ribbon_{name}")
        made.grid(40, 2, silk)

        def ribbon(t, name=name):
            lag = np.linspace(0, 4.5, 40)
            line = np.array([in_world([limb_joints(name, t - k)[-1]], t - k)[0] for k in lag])
            line[:, 2] += 0.03 * lag * np.sin(2 * lag - 1.2 * t) / 4 - 0.02 * lag
            line[:, 0] -= 0.035 * lag
            wide = np.stack([0 * lag, 0.006 + 0 * lag, 0.012 * np.cos(lag)], -1)
            return np.stack([line - wide, line + wide], 1).reshape(-1, 3)
        made.finish(shape=ribbon)


def build_ring():
    sand = paint("sand", checker(5, (0.6, 0.48, 0.3), (0.5, 0.36, 0.2)))
    tent = paint("tent", stripes(1.6, (0.65, 0.1, 0.1), (0.8, 0.75, 0.6), "X"))
    rail = paint("rail", bricks(4, (0.15, 0.3, 0.6), (0.2, 0.35, 0.65), (0.9, 0.75, 0.2)))
    coats = [paint(f"coat{i}", plain(color, 30))
             for i, color in enumerate([(0.6, 0.2, 0.15), (0.2, 0.4, 0.25), (0.2, 0.25, 0.5), (0.6, 0.55, 0.4),
                                        (0.4, 0.2, 0.4)])]
    skin = paint("faces", plain((0.7, 0.48, 0.36)))
    bulbs = [lamp("yellow", (1.0, 0.7, 0.3), 22), lamp("blue", (0.4, 0.6, 1.0), 18)]
    made = Mesh("ring")
    made.box((0, 3, -0.05), (12, 7, 0.1), sand)
    made.box((0, 5.2, 1.3), (12, 0.1, 3), tent)
    made.box((0, 3.2, 0.15), (12, 0.15, 0.3), rail)
    for row in range(3):
        for i in range(18):
            x, y, z = -2.6 + 0.3 * i + 0.15 * (row % 2), 3.6 + 0.45 * row, 0.3 + 0.22 * row
            made.ball((x, y, z), 0.11, coats[(5 * i + 3 * row + i * i) % 5], (1, 0.8, 1.3), 16)
            made.ball((x, y, z + 0.21), 0.062, skin, segments=16)
    for i in range(25):
        made.ball((-3 + 0.25 * i, 4.8, 1.25 + 0.12 * sin(1.3 * i)), 0.02, bulbs[i % 2], segments=12)
    for x, y in ((-0.36, 0.95), (0.48, 1.15)):  # posts close to the lens
        made.rod((x, y, 0), (x, y, 1.6), 0.012, rail)
    made.finish()


SCENE = Scene(camera=Camera(camera_pose, focus=FOCUS, focal_length_mm=48.0, f_stop=1.4),
              sky=[(0.0, (0.1, 0.1, 0.1)), (1.0, (0.2, 0.2, 0.25))],
              sun=((0.45, 0.6, -0.8), 4.0),
              parts=[build_figure, build_cloth, build_ring])
