"""A whip pan with zoom, under a roof: the camera turns ever faster after a runner with a balloon while its lens
goes from 40 to 30 mm; a train comes in behind, pillars and hanging lamps fly by in front."""
import random
from math import cos, radians, sin

from materials import bricks, checker, lamp, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene


def heading(t):
    """Radians to the right of +y: 2.3 degrees a frame at frame 10, 4.3 at 13."""
    u = t - 11
    return radians(3.0 * u + 0.33 * u * u - 4)


def camera_pose(t):
    return moved(0.05 * (t - 11), 0, 1.45, (radians(91.5 + 0.3 * sin(1.3 * t)), radians(0.6 * cos(t)), -heading(t)))


def focal_length(t):
    u = t - 11
    return 36 - 3.6 * u + 0.3 * u * u


def covers():
    pick = random.Random(17)
    made = {"floor": paint("floor", checker(0.8, (0.46, 0.45, 0.42), (0.36, 0.35, 0.34)), 0.05),
            "edge": paint("edge", plain((0.85, 0.75, 0.15), 9)),
            "gravel": paint("gravel", mosaic(14, [(0.3, 0.28, 0.26), (0.22, 0.2, 0.19), (0.4, 0.37, 0.33)])),
            "tiles": paint("tiles", bricks(2.6, (0.75, 0.78, 0.72), (0.66, 0.7, 0.66), (0.3, 0.3, 0.28))),
            "iron": paint("iron", plain((0.1, 0.16, 0.13), 5), 0.15),
            "wood": paint("wood", stripes(9, (0.45, 0.27, 0.13), (0.36, 0.2, 0.1), "Z"), 0.04),
            "steel": paint("steel", plain((0.4, 0.4, 0.42)), 0.2),
            "dark": paint("dark", plain((0.05, 0.05, 0.06)), 0.1)}
    for i in range(6):
        one = [pick.uniform(0.1, 0.9) for _ in range(3)]
        two = [0.95 - 0.8 * part for part in one]
        made[f"poster{i}"] = paint(f"poster{i}", stripes(pick.uniform(5, 14), one, two, "XZ"[i % 2]))
    return made


def build_platforms(cover):
    bulb = lamp("bulb", (1.0, 0.82, 0.55), 35)
    sign = lamp("sign", (0.35, 0.6, 1.0), 5)
    made = Mesh("platforms")
    made.box((0, 0.4, -0.6), (60, 6.8, 1.2), cover["floor"])
    made.box((0, 3.6, 0.005), (60, 0.3, 0.01), cover["edge"])
    made.box((0, 6.5, -1.1), (60, 6, 0.2), cover["gravel"])
    made.box((0, 11.8, -0.6), (60, 4.6, 1.2), cover["tiles"])
    made.box((0, 14.3, 2.2), (60, 0.6, 4.8), cover["tiles"])
    for y in (4.5, 5.9, 7.3, 8.7):
        made.box((0, y, -0.9), (60, 0.08, 0.16), cover["steel"])
    for i in range(60):
        made.box((-20 + 0.68 * i, 5.2, -0.98), (0.25, 2.4, 0.1), cover["wood"])
        made.box((-20 + 0.68 * i, 8.0, -0.98), (0.25, 2.4, 0.1), cover["wood"])
    for i in range(16):
        x = -21 + 2.8 * i
        made.box((x, 11, 1.8), (0.18, 0.18, 3.6), cover["iron"])  # pillars of the other platform
        made.rod((x, 11, 2.9), (x + 0.9, 11, 3.6), 0.04, cover["iron"])
        made.rod((x, 11, 2.9), (x - 0.9, 11, 3.6), 0.04, cover["iron"])
        made.box((x + 1.2, 13.95, 1.7), (1.1, 0.04, 1.5), cover[f"poster{i % 6}"])
        made.box((x + 0.2, 12.6, 0.45), (1.3, 0.45, 0.06), cover["wood"])
        made.box((x + 0.2, 12.85, 0.8), (1.3, 0.05, 0.4), cover["wood"])
        made.ball((x + 1.4, 11.4, 3.25), 0.09, bulb, segments=20)
        made.rod((x + 1.4, 11.4, 3.3), (x + 1.4, 11.4, 3.7), 0.012, cover["iron"], segments=6)
        made.box((x + 1.4, 12.2, 2.75), (0.9, 0.05, 0.22), sign)
    for i in range(13):  # in front: pillars and lamps of this platform, out of focus
        x = -8.9 + 1.55 * i
        if i % 3 == 0:
            made.rod((x, 1.35, 0), (x, 1.35, 3.6), 0.06, cover["iron"])
            made.rod((x, 1.35, 0), (x, 1.35, 0.35), 0.1, cover["iron"])
        made.ball((x + 0.3, 2.2, 1.95 + 0.08 * sin(3 * i)), 0.022, bulb, segments=16)
        made.rod((x + 0.3, 2.2, 1.95 + 0.08 * sin(3 * i)), (x + 0.3, 2.2, 3.6), 0.006, cover["iron"], segments=6)
    made.box((0, 11.5, 3.75), (60, 5, 0.1), cover["wood"])
    made.finish()


def build_train(cover):
    """Comes in at .34 m a frame on the farther track."""
    body = paint("body", stripes(0.45, (0.72, 0.12, 0.1), (0.9, 0.86, 0.76), "Z"), 0.06)
    lit = lamp("lit", (1.0, 0.93, 0.75), 1.2)
    head = lamp("head", (1.0, 0.97, 0.9), 50)
    made = Mesh("train")
    for car in range(3):
        x = -6.6 * car - 3.2
        made.box((x, 8.0, 0.9), (6.3, 2.3, 2.7), body)
        made.box((x, 8.0, 2.35), (6.0, 1.8, 0.25), cover["steel"])
        for i in range(7):
            made.box((x - 2.6 + 0.87 * i, 6.84, 1.4), (0.6, 0.03, 0.7), lit if (i + car) % 4 else cover["dark"])
            made.box((x - 2.6 + 0.87 * i, 6.82, 1.35), (0.04, 0.04, 0.8), cover["steel"])
        for i in (-1.1, 1.1):
            made.box((x + i, 6.83, 0.75), (0.05, 0.03, 2.1), cover["dark"])
    for z, y in ((0.3, 7.3), (0.3, 8.7), (2.0, 8.0)):
        made.ball((-0.03, y, z), 0.12, head, segments=20)
    made.finish(lambda t: moved(0.4 + 0.34 * (t - 11), 0, 0))


def build_people(cover):
    """Wait on the other platform."""
    pick = random.Random(23)
    skin = paint("skin", plain((0.72, 0.48, 0.34)))
    made = Mesh("people")
    for i in range(22):
        x, y, tall = -15 + 1.45 * i + pick.uniform(-0.4, 0.4), pick.uniform(10.0, 12.2), pick.uniform(1.45, 1.85)
        coat = cover[f"poster{pick.randrange(6)}"]
        for side in (-0.09, 0.09):
            made.limb((x + side, y, 0.08), (x + side, y, 0.48 * tall), 0.07, cover["dark"])
        made.limb((x, y, 0.52 * tall), (x, y, 0.8 * tall), 0.17, coat)
        made.ball((x, y, 0.93 * tall), 0.11, skin, segments=20)
    made.finish()


def build_runner(cover):
    """Goes with the camera's turn; arms and legs swing."""
    red = paint("red", stripes(7, (0.85, 0.15, 0.1), (0.95, 0.9, 0.8), "Z"), 0.05)
    skin = paint("runner_skin", plain((0.78, 0.54, 0.4)), 0.05)
    shine = paint("shine", checker(9, (0.95, 0.75, 0.1), (0.9, 0.3, 0.15)), 0.25)

    def runner(t):
        angle = heading(t) * 0.94 + 0.02
        return moved(3.3 * sin(angle), 3.3 * cos(angle), 0.04 * abs(sin(0.9 * t)), (0, 0.12, -angle))
    made = Mesh("runner")
    made.limb((0, 0, 0.85), (0.06, 0, 1.28), 0.13, red)
    made.ball((0.1, 0, 1.56), 0.12, skin)
    made.ball((0.08, 0, 1.6), 0.12, cover["dark"])
    made.finish(runner)
    for i, (z, length, side, swing, cloth) in enumerate([(1.3, 0.3, -0.18, 0.9, red), (1.3, 0.3, 0.18, -0.9, red),
                                                         (0.85, 0.42, -0.09, -0.8, cover["dark"]),
                                                         (0.85, 0.42, 0.09, 0.8, cover["dark"])]):
        limb = Mesh(f"limb{i}")
        limb.limb((0, 0, 0), (0, 0, -length), 0.05, cloth)
        limb.limb((0, 0, -length), (0.16 if i < 2 else -0.2, 0, -1.7 * length), 0.045, skin)
        limb.finish(lambda t, z=z, side=side, swing=swing:
                    runner(t) @ moved(0.03, side, z, (0, swing * sin(0.9 * t), 0)))
    balloon = Mesh("balloon")
    balloon.ball((0, 0, 0), 0.2, shine, (1, 1, 1.2))
    balloon.rod((0, 0, -0.24), (0.1, 0, -0.8), 0.004, cover["dark"], segments=6)
    balloon.finish(lambda t: runner(t) @ moved(-0.35, -0.2, 1.95 + 0.04 * sin(t),
                                               (0.2 * sin(t), 0.25 * cos(0.8 * t), 0.1 * t)))


def build():
    cover = covers()
    for part in (build_platforms, build_train, build_people, build_runner):
        part(cover)


SCENE = Scene(camera=Camera(camera_pose, focus=3.3, focal_length_mm=focal_length, f_stop=0.7, blades=7),
              sky=[(0.0, (0.3, 0.3, 0.3)), (0.5, (1.4, 1.4, 1.4)), (0.6, (0.7, 0.9, 1.3)), (1.0, (0.25, 0.45, 0.9))],
              sun=((0.6, 0.75, -0.65), 3.0),
              parts=[build])
