"""Three marionettes dance on curved paths in front of a mosaic: limbs that turn, strings as thin as
hair, lamps in two hands; the focus follows the middle one."""
from math import cos, pi, radians, sin

from mathutils import Matrix, Vector

from materials import bricks, checker, lamp, mosaic, paint, plain, stripes
from model import Camera, Mesh, moved, Scene

CAMERA = moved(0, 0, 0.46, (radians(89), 0, 0))


class Dancer:
    """A figure 0.6 m tall, feet at the height 0 of its path, facing -y.

    path(t) -> x, y, z, heading. joints(t) -> angles in radians by the names in PARTS.
    """

    # name: parent, joint in the parent's space. A part turns about its joint.
    PARTS = {"hips": (None, (0, 0, 0.33)), "chest": ("hips", (0, 0, 0.05)), "head": ("chest", (0, 0, 0.17)),
             "braid": ("head", (0, 0.045, 0.06)),
             **{f"upper_arm_{s}": ("chest", (k * 0.075, 0, 0.125)) for s, k in (("l", 1), ("r", -1))},
             **{f"lower_arm_{s}": (f"upper_arm_{s}", (0, 0, -0.12)) for s in "lr"},
             **{f"upper_leg_{s}": ("hips", (k * 0.04, 0, -0.02)) for s, k in (("l", 1), ("r", -1))},
             **{f"lower_leg_{s}": (f"upper_leg_{s}", (0, 0, -0.15)) for s in "lr"}}
    # Ends of the strings: part and point, and the place on the bar above.
    STRINGS = [("head", (0.03, 0, 0.12), (0.03, 0.0)), ("head", (-0.03, 0, 0.12), (-0.03, 0.0)),
               ("lower_arm_l", (0, 0, -0.11), (0.17, -0.02)), ("lower_arm_r", (0, 0, -0.11), (-0.17, -0.02)),
               ("lower_leg_l", (0, 0, -0.01), (0.06, -0.12)), ("lower_leg_r", (0, 0, -0.01), (-0.06, -0.12))]
    BAR = 0.83  # height of the bar over the path

    def __init__(self, name, path, joints, colors, lamp):
        self.name = name
        self.path = path
        self.joints = joints
        self.lamp = lamp
        trousers, shirt, accent = colors
        self.skin = paint(f"{name}_skin", plain((0.75, 0.5, 0.36)), 0.06)
        self.shirt = paint(f"{name}_shirt", stripes(14, shirt, accent, "Z"))
        self.cloth = paint(f"{name}_cloth", checker(38, trousers, accent))
        self.hair = paint(f"{name}_hair", stripes(30, accent, (0.08, 0.05, 0.04), "Z"))
        self.thread = paint(f"{name}_thread", plain((0.85, 0.82, 0.75)))

    def root(self, t):
        x, y, z, heading = self.path(t)
        return moved(x, y, z, (0, 0, heading))

    def pose(self, part, t):
        parent, joint = self.PARTS[part]
        base = self.root(t) if parent is None else self.pose(parent, t)
        return base @ moved(*joint, self.joints(t).get(part, (0, 0, 0)))

    def bar(self, t):
        """The bar follows the path, without its hops, and rocks."""
        x, y, _, heading = self.path(t)
        return moved(x, y, self.BAR, (0.1 * sin(t / 2.5), 0.2 * sin(t / 2), heading))

    def string(self, part, point, place, t):
        """Takes the rod from 0 to 1 on z to the way from the bar to the part."""
        top = self.bar(t) @ Vector((*place, 0))
        way = self.pose(part, t) @ Vector(point) - top
        turn = Vector((0, 0, 1)).rotation_difference(way).to_matrix().to_4x4()
        return Matrix.Translation(top) @ turn @ Matrix.Diagonal((1, 1, way.length, 1))

    def shape(self, part):
        made = Mesh(f"{self.name}_{part}")
        kind = part.rstrip("lr").rstrip("_")
        if kind == "hips":
            made.ball((0, 0, 0), 0.062, self.cloth, (1, 0.8, 0.8))
            made.rod((0, 0, -0.1), (0, 0, 0.03), 0.12, self.cloth, 0.055, 32)
        elif kind == "chest":
            made.limb((0, 0, 0.02), (0, 0, 0.1), 0.06, self.shirt)
            made.rod((0, 0, 0.1), (0, 0, 0.17), 0.02, self.skin)
        elif kind == "head":
            made.ball((0, 0, 0.06), 0.055, self.skin, (0.9, 0.95, 1.1))
            made.ball((0, 0.012, 0.078), 0.055, self.hair, (0.95, 0.95, 0.95))
            for x in (-0.02, 0.02):
                made.ball((x, -0.047, 0.066), 0.007, self.hair, segments=12)
        elif kind == "braid":
            for i in range(6):
                made.ball((0, 0.006 * i, -0.026 * i), 0.017 - 0.0018 * i, self.hair, segments=12)
        elif kind == "upper_arm":
            made.limb((0, 0, 0), (0, 0, -0.12), 0.02, self.shirt)
        elif kind == "lower_arm":
            made.limb((0, 0, 0), (0, 0, -0.1), 0.016, self.skin)
            made.ball((0, 0, -0.12), 0.02, self.skin, segments=16)
            if part == self.lamp[0]:
                made.ball((0, -0.02, -0.145), 0.009, self.lamp[1], segments=16)
        elif kind == "upper_leg":
            made.limb((0, 0, 0), (0, 0, -0.15), 0.024, self.cloth)
        else:
            made.limb((0, 0, 0), (0, 0, -0.13), 0.019, self.skin)
            made.box((0, -0.022, -0.15), (0.036, 0.085, 0.026), self.hair)
        return made

    def build(self):
        for part in self.PARTS:
            self.shape(part).finish(lambda t, part=part: self.pose(part, t))
        bar = Mesh(f"{self.name}_bar")
        bar.box((0, 0, 0), (0.38, 0.022, 0.014), self.hair)
        bar.box((0, -0.05, 0), (0.022, 0.2, 0.014), self.hair)
        bar.finish(self.bar)
        for i, tied in enumerate(self.STRINGS):
            thread = Mesh(f"{self.name}_string{i}")
            thread.rod((0, 0, 0), (0, 0, 1), 0.0006, self.thread, segments=6)
            thread.finish(lambda t, tied=tied: self.string(*tied, t))


def near_path(t):
    """Comes in from the left on an arc, at 0.03 m a frame, 1.3 to 1.05 m from the camera."""
    s = t / 13
    return (-0.5 + 0.36 * s, 1.3 - 0.25 * s - 0.1 * sin(pi * s), 0.02, 0.5 + 0.15 * sin(t / 3))


def near_joints(t):
    """Swings both arms and one leg fast."""
    a = 2 * pi * t / 20
    return {"chest": (0.15 * sin(a), 0.1 * sin(a + 1), 0.3 * sin(a)), "head": (0.2 * sin(a + 2), 0, 0.5 * sin(a / 2)),
            "braid": (0.7 + 0.4 * sin(a + 1), 0.3 * cos(a), 0),
            "upper_arm_l": (-1.2 + 0.75 * sin(a), -0.9 + 0.4 * cos(a), 0),
            "lower_arm_l": (-0.7 + 0.4 * sin(a + 1), 0, 0),
            "upper_arm_r": (-1.0 - 0.8 * sin(a), 0.8 + 0.3 * sin(a), 0),
            "lower_arm_r": (-0.8 - 0.5 * sin(a + 0.6), 0, 0),
            "upper_leg_l": (-0.5 + 0.5 * sin(a), 0, 0), "lower_leg_l": (0.5, 0, 0),
            "upper_leg_r": (-0.1 - 0.4 * sin(a), 0, 0), "lower_leg_r": (0.4, 0, 0)}


def middle_path(t):
    """Comes nearer on an arc, 2.35 to 1.75 m, and turns by 11 degrees a frame."""
    s = t / 13
    return (0.32 - 0.4 * s + 0.1 * sin(pi * s), 2.35 - 0.6 * s, 0.01, radians(11) * t)


def middle_joints(t):
    """A pirouette, arms out, one leg lifted."""
    a = 2 * pi * t / 22
    return {"chest": (0.05, 0.12 * sin(a), 0), "head": (0, 0, 0.4 * sin(a)), "braid": (1.1, 0, -0.5),
            "upper_arm_l": (-0.2, -1.5 + 0.15 * sin(a), 0), "lower_arm_l": (-0.35, 0, 0),
            "upper_arm_r": (-0.2, 1.35 + 0.15 * cos(a), 0), "lower_arm_r": (-0.35, 0, 0),
            "upper_leg_l": (-0.05, 0, 0), "lower_leg_l": (0.1, 0, 0),
            "upper_leg_r": (-1.1 + 0.2 * sin(a), 0.5, 0), "lower_leg_r": (1.4, 0, 0)}


def far_path(t):
    """Hops along the wall; a hop takes 9 frames, so feet bounce within a shutter."""
    u = (t - 4.1) % 9
    return (0.82 - 0.034 * t, 3.1 + 0.12 * sin(t / 4), 0.02 + 0.5 * 0.0085 * u * (9 - u), 0.25 * sin(t / 2))


def far_joints(t):
    """Arms up and down with the hops."""
    a = 2 * pi * (t - 4.1) / 9
    spread = 1.6 - 0.9 * cos(a)
    return {"head": (0.1 * sin(a), 0.2 * sin(a / 2), 0), "braid": (0.8 - 0.6 * cos(a), 0, 0),
            "upper_arm_l": (-0.3, -spread, 0), "lower_arm_l": (-0.5 + 0.4 * sin(a), 0, 0),
            "upper_arm_r": (-0.3, spread, 0), "lower_arm_r": (-0.5 - 0.4 * sin(a), 0, 0),
            "upper_leg_l": (0.2 * sin(a), -0.25 + 0.2 * cos(a), 0), "lower_leg_l": (0.3 - 0.3 * cos(a), 0, 0),
            "upper_leg_r": (-0.2 * sin(a), 0.25 - 0.2 * cos(a), 0), "lower_leg_r": (0.3 - 0.3 * cos(a), 0, 0)}


def build_set():
    wall = paint("wall", mosaic(7.5, [(0.55, 0.42, 0.28), (0.2, 0.3, 0.42), (0.65, 0.6, 0.5), (0.4, 0.14, 0.12),
                                      (0.14, 0.28, 0.2), (0.8, 0.68, 0.35)]))
    boards = paint("boards", bricks(2.2, (0.4, 0.24, 0.13), (0.3, 0.17, 0.09), (0.06, 0.04, 0.03), "yx"), 0.04)
    rings = paint("rings", stripes(7, (0.85, 0.8, 0.7), (0.6, 0.1, 0.1), "Y", rings=True))
    chess = paint("chess", checker(22, (0.85, 0.85, 0.8), (0.05, 0.06, 0.1)))
    bands = paint("bands", stripes(11, (0.1, 0.35, 0.55), (0.9, 0.85, 0.7), "X"))
    made = Mesh("stage")
    made.box((0, 4.05, 1.0), (6, 0.1, 3), wall)
    made.box((0, 2.4, -0.05), (6, 4.8, 0.1), boards)
    made.box((0.98, 3.97, 0.62), (0.5, 0.06, 0.5), chess)
    made.box((-1.0, 3.97, 0.42), (0.42, 0.06, 0.62), bands)
    made.finish()
    target = Mesh("target")  # rings about the middle of the object
    target.rod((0, 0.03, 0), (0, -0.03, 0), 0.3, rings, segments=48)
    target.finish().location = (0.15, 3.97, 0.95)


def build_lamps():
    warm = lamp("warm", (1.0, 0.7, 0.35), 18)
    cold = lamp("cold", (0.6, 0.8, 1.0), 20)
    metal = paint("metal", plain((0.12, 0.12, 0.13)), 0.2)
    made = Mesh("lamps")
    for i in range(9):  # along the wall's foot
        made.ball((-1.3 + 0.325 * i, 3.9, 0.045), 0.02, cold if i % 2 else warm, segments=16)
    # Two still wires across the picture and one close to the lens, with small lamps.
    made.rod((-1.5, 2.9, 0.86), (1.5, 2.7, 0.98), 0.0009, metal, segments=6)
    made.rod((-0.9, 1.5, 0.22), (0.9, 1.62, 0.27), 0.0007, metal, segments=6)
    made.rod((0.15, 0.86, 0.64), (0.45, 0.9, 0.54), 0.0007, metal, segments=6)
    for u, bulb in ((0.25, warm), (0.5, cold), (0.75, warm)):
        made.ball((0.15 + 0.3 * u, 0.86 + 0.04 * u, 0.634 - 0.1 * u), 0.006, bulb, segments=16)
    made.finish()


def build_dancers():
    hand = lamp("hand", (1.0, 0.8, 0.5), 20)
    dancers = [Dancer("near", near_path, near_joints, ((0.12, 0.14, 0.35), (0.75, 0.16, 0.12), (0.9, 0.8, 0.55)),
                      ("lower_arm_l", hand)),
               Dancer("middle", middle_path, middle_joints, ((0.75, 0.65, 0.2), (0.15, 0.45, 0.25), (0.9, 0.9, 0.85)),
                      ("lower_arm_r", hand)),
               Dancer("far", far_path, far_joints, ((0.3, 0.1, 0.35), (0.2, 0.5, 0.7), (0.85, 0.8, 0.75)), ("", hand))]
    for dancer in dancers:
        dancer.build()


def focus(frame):
    """Depth of the middle dancer's chest along the camera's axis."""
    x, y, z, _ = middle_path(frame)
    return -(CAMERA.inverted() @ Vector((x, y, z + 0.45))).z


SCENE = Scene(camera=Camera(lambda t: CAMERA, focus=focus, focal_length_mm=50.0, f_stop=1.0),
              sky=[(0.0, (0.1, 0.1, 0.1)), (1.0, (0.3, 0.4, 0.6))],
              sun=((0.5, 0.9, -0.75), 4.0),
              parts=[build_set, build_lamps, build_dancers], stage=build_set)
