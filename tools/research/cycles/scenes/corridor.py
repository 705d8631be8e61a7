"""A slow walk through a colonnade: camera motion, depth from 0.6 m to the sky, a fence and hanging
leaves close to the lens, lamps out of focus behind six blades, bouncing balls."""
from math import cos, pi, radians, sin
from random import Random

from mathutils import Euler, Vector

from materials import bricks, checker, lamp, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene

GRAVITY = 9.81 / 24**2  # meters per frame^2
LENGTH = 16.0


def camera_pose(t):
    """0.085 m a frame along +y, a step every 11 frames, turning to and fro."""
    yaw = radians(4.5) * sin(2 * pi * (t - 3) / 22)
    pitch = radians(-2.0) + radians(0.9) * sin(2 * pi * (t + 1) / 11)
    return moved(0.03 * sin(2 * pi * t / 22), 0.085 * t, 0.82 + 0.018 * cos(2 * pi * t / 11),
                 (pi / 2 + pitch, 0, yaw))


def bounce(t, impact, period, height):
    """Height over the ground of a ball that hits it at the frame `impact` and every `period`."""
    u = (t - impact) % period
    return height + 0.5 * GRAVITY * u * (period - u)


def build_hall():
    stone = paint("stone", plain((0.62, 0.55, 0.44), 30))
    fluted = paint("fluted", stripes(9, (0.75, 0.68, 0.55), (0.42, 0.36, 0.28), "Z"))
    floor = paint("floor", checker(3.3, (0.72, 0.68, 0.6), (0.16, 0.2, 0.25)), 0.05)
    walls = paint("walls", bricks(3.2, (0.5, 0.16, 0.09), (0.36, 0.2, 0.12), (0.55, 0.5, 0.45), "yz"))
    tiles = paint("tiles", mosaic(9, [(0.1, 0.3, 0.6), (0.8, 0.7, 0.3), (0.7, 0.2, 0.15), (0.85, 0.85, 0.8)]))
    wood = paint("wood", stripes(12, (0.4, 0.24, 0.12), (0.28, 0.16, 0.08), "Y"))
    hall = Mesh("hall")
    hall.box((0, LENGTH / 2 - 1, -0.05), (6, LENGTH + 4, 0.1), floor)
    for side in (-1, 1):
        # A parapet, an open strip through which the sky is seen, and a frieze.
        hall.box((side * 1.55, LENGTH / 2, 0.55), (0.1, LENGTH, 1.1), walls)
        hall.box((side * 1.55, LENGTH / 2, 1.98), (0.12, LENGTH, 0.36), tiles)
        for i in range(19):
            y = 0.4 + 0.85 * i
            hall.rod((side * 1.15, y, 0), (side * 1.15, y, 1.9), 0.085, fluted, 0.07, 24)
            hall.box((side * 1.15, y, 0.06), (0.26, 0.26, 0.12), stone)
            hall.box((side * 1.15, y, 1.86), (0.24, 0.24, 0.1), stone)
    for i in range(38):
        hall.box((0, 0.2 + 0.425 * i, 2.05), (2.9, 0.09, 0.12), wood)
    # The far end: two blocks of wall and a beam about a door to the sky.
    for side in (-1, 1):
        hall.box((side * 1.05, LENGTH, 1.05), (1.1, 0.3, 2.1), tiles)
    hall.box((0, LENGTH, 1.95), (3.2, 0.3, 0.5), stone)
    hall.finish()


def build_fence():
    iron = paint("iron", plain((0.06, 0.07, 0.08)), 0.25)
    brass = paint("brass", plain((0.7, 0.5, 0.15)), 0.2)
    fence = Mesh("fence")
    x = -0.38
    for i in range(44):
        y = 0.5 + 0.17 * i
        fence.rod((x, y, 0), (x, y, 0.78), 0.007, iron)
        fence.ball((x, y, 0.795), 0.014, brass, segments=12)
    for z, radius in ((0.73, 0.006), (0.68, 0.0015), (0.63, 0.0015), (0.3, 0.006)):
        fence.rod((x, 0, z), (x, 8, z), radius, iron)
    fence.finish()


def build_leaves():
    """Twigs that hang from the beams on the right and above, and sway."""
    random = Random(7)
    twig = paint("twig", plain((0.2, 0.13, 0.06)))
    greens = [paint(f"green{i}", plain(color, 60), 0.08)
              for i, color in enumerate([(0.1, 0.3, 0.05), (0.2, 0.42, 0.07), (0.38, 0.45, 0.08), (0.5, 0.22, 0.06)])]
    places = [(0.34, 1.02, 1.3), (0.34, 1.36, 1.15), (0.25, 1.68, 1.25), (0.17, 2.35, 0.85), (0.42, 2.2, 1.2),
              (-0.3, 1.9, 0.95), (-0.62, 3.0, 1.1), (0.6, 3.3, 1.2), (0.72, 4.6, 1.1), (-0.75, 5.2, 1.1),
              (0.3, 6.0, 0.9)]
    for i, (x, y, length) in enumerate(places):
        made = Mesh(f"leaves{i}")
        made.rod((0, 0, 0), (0, 0, -length), 0.0025, twig, segments=6)
        for _ in range(int(60 * length)):
            at = Vector((0, 0, -random.uniform(0.1, 1) * length))
            turn = Euler((random.uniform(-0.9, 0.5), random.uniform(-0.4, 0.4), random.uniform(0, 2 * pi))).to_matrix()
            size = random.uniform(0.03, 0.06)
            outline = [(0, 0, 0), (0.24, 0.3, 0.04), (0.28, 0.6, 0.02), (0, 1.15, -0.1), (-0.28, 0.6, 0.02),
                       (-0.24, 0.3, 0.04)]
            made.face([at + turn @ (Vector(corner) * size) for corner in outline], random.choice(greens))
        period, start = random.uniform(13, 19), random.uniform(0, 2 * pi)

        def pose(t, x=x, y=y, period=period, start=start):
            sway = 0.07 * sin(2 * pi * t / period + start)
            return moved(x, y, 2.0, (sway, 0.6 * sway, 2.5 * sway))
        made.finish(pose)


def build_lamps():
    warm = lamp("warm", (1.0, 0.62, 0.28), 18)
    white = lamp("white", (0.9, 0.95, 1.0), 22)
    red = lamp("red", (1.0, 0.15, 0.08), 14)
    cord = paint("cord", plain((0.03, 0.03, 0.03)))
    strings = Mesh("strings")
    for side in (-1, 1):
        for i in range(18):  # from column to column
            y0, last = 0.4 + 0.85 * i, None
            for k in range(9):
                u = k / 8
                at = Vector((side * 1.04, y0 + 0.85 * u, 1.72 - 0.7 * u * (1 - u)))
                if last is not None:
                    strings.rod(last, at, 0.002, cord, segments=6)
                last = at
                if k in (2, 6):
                    bulb = (warm, white, warm, red)[(2 * i + k // 4) % 4]
                    strings.ball(at - Vector((0, 0, 0.024)), 0.022, bulb, segments=16)
    strings.finish()
    # Small ones close to the lens, on threads that swing.
    for i, (x, y, z, bulb) in enumerate([(0.13, 1.9, 0.92, warm), (-0.2, 1.95, 0.97, white), (0.31, 2.5, 0.72, red),
                                         (-0.12, 1.75, 0.9, warm)]):
        made = Mesh(f"lantern{i}")
        made.rod((0, 0, 0), (0, 0, z - 2), 0.0008, cord, segments=6)
        made.ball((0, 0, z - 2), 0.007, bulb, segments=12)
        made.finish(lambda t, x=x, y=y, i=i:
                    moved(x, y, 2.0, (0.04 * sin(t / 3 + i), 0.05 * cos(t / 4 + 2 * i), 0)))


def build_balls():
    colors = [((0.85, 0.12, 0.1), (0.9, 0.88, 0.8)), ((0.1, 0.3, 0.75), (0.95, 0.75, 0.1)),
              ((0.1, 0.5, 0.25), (0.9, 0.9, 0.9)), ((0.85, 0.45, 0.05), (0.1, 0.1, 0.15))]
    # radius; x, y at frame 0 and their speeds (m/frame); frame of an impact, period; spin a frame.
    moves = [(0.085, -0.25, 2.75, 0.030, 0.020, 5.1, 17, (0.22, 0.12, 0.05)),
             (0.07, 0.55, 2.3, -0.042, 0.050, 8.0, 15, (-0.1, 0.3, 0.1)),
             (0.11, -0.5, 4.6, 0.02, -0.06, 3.3, 19, (0.35, 0.0, 0.1)),
             (0.06, 0.1, 1.75, 0.012, 0.060, 9.9, 16, (-0.5, 0.1, 0.0))]
    for i, (radius, x, y, vx, vy, impact, period, spin) in enumerate(moves):
        made = Mesh(f"ball{i}")
        made.ball((0, 0, 0), radius, paint(f"ball{i}", stripes(0.9 / radius, *colors[i], "X"), 0.12), segments=48)

        def pose(t, radius=radius, x=x, y=y, vx=vx, vy=vy, impact=impact, period=period, spin=spin):
            return moved(x + vx * t, y + vy * t, bounce(t, impact, period, radius), [t * s for s in spin])
        made.finish(pose)


SCENE = Scene(camera=Camera(camera_pose, focus=2.2, focal_length_mm=40.0, f_stop=0.95, blades=6, rotation_deg=12.0),
              sky=[(0.0, (0.3, 0.32, 0.3)), (0.5, (2.2, 1.9, 1.4)), (0.58, (0.7, 1.0, 1.7)), (1.0, (0.15, 0.35, 0.9))],
              sun=((0.75, 0.5, -0.8), 5.0),
              parts=[build_hall, build_fence, build_leaves, build_lamps, build_balls])
