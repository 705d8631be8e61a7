"""What the scenes are made of: camera, meshes, light and keyed motion, by Blender's Python interface.

Light is chosen so that an image without lens and shutter has no noise but that of its edges: one sun without
size, no bounces, no light from what glows (materials.py).
"""
import dataclasses
from collections.abc import Callable
from math import pi, radians

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Matrix, Quaternion, Vector

from materials import Nodes

KEYS_PER_FRAME = 16  # linear between them
SHAPES_PER_FRAME = 8  # the same for deformed meshes


@dataclasses.dataclass
class Camera:
    pose: Callable  # time in frames -> 4x4, camera to world, looking along -z
    focus: float | Callable  # meters along the camera's axis, or frame -> meters
    focal_length_mm: float | Callable  # or time in frames -> mm
    f_stop: float
    blades: int = 0  # of the aperture; 0: a disc
    rotation_deg: float = 0.0
    far: float = 60.0  # clip plane, meters


@dataclasses.dataclass
class Scene:
    """A module of scenes/ has one as SCENE."""
    camera: Camera
    parts: list  # functions that build it, in this order
    sky: list | None = None  # color by height, for add_sky()
    sun: tuple | None = None  # the direction of its light and its strength
    stage: Callable | None = None  # the one of `parts` that --transparent leaves out
    bounces: int = 0  # of glass and mirrors

    def build(self, frames, transparent):
        """In an empty file; the keys of motion reach two frames beyond `frames`."""
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = frames[0], frames[-1]
        if self.sky:
            add_sky(self.sky)
        if self.sun:
            add_sun(*self.sun)
        for part in self.parts:
            if not (transparent and part is self.stage):
                part()


def moved(x, y, z, turn=(0, 0, 0)):
    """Turned about the origin (radians about x, y, z), then moved."""
    return Matrix.Translation((x, y, z)) @ Euler(turn).to_matrix().to_4x4()


def _add_object(name, data):
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


class Mesh:
    """Parts of one rigid object, each with a material."""

    def __init__(self, name):
        self.name = name
        self.bm = bmesh.new()
        self.parts = []  # finished: each call of bmesh.ops takes as long as self.bm is large
        self.materials = []

    def add_faces(self, vertices, material, smooth):
        """Takes in the faces of new vertices of self.bm."""
        if material not in self.materials:
            self.materials.append(material)
        for face in {face for vertex in vertices for face in vertex.link_faces}:
            face.material_index = self.materials.index(material)
            face.smooth = smooth
        if len(self.bm.verts) > 1000:
            self._put_aside()

    def _put_aside(self):
        self.parts.append(bpy.data.meshes.new(self.name))
        self.bm.to_mesh(self.parts[-1])
        self.bm.free()
        self.bm = bmesh.new()

    def box(self, center, size, material, rotation=Matrix()):
        """size: whole lengths along x, y, z."""
        matrix = Matrix.Translation(center) @ rotation.to_4x4() @ Matrix.Diagonal((*size, 1))
        self.add_faces(bmesh.ops.create_cube(self.bm, size=1, matrix=matrix)["verts"], material, False)

    def ball(self, center, radius, material, stretch=(1, 1, 1), segments=32):
        matrix = Matrix.Translation(center) @ Matrix.Diagonal((*stretch, 1))
        made = bmesh.ops.create_uvsphere(self.bm, u_segments=segments, v_segments=segments // 2, radius=radius,
                                         matrix=matrix)
        self.add_faces(made["verts"], material, True)

    def rod(self, start, end, radius, material, end_radius=None, segments=16):
        """A cylinder or, with end_radius, a cone, closed at both ends."""
        start, end = Vector(start), Vector(end)
        along = end - start
        turn = Vector((0, 0, 1)).rotation_difference(along).to_matrix().to_4x4()
        matrix = Matrix.Translation((start + end) / 2) @ turn
        made = bmesh.ops.create_cone(self.bm, cap_ends=True, segments=segments, radius1=radius,
                                     radius2=radius if end_radius is None else end_radius, depth=along.length,
                                     matrix=matrix)
        self.add_faces(made["verts"], material, segments > 8)

    def limb(self, start, end, radius, material):
        """A rod with round ends."""
        self.rod(start, end, radius, material)
        self.ball(start, radius, material, segments=16)
        self.ball(end, radius, material, segments=16)

    def face(self, corners, material, places=()):
        """places: texture coordinates of the corners."""
        made = [self.bm.verts.new(corner) for corner in corners]
        face = self.bm.faces.new(made)
        if places:
            layer = self.bm.loops.layers.uv.verify()
            for loop, place in zip(face.loops, places):
                loop[layer].uv = place
        self.add_faces(made, material, False)

    def grid(self, rows, columns, material, closed=False):
        """A smooth sheet of rows x columns vertices at the origin, for deform(); closed: each row
        is a ring. Vertices follow row by row. Texture coordinates: column and row, 0 to 1."""
        made = [[self.bm.verts.new((0, 0, 0)) for _ in range(columns)] for _ in range(rows)]
        layer = self.bm.loops.layers.uv.verify()
        wide = columns if closed else columns - 1
        for i in range(rows - 1):
            for j in range(wide):
                k = (j + 1) % columns
                face = self.bm.faces.new((made[i][j], made[i][k], made[i + 1][k], made[i + 1][j]))
                for loop, place in zip(face.loops, ((j, i), (j + 1, i), (j + 1, i + 1), (j, i + 1))):
                    loop[layer].uv = place[0] / wide, place[1] / (rows - 1)
        self.add_faces([one for row in made for one in row], material, True)

    def finish(self, pose=None, shape=None, reflected=False):
        """pose, shape: motion, for animate() and deform(). reflected: glass and mirrors show it."""
        self._put_aside()
        for part in self.parts:
            self.bm.from_mesh(part)
        data = self.parts.pop()
        self.bm.to_mesh(data)
        self.bm.free()
        for part in self.parts:
            bpy.data.meshes.remove(part)
        # Caps of rods stay flat.
        if hasattr(data, "use_auto_smooth"):  # before Blender 4.1
            data.use_auto_smooth = True
        else:
            data.set_sharp_from_angle(angle=radians(30))
        for material in self.materials:
            data.materials.append(material)
        made = _add_object(self.name, data)
        made.visible_diffuse = False  # no bounces, not even one to a lamp
        made.visible_glossy = reflected
        if pose:
            animate(made, pose)
        if shape:
            deform(made, shape)
        return made


def sheets(name, faces, materials, slots, shape):
    """An object of polygons with the motion `shape`. faces: rows of vertex numbers; slots: the material of
    each face."""
    faces = np.asarray(faces)
    data = bpy.data.meshes.new(name)
    data.from_pydata([(0, 0, 0)] * (int(faces.max()) + 1), [], faces.tolist())
    for material in materials:
        data.materials.append(material)
    data.polygons.foreach_set("material_index", slots)
    made = _add_object(name, data)
    made.visible_diffuse = made.visible_glossy = False
    deform(made, shape)


def add_lamp(name, kind, direction):
    """direction: of its light."""
    made = _add_object(name, bpy.data.lights.new(name, kind))
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = Vector(direction).to_track_quat("-Z", "Y")
    return made


def add_sun(direction, strength):
    data = add_lamp("sun", "SUN", direction).data
    data.angle = 0
    data.energy = strength


def add_sky(stops):
    """Color by height, stops from straight down (0) to straight up (1). Lights nothing."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.cycles.sampling_method = "NONE"
    world.cycles_visibility.diffuse = world.cycles_visibility.glossy = False
    nodes = Nodes(world.node_tree)
    up = nodes.axes(nodes.add("ShaderNodeTexCoord").outputs["Generated"])["Z"]
    share = nodes.add("ShaderNodeMapRange", {"Value": up, "From Min": -1.0}).outputs["Result"]
    color = nodes.ramp(share, stops)
    shown = nodes.add("ShaderNodeBackground", {"Color": color}).outputs["Background"]
    nodes.add("ShaderNodeOutputWorld", {"Surface": shown})


def add_spot(place, target, color, watts, spread):
    """A lamp without size that lights a cone of the angle `spread` (radians)."""
    made = add_lamp("spot", "SPOT", Vector(target) - Vector(place))
    made.location = place
    data = made.data
    data.color, data.energy, data.spot_size, data.spot_blend = color, watts, spread, 0.3
    data.shadow_soft_size = 0


def _key_times(frames, per_frame):
    """From two frames before to two frames after `frames`, by default those of the scene: motion vectors need
    a frame on each side."""
    scene = bpy.context.scene
    first, last = (frames[0], frames[-1]) if frames else (scene.frame_start, scene.frame_end)
    return [first - 2 + i / per_frame for i in range((last - first + 4) * per_frame + 1)]


def _curve(made, path, index, times, values):
    curves = made.animation_data.action.fcurves
    curve = curves.new(path, index=index) if index >= 0 else curves.new(path)
    curve.keyframe_points.add(len(times))
    curve.keyframe_points.foreach_set("co", [number for pair in zip(times, values) for number in pair])
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def animate_value(data, path, value, frames):
    """Changes a number of a data block: value(time in frames)."""
    times = _key_times(frames, KEYS_PER_FRAME)
    if not data.animation_data:
        data.animation_data_create().action = bpy.data.actions.new(data.name)
    _curve(data, path, -1, times, [value(time) for time in times])


def animate(made, pose, frames=None):
    """Moves an object along pose(time in frames) -> 4x4 matrix."""
    times = _key_times(frames, KEYS_PER_FRAME)
    parts, previous = [], Quaternion()
    for time in times:
        place, turn, scale = pose(time).decompose()
        if turn.dot(previous) < 0:
            turn.negate()
        previous = turn
        parts.append((place, turn, scale))
    made.rotation_mode = "QUATERNION"
    made.animation_data_create().action = bpy.data.actions.new(made.name)
    for part, (path, count) in enumerate((("location", 3), ("rotation_quaternion", 4), ("scale", 3))):
        for index in range(count):
            _curve(made, path, index, times, [values[part][index] for values in parts])
    made.cycles.use_motion_blur = True
    made.cycles.motion_steps = 3  # 9 times over the shutter


def deform(made, shape):
    """Moves the vertices of a mesh: shape(time in frames) -> array of their places (n x 3)."""
    times = _key_times(None, SHAPES_PER_FRAME)
    blocks = []
    for i, time in enumerate(times):
        block = made.shape_key_add(name=str(i), from_mix=False)
        block.interpolation = "KEY_LINEAR"
        block.data.foreach_set("co", np.asarray(shape(time), np.float32).ravel())
        blocks.append(block)
    key = made.data.shape_keys
    key.use_relative = False
    key.animation_data_create().action = bpy.data.actions.new(made.name)
    _curve(key, "eval_time", -1, [times[0], times[-1]], [blocks[0].frame, blocks[-1].frame])
    made.cycles.use_motion_blur = made.cycles.use_deform_motion = True
    made.cycles.motion_steps = 3


def tube(line, radii, sides):
    """Places of the vertices of grid(len(line), sides, closed=True) about a curve.
    line: array of points; radii: one for each, or (across, along y) pairs."""
    line = np.asarray(line, float)
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, (0.0, 1.0, 0.01))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(side, along)
    radii = np.asarray(radii, float)
    if radii.ndim == 1:
        radii = np.stack([radii, radii], 1)
    angle = np.arange(sides) * 2 * pi / sides
    ring = (side[:, None] * (np.cos(angle)[None, :, None] * radii[:, None, :1])
            + other[:, None] * (np.sin(angle)[None, :, None] * radii[:, None, 1:]))
    return (line[:, None] + ring).reshape(-1, 3)
