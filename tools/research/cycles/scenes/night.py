"""A wet street at night in fog: rows of lit windows, street lamps with cones of light, cars with head and
tail lamps that come and go, signs; the camera drives along."""
import random
from math import radians, sin

from materials import bricks, checker, haze, lamp, mirrored, paint, plain
from model import add_spot, Camera, Mesh, moved, Scene

FOG = (0.018, 0.022, 0.032)


def camera_pose(t):
    return (moved(0.35, 0.2 * t, 1.25 + 0.012 * sin(2 * t),
                  (radians(90 + 0.25 * sin(t)), 0, radians(4 + 2.4 * sin((t - 8) / 5)))))


def build_street():
    pick = random.Random(3)
    asphalt = mirrored(paint("asphalt", checker(1.4, (0.05, 0.05, 0.055), (0.035, 0.035, 0.04)), 0, 0.05), 1.0, 0.03,
                       0.06)
    curb = paint("curb", plain((0.25, 0.25, 0.25), 8), 0, 0.05)
    line = paint("line", plain((0.7, 0.7, 0.65)), 0, 0.06)
    walls = [paint(f"wall{i}", bricks(1.5, one, two, (0.2, 0.2, 0.2), "yz"), 0, 0.06)
             for i, (one, two) in enumerate([((0.3, 0.13, 0.09), (0.24, 0.14, 0.1)),
                                             ((0.2, 0.21, 0.25), (0.16, 0.16, 0.2))])]
    lit = [lamp(f"window{i}", color, strength)
           for i, (color, strength) in enumerate([((1.0, 0.7, 0.35), 1.6), ((0.75, 0.85, 1.0), 1.1),
                                                  ((1.0, 0.5, 0.2), 0.7), ((0.05, 0.06, 0.09), 1)])]
    made = Mesh("street")
    made.box((0, 40, -0.05), (7, 110, 0.1), asphalt)
    for i in range(30):
        made.box((0, 3 * i, 0.003), (0.12, 1.2, 0.006), line)
    for side in (-1, 1):
        made.box((side * 4.25, 40, 0.03), (1.5, 110, 0.14), curb)
        for i in range(14):
            y, tall = 3 + 6.5 * i, 7 + 4 * pick.random()
            made.box((side * (5.4 + 0.5 * pick.random()), y, tall / 2), (1, 6.2, tall), walls[i % 2])
            for k in range(4):
                for z in range(1, int(tall // 1.7)):
                    made.box((side * 4.88, y - 2.2 + 1.45 * k, 1.7 * z + 0.3), (0.06, 0.8, 1.0), pick.choice(lit))
    made.finish(reflected=True)


def build_lamps():
    pick = random.Random(9)
    iron = paint("iron", plain((0.05, 0.05, 0.05)), 0, 0.3)
    bulb = lamp("bulb", (1.0, 0.72, 0.4), 40)
    cone = haze("cone", (0.5, 0.34, 0.17), 0.4)
    neon = [lamp(f"neon{i}", color, 9)
            for i, color in enumerate([(1.0, 0.1, 0.25), (0.1, 0.8, 1.0), (0.3, 1.0, 0.3), (1.0, 0.6, 0.1)])]
    made = Mesh("lamps")
    light = Mesh("light")
    for i in range(8):
        for side in (-1, 1):
            x, y = side * 3.7, 4.0 + 8 * i + 2.5 * (side > 0)
            made.rod((x, y, 0), (x, y, 3.8), 0.05, iron)
            made.rod((x, y, 3.8), (x - side * 0.9, y, 3.9), 0.03, iron)
            made.ball((x - side * 0.9, y, 3.82), 0.08, bulb, segments=16)
            light.rod((x - side * 0.9, y, 0.02), (x - side * 0.9, y, 3.72), 1.5, cone, 0.08, 24)
            if i < 3:
                add_spot((x - side * 0.9, y, 3.7), (x - side * 0.9, y, 0), (1.0, 0.72, 0.4), 900, radians(100))
    for i in range(40):
        side = pick.choice((-1, 1))
        y, z = pick.uniform(4, 55), pick.uniform(1.6, 4.5)
        made.box((side * pick.uniform(3.9, 4.7), y, z), (pick.uniform(0.3, 0.9), 0.05, pick.uniform(0.05, 0.3)),
                 pick.choice(neon))
    for i in range(60):  # a string of bulbs across the street
        u = i % 20 / 19
        made.ball((-4.6 + 9.2 * u, 7 + 7 * (i // 20), 3.2 - 2.2 * u * (1 - u)), 0.03, neon[i % 4] if i % 3 else bulb,
                  segments=12)
    made.finish(reflected=True)
    light.finish(reflected=True)


def build_fog():
    made = Mesh("fog")
    made.box((0, 41.5, 4.5), (9.7, 75, 9.2), haze("fog", FOG, 0.045))
    made.finish()


def build_car(name, pose, away, color):
    """1.7 m wide; the end toward the camera has tail lamps (away) or head lamps."""
    body = mirrored(paint(f"{name}_body", plain(color), 0, 0.12), 0.6, 0.03)
    dark = paint(f"{name}_dark", plain((0.02, 0.02, 0.025)), 0, 0.2)
    shine = lamp(f"{name}_shine", (1.0, 0.06, 0.03) if away else (0.95, 0.95, 1.0), 14 if away else 60)
    made = Mesh(name)
    made.box((0, 1.9, 0.6), (1.7, 3.8, 0.6), body)
    made.box((0, 2.0, 1.12), (1.45, 1.9, 0.5), dark)
    for x in (-0.75, 0.75):
        for y in (0.8, 3.1):
            made.rod((x - 0.1, y, 0.3), (x + 0.1, y, 0.3), 0.3, dark, segments=24)
        if away:
            made.box((x * 0.85, -0.01, 0.72), (0.3, 0.03, 0.11), shine)
        else:
            made.ball((x * 0.82, 0, 0.65), 0.08, shine, segments=16)
    made.box((0, -0.01, 0.45), (0.5, 0.02, 0.12), lamp(f"{name}_plate", (0.8, 0.8, 0.7), 0.5))
    made.finish(pose, reflected=True)


def build_cars():
    build_car("near", lambda t: moved(0.7 + 0.012 * t, 4.9 + 0.24 * t, 0, (0, 0, -0.03)), True, (0.45, 0.04, 0.04))
    build_car("coming", lambda t: moved(-1.6, 16.5 - 0.62 * t, 0), False, (0.1, 0.15, 0.4))
    build_car("second", lambda t: moved(-1.7, 27 - 0.5 * t, 0), False, (0.4, 0.4, 0.4))
    build_car("far", lambda t: moved(1.6, 17 + 0.3 * t, 0), True, (0.3, 0.3, 0.1))


SCENE = Scene(camera=Camera(camera_pose, focus=4.9, focal_length_mm=55.0, f_stop=0.8, blades=9, far=200.0),
              sky=[(0.0, FOG), (0.5, FOG), (1.0, (0.004, 0.006, 0.012))],
              parts=[build_street, build_lamps, build_fog, build_cars], bounces=1)
