"""A whip pan with zoom: the camera turns faster and faster after a cyclist and a kite while its lens goes
from 34 to 48 mm; fences, posts and signs fly by."""
import random
from math import cos, pi, radians, sin

from mathutils import Euler, Matrix

from materials import bricks, checker, lamp, paint, plain, stripes
from model import Camera, Mesh, moved, Scene


def heading(t):
    """Radians to the right of +y: 2.2 degrees a frame at frame 10, 4 at 13."""
    u = t - 11
    return radians(2.75 * u + 0.28 * u * u)


def camera_pose(t):
    return moved(0.02 * t, 0, 1.1, (radians(91 - 0.35 * (t - 11)), radians(0.5 * sin(t)), -heading(t)))


def focal_length(t):
    return 38 + 4.2 * (t - 11) + 0.3 * (t - 11)**2


def around(distance, angle, z=0.0, turn=(0, 0, 0)):
    return moved(distance * sin(angle), distance * cos(angle), z, turn)


def build_yard():
    pick = random.Random(6)
    grass = paint("grass", checker(1.1, (0.2, 0.33, 0.1), (0.26, 0.38, 0.13)))
    brick = paint("brick", bricks(2.2, (0.55, 0.22, 0.13), (0.4, 0.2, 0.13), (0.6, 0.57, 0.5), "xz"))
    white = paint("white", plain((0.8, 0.8, 0.76), 12))
    iron = paint("iron", plain((0.06, 0.07, 0.08)), 0.15)
    colors = [paint(f"board{i}", stripes(s, one, two, axis), 0, 0.4)
              for i, (s, one, two, axis) in enumerate([(4, (0.85, 0.2, 0.1), (0.95, 0.9, 0.8), "X"),
                                                       (6, (0.1, 0.3, 0.7), (0.9, 0.8, 0.2), "Z"),
                                                       (5, (0.1, 0.5, 0.3), (0.9, 0.9, 0.9), "X"),
                                                       (8, (0.1, 0.1, 0.1), (0.9, 0.7, 0.1), "Z")])]
    bulb = lamp("bulb", (1.0, 0.9, 0.7), 30)
    made = Mesh("yard")
    made.box((0, 0, -0.05), (60, 60, 0.1), grass)
    for i in range(48):
        angle = radians(-70 + 3.4 * i)
        x, y = sin(angle), cos(angle)
        turn = Euler((0, 0, -angle)).to_matrix()
        far = 12 + 3 * ((5 * i) % 7) / 7
        tall = pick.uniform(2.2, 4.2)
        made.box((far * x, far * y, tall / 2), (0.95, 1.0, tall), brick if i % 3 else white, turn)
        for z in (0.8, 1.8, 2.8):
            if z + 0.4 < tall:
                made.box((far * x * 0.955, far * y * 0.955, z), (0.4, 0.05, 0.6), iron, turn)
        if i % 2:  # pickets of a fence in the middle distance
            made.rod((6.5 * x, 6.5 * y, 0), (6.5 * x, 6.5 * y, 1.1), 0.035, white)
        if i % 4 == 0:
            made.box((5.4 * x, 5.4 * y, 1.5), (0.8, 0.04, 0.5), colors[(i // 4) % 4], turn)
            made.rod((5.4 * x, 5.4 * y, 0), (5.4 * x, 5.4 * y, 1.25), 0.03, iron)
        if i % 6 == 3:  # a lamp post close by
            made.rod((2.3 * x, 2.3 * y, 0), (2.3 * x, 2.3 * y, 2.2), 0.02, iron)
        made.ball((9 * x, 9 * y, 2.6 + 0.3 * sin(2.2 * i)), 0.04, bulb, segments=12)
    made.finish()


def build_runners():
    """Go with the camera's turn: nearly still in the picture, except wheels and kite."""
    red = paint("red", stripes(5, (0.8, 0.12, 0.1), (0.9, 0.85, 0.75), "Z"), 0.08)
    blue = paint("blue", checker(6, (0.1, 0.25, 0.6), (0.85, 0.85, 0.8)))
    black = paint("black", plain((0.04, 0.04, 0.05)))
    spoke = paint("spoke", plain((0.8, 0.75, 0.6)))
    skin = paint("skin", plain((0.75, 0.5, 0.36)))

    def rider(t):
        return around(3.6, heading(t) * 0.97 - 0.05, 0.0, (0, 0, -heading(t)))
    made = Mesh("rider")
    made.limb((0.05, 0, 0.75), (0.16, 0, 1.2), 0.09, red)
    made.ball((0.2, 0, 1.42), 0.1, skin)
    made.ball((0.18, 0, 1.47), 0.1, blue)
    made.limb((0.16, -0.08, 1.15), (0.42, -0.1, 0.95), 0.035, skin)
    made.limb((0.05, -0.06, 0.72), (0.15, -0.08, 0.4), 0.05, blue)
    for start, end in (((-0.35, 0, 0.32), (0.05, 0, 0.65)), ((0.05, 0, 0.65), (0.45, 0, 0.75)),
                       ((0.45, 0, 0.32), (0.42, 0, 0.95))):
        made.rod(start, end, 0.02, black)
    made.finish(rider)
    for name, x in (("back", -0.35), ("front", 0.45)):
        wheel = Mesh(f"wheel_{name}")
        for i in range(24):
            a, b = 2 * pi * i / 24, 2 * pi * (i + 1) / 24
            wheel.rod((0.31 * cos(a), 0, 0.31 * sin(a)), (0.31 * cos(b), 0, 0.31 * sin(b)), 0.018, black)
            if i % 2 == 0:
                wheel.rod((0, 0, 0), (0.31 * cos(a), 0, 0.31 * sin(a)), 0.004, spoke, segments=6)
        wheel.finish(lambda t, x=x: rider(t) @ moved(x, 0, 0.32, (0, 0.55 * t, 0)))
    kite = Mesh("kite")
    kite.box((0, 0, 0), (0.5, 0.02, 0.5), red, Matrix.Rotation(pi / 4, 3, "Y"))
    for i in range(6):
        kite.ball((0, 0, -0.45 - 0.12 * i), 0.03, blue, segments=12)
    kite.finish(lambda t: around(4.5, heading(t) * 0.9 + 0.2, 1.95 + 0.03 * t, (0, 0.25 * sin(t), -heading(t))))


SCENE = Scene(camera=Camera(camera_pose, focus=3.6, focal_length_mm=focal_length, f_stop=0.8, blades=6),
              sky=[(0.0, (0.3, 0.3, 0.3)), (0.5, (1.5, 1.5, 1.5)), (0.6, (0.6, 0.85, 1.4)), (1.0, (0.2, 0.4, 0.9))],
              sun=((0.5, 0.7, -0.8), 4.5),
              parts=[build_yard, build_runners])
