"""Leaves on a swaying twig before a waving arm, a turning windmill, fur, a crate that comes in at the
picture's border and bulbs half behind leaves. With --transparent the sky is not there."""
import random
from math import cos, pi, radians, sin

from mathutils import Matrix, Vector

from materials import bricks, checker, lamp, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene

CAMERA = moved(0, 0, 0.4, (radians(90), 0, 0))
FOCUS = 1.9


def leaf(made, base, along, width, material):
    """A flat leaf of ten corners from `base`, facing the camera."""
    along = Vector(along)
    side = along.cross(Vector((0, 1, 0.2))).normalized() * width
    base = Vector(base)
    shape = [(0, 0), (0.2, 0.7), (0.45, 1), (0.7, 0.8), (0.9, 0.35), (1, 0)]
    left = [base + along * u + side * v for u, v in shape]
    right = [base + along * u - side * v for u, v in shape[-2:0:-1]]
    made.face(left + right, material)


def build_twig(name, pose, seed, material, bark):
    pick = random.Random(seed)
    made = Mesh(name)
    made.rod((-0.3, 0, 0.0), (0.3, 0, 0.05), 0.003, bark, segments=8)
    for i in range(15):
        x = -0.28 + 0.04 * i
        angle = pick.uniform(-0.9, 0.9) + (pi if i % 2 else 0)
        length = pick.uniform(0.05, 0.085)
        leaf(made, (x, pick.uniform(-0.01, 0.01), 0.025 + 0.08 * x), (length * sin(angle), 0, length * cos(angle)),
             length * 0.3, material)
    made.finish(pose)


def build_twigs():
    green = paint("leaf", plain((0.18, 0.42, 0.1), 60))
    bark = paint("bark", plain((0.2, 0.13, 0.08)))
    build_twig("near_twig", lambda t: moved(0.05 + 0.022 * t - 0.14, 0.9, 0.44, (0, 0.25 * sin(t / 2), 0)), 3, green,
               bark)
    build_twig("far_twig", lambda t: moved(0.35 - 0.014 * t, 1.5, 0.6, (0, 0.6 + 0.2 * sin(t / 1.7), 0)), 8, green,
               bark)


def build_arm():
    sleeve = paint("sleeve", stripes(26, (0.75, 0.16, 0.12), (0.9, 0.8, 0.55), "Z"))
    skin = paint("skin", plain((0.75, 0.5, 0.36)), 0.06)

    def upper(t):
        return moved(-0.12 + 0.012 * t, FOCUS, 0.22, (0, -0.5 + 0.35 * sin(t / 2.2), 0))

    def lower(t):
        return upper(t) @ moved(0, 0, 0.2, (0, 0.8 * sin(t / 1.8 + 1), 0))
    made = Mesh("upper_arm")
    made.limb((0, 0, 0), (0, 0, 0.2), 0.045, sleeve)
    made.finish(upper)
    made = Mesh("lower_arm")
    made.limb((0, 0, 0), (0, 0, 0.17), 0.035, skin)
    made.ball((0, 0, 0.22), 0.045, skin, (0.8, 0.6, 1.2))
    made.finish(lower)


def build_windmill():
    """Blades with fine stripes across; 14 degrees a frame."""
    striped = paint("blades", stripes(45, (0.9, 0.88, 0.8), (0.1, 0.2, 0.5), "X"))
    post = paint("post", plain((0.3, 0.2, 0.12), 30))
    made = Mesh("windmill")
    for i in range(6):
        turn = Matrix.Rotation(i * pi / 3, 3, "Y")
        made.box(turn @ Vector((0.09, 0, 0)), (0.15, 0.004, 0.022), striped, turn)
    made.ball((0, -0.01, 0), 0.016, post)
    made.finish(lambda t: moved(0.5, 2.1, 0.5, (0, radians(14) * t, 0)))
    still = Mesh("post")
    still.rod((0.5, 2.12, -0.3), (0.5, 2.12, 0.5), 0.008, post)
    still.finish()


def build_fur():
    """A ball with combed hair that rolls."""
    pick = random.Random(5)
    coat = paint("coat", plain((0.35, 0.2, 0.1), 40))
    tips = paint("tips", plain((0.8, 0.65, 0.4)))
    made = Mesh("fur")
    made.ball((0, 0, 0), 0.1, coat)
    for _ in range(1500):
        way = Vector((pick.gauss(0, 1), pick.gauss(0, 1), pick.gauss(0, 1))).normalized()
        made.rod(way * 0.095, way * 0.125 + Vector((0.012, 0, -0.01)), 0.0012, tips if pick.random() < 0.5 else coat,
                 0.0003, segments=3)
    made.finish(lambda t: moved(-0.62 + 0.02 * t, 1.7, 0.18, (0, 0.12 * t, 0)))


def build_crate():
    """Comes in from the left, 0.035 m a frame, close to the camera."""
    wood = paint("wood", bricks(9, (0.5, 0.33, 0.18), (0.42, 0.26, 0.13), (0.08, 0.05, 0.03)))
    made = Mesh("crate")
    made.box((0, 0, 0), (0.24, 0.2, 0.2), wood)
    made.finish(lambda t: moved(-0.67 + 0.035 * t, 1.3, 0.54, (0, 0.02 * t, 0.1)))


def build_bulbs():
    warm = lamp("warm", (1.0, 0.7, 0.35), 30)
    wire = paint("wire", plain((0.1, 0.1, 0.1)))
    made = Mesh("bulbs")
    points = [Vector((-0.9 + 0.2 * i, 2.8, 0.62 + 0.1 * ((i - 4.5) / 4.5) ** 2)) for i in range(10)]
    for start, end in zip(points, points[1:]):
        made.rod(start, end, 0.002, wire, segments=6)
    for point in points:
        made.ball(point - Vector((0, 0, 0.02)), 0.014, warm, segments=16)
    made.finish()


def build_ground():
    hedge = paint("hedge", mosaic(16, [(0.1, 0.25, 0.08), (0.16, 0.35, 0.1), (0.08, 0.18, 0.07), (0.22, 0.4, 0.16)]))
    lawn = paint("lawn", checker(9, (0.16, 0.3, 0.09), (0.12, 0.24, 0.07)))
    made = Mesh("ground")
    made.box((0, 3.6, 0.1), (5, 0.1, 0.5), hedge)
    made.box((0, 2.4, -0.15), (5, 4.8, 0.02), lawn)
    made.finish()


SCENE = Scene(camera=Camera(lambda t: CAMERA, focus=FOCUS, focal_length_mm=45.0, f_stop=1.2),
              sky=[(0.0, (0.2, 0.2, 0.2)), (0.5, (0.75, 0.8, 0.9)), (1.0, (0.2, 0.4, 0.8))],
              sun=((0.4, 0.9, -0.7), 3.5),
              parts=[build_twigs, build_arm, build_windmill, build_fur, build_crate, build_bulbs, build_ground],
              stage=build_ground)
