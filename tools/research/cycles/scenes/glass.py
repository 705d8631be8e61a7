"""A bar: a bottle, tumblers, a turning prism and a rolling ball of glass on a table that mirrors, lamps
seen through them and in them, a mirror on the wall; the camera passes from left to right."""
from math import cos, pi, radians, sin

from mathutils import Matrix

from materials import bricks, checker, glass, lamp, mirrored, paint, plain, stripes
from model import Camera, Mesh, moved, Scene


def camera_pose(t):
    return moved(-0.5 + 0.03 * t, 0, 0.3, (radians(84.5), 0, radians(11.5 - 1.15 * t)))


def lathe(made, at, outline, material, segments=40):
    """A closed surface of revolution about z; outline: (radius, height) from pole to pole."""
    x, y, z = at
    rings = [[made.bm.verts.new((x + r * cos(2 * pi * i / segments), y + r * sin(2 * pi * i / segments), z + h))
              for i in range(segments)] for r, h in outline[1:-1]]
    low = made.bm.verts.new((x, y, z + outline[0][1]))
    high = made.bm.verts.new((x, y, z + outline[-1][1]))
    for i in range(segments):
        k = (i + 1) % segments
        made.bm.faces.new((low, rings[0][k], rings[0][i]))
        made.bm.faces.new((high, rings[-1][i], rings[-1][k]))
        for below, above in zip(rings, rings[1:]):
            made.bm.faces.new((below[i], below[k], above[k], above[i]))
    made.add_faces([low, high] + [vertex for ring in rings for vertex in ring], material, True)


def build_glasses():
    clear = glass("clear", (0.97, 0.98, 0.98))
    green = glass("green", (0.45, 0.8, 0.5))
    amber = glass("amber", (0.95, 0.62, 0.2))
    tumbler = [(0, 0), (0.03, 0), (0.034, 0.01), (0.04, 0.1), (0.037, 0.1), (0.032, 0.014), (0, 0.014)]
    still = Mesh("glasses")
    for x, y in ((-0.3, 1.0), (0.28, 1.05), (0.02, 1.75), (-0.48, 1.9), (0.55, 2.0)):
        lathe(still, (x, y, 0), tumbler, clear)
    lathe(still, (-0.06, 1.3, 0), [(0, 0), (0.045, 0), (0.05, 0.01), (0.05, 0.17), (0.018, 0.23), (0.017, 0.3),
                                   (0.021, 0.305), (0.021, 0.315), (0, 0.315)], green)
    lathe(still, (-0.3, 1.0, 0.0142), [(0, 0), (0.0315, 0), (0.0355, 0.06), (0, 0.06)], amber)
    still.finish(reflected=True)
    prism = Mesh("prism")
    prism.rod((0, 0, -0.09), (0, 0, 0.09), 0.05, clear, segments=6)
    prism.finish(lambda t: moved(0.17, 1.22, 0.2, (0.5, 0.3, 0.35 * t)), reflected=True)
    ball = Mesh("ball")
    ball.ball((0, 0, 0), 0.05, clear, segments=64)
    ball.finish(lambda t: moved(-0.75 + 0.05 * t, 0.95, 0.05, (0, 0.6 * t, 0)), reflected=True)
    marble = Mesh("marble")
    marble.ball((0, 0, 0), 0.035, mirrored(paint("marble", stripes(22, (0.85, 0.2, 0.1), (0.95, 0.9, 0.8))), 0.9),
                segments=48)
    marble.finish(lambda t: moved(0.75 - 0.055 * t, 1.5, 0.035, (0, -1.2 * t, 0)), reflected=True)


def build_room():
    table = mirrored(paint("table", checker(9, (0.3, 0.16, 0.08), (0.2, 0.1, 0.05))), 0.9)
    wall = paint("wall", bricks(5, (0.5, 0.2, 0.12), (0.4, 0.24, 0.15), (0.5, 0.47, 0.4)))
    signs = [paint(f"label{i}", stripes(scale, one, two, axis), 0, 0.5)
             for i, (scale, one, two, axis) in enumerate([(28, (0.9, 0.8, 0.3), (0.1, 0.1, 0.3), "X"),
                                                          (20, (0.9, 0.9, 0.9), (0.7, 0.1, 0.1), "Z"),
                                                          (35, (0.1, 0.4, 0.3), (0.85, 0.85, 0.7), "X")])]
    frame = paint("frame", plain((0.6, 0.42, 0.12)), 0.1)
    mirror = mirrored(paint("silver", plain((0.02, 0.02, 0.02))), 0.0, 0.9)
    made = Mesh("room")
    made.box((0, 1.7, -0.03), (3, 2.2, 0.06), table)
    made.box((0, 3.4, 0.5), (8, 0.1, 2.6), wall)
    made.box((0, -1.4, 0.5), (8, 0.1, 2.6), wall)  # seen in the mirrors only
    for i in range(9):
        made.box((-1.6 + 0.4 * i, 3.1, 0.12), (0.09, 0.09, 0.34), signs[i % 3])
        made.box((-1.8 + 0.5 * i, -1.2, 0.5), (0.2, 0.1, 0.7), signs[(i + 1) % 3])
    made.box((0.35, 3.34, 0.62), (1.0, 0.03, 0.62), frame)
    made.box((0.35, 3.32, 0.62), (0.92, 0.02, 0.54), mirror)
    made.finish(reflected=True)
    lamps = [lamp("warm", (1.0, 0.65, 0.3), 16), lamp("cold", (0.6, 0.8, 1.0), 16), lamp("pink", (1.0, 0.25, 0.5), 12)]
    bulbs = Mesh("bulbs")
    for i in range(12):
        bulbs.ball((-1.65 + 0.3 * i, 2.6, 0.42 + 0.06 * sin(2 * i)), 0.016, lamps[i % 3], segments=16)
        bulbs.ball((-1.65 + 0.3 * i, 0.4, 0.75), 0.016, lamps[(i + 1) % 3], segments=16)
    bulbs.finish(reflected=True)
    fan = Mesh("fan")  # behind the glasses, so that they refract what moves
    for i in range(4):
        turn = Matrix.Rotation(i * pi / 2, 3, "Y")
        fan.box(turn @ Matrix.Translation((0.14, 0, 0)).to_translation(), (0.24, 0.01, 0.07), signs[1], turn)
    fan.finish(lambda t: moved(-0.45, 2.7, 0.3, (0, 0.3 * t, 0)), reflected=True)


SCENE = Scene(camera=Camera(camera_pose, focus=1.25, focal_length_mm=45.0, f_stop=1.4, blades=8),
              sky=[(0.0, (0.02, 0.02, 0.02)), (1.0, (0.1, 0.1, 0.12))],
              sun=((0.5, 0.55, -0.8), 4.5),
              parts=[build_glasses, build_room], bounces=8)
