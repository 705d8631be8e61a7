"""Boughs of leaves that are cut out of sheets by their texture's alpha, near and far, swaying and
turning, before trunks, a swing and bright sky; the camera rises among them."""
import random
from math import pi, radians, sin

from mathutils import Euler, Vector

from materials import bricks, leaf, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene


def camera_pose(t):
    return moved(0.012 * t, 0.01 * t, 0.9 + 0.024 * t, (radians(93 - 0.3 * t), 0, radians(1.5 * sin(t / 4))))


def build_bough(name, place, length, leaves, size, seed, greens, bark):
    """A bough along x from its place, leaves on both sides, swaying about the place."""
    pick = random.Random(seed)
    made = Mesh(name)
    made.rod((0, 0, 0), (length, 0, 0.12 * length), 0.006, bark, 0.0015, segments=8)
    for i in range(leaves):
        u = (i + 0.5) / leaves
        base = Vector((length * abs(u), 0, 0.12 * abs(length) * u))
        turn = Euler((pick.uniform(-0.7, 0.7), pick.uniform(-0.5, 0.5), pick.uniform(-0.6, 0.6))).to_matrix()
        along = turn @ Vector((pick.uniform(-0.5, 0.5), pick.uniform(-0.4, 0.4),
                               pick.choice((-1, -1, 1)))).normalized() * size * pick.uniform(0.7, 1.2)
        side = along.cross(turn @ Vector((0, 1, 0.3))).normalized() * along.length * 0.33
        base.x *= 1 if length > 0 else -1
        made.face([base - side, base + side, base + side + along, base - side + along], pick.choice(greens),
                  [(0, 0), (1, 0), (1, 1), (0, 1)])
    period, start = pick.uniform(9, 16), pick.uniform(0, 2 * pi)
    x, y, z = place

    def pose(t):
        sway = sin(2 * pi * t / period + start)
        return moved(x + 0.02 * sway, y, z, (0.25 * sway, 0.13 * sway, 0.1 * sway))
    made.finish(pose)


def build_boughs():
    pick = random.Random(4)
    greens = [leaf(f"leaf{i}", color, 0.06)
              for i, color in enumerate([(0.14, 0.36, 0.06), (0.3, 0.5, 0.08), (0.5, 0.46, 0.1), (0.6, 0.26, 0.07)])]
    bark = paint("bark", plain((0.22, 0.15, 0.09), 50))
    near = [((-0.42, 0.75, 1.02), 0.32), ((0.5, 0.85, 1.38), -0.3), ((0.45, 0.95, 1.0), -0.24)]
    for i, (place, length) in enumerate(near):
        build_bough(f"near{i}", place, length, 10, 0.09, 20 + i, greens, bark)
    for i in range(12):
        place = (pick.uniform(-1.1, 0.6), pick.uniform(1.5, 2.3), pick.uniform(0.75, 1.75))
        build_bough(f"middle{i}", place, 0.6, 26, 0.11, 40 + i, greens, bark)
    for i in range(26):
        place = (pick.uniform(-3, 2.5), pick.uniform(3.5, 6), pick.uniform(0.5, 3.2))
        build_bough(f"far{i}", place, 1.1, 40, 0.17, 70 + i, greens, bark)


def build_stand():
    bark = paint("trunk", bricks(9, (0.3, 0.22, 0.15), (0.2, 0.14, 0.1), (0.06, 0.05, 0.04)))
    moss = paint("moss", mosaic(7, [(0.2, 0.3, 0.08), (0.14, 0.22, 0.07), (0.3, 0.3, 0.12)]))
    made = Mesh("stand")
    for i in range(16):
        x, y = -4.5 + 0.6 * i, 4.2 + 2.3 * ((7 * i) % 5) / 5
        made.rod((x, y, -0.5), (x + 0.2 * sin(3 * i), y, 5), 0.1 + 0.04 * ((3 * i) % 4), bark, 0.06)
    made.box((0, 6, -0.4), (20, 14, 0.1), moss)
    made.finish()
    wood = paint("wood", stripes(16, (0.75, 0.2, 0.1), (0.9, 0.85, 0.7)))
    rope = paint("rope", plain((0.7, 0.6, 0.4)))
    swing = Mesh("swing")
    swing.box((0, 0, -2), (0.5, 0.2, 0.05), wood)
    swing.ball((0, 0, -1.83), 0.15, wood, segments=32)
    for x in (-0.23, 0.23):
        swing.rod((x, 0, -2), (x, 0, 0), 0.006, rope, segments=6)
    swing.finish(lambda t: moved(0.25, 2.9, 3.0, (0, 0.5 * sin(t / 3.2 - 3.6), 0)))


SCENE = Scene(camera=Camera(camera_pose, focus=1.9, focal_length_mm=40.0, f_stop=1.2, blades=7),
              sky=[(0.0, (0.3, 0.35, 0.25)), (0.5, (3.2, 3.0, 2.4)), (0.62, (1.0, 1.3, 1.7)), (1.0, (0.3, 0.6, 1.2))],
              sun=((0.5, 0.7, -0.9), 4.5),
              parts=[build_boughs, build_stand])
