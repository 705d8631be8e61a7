"""Meshes, materials and motion for the scenes, by Blender's Python interface.

Light is chosen so that a picture without lens and shutter has no noise but that of its edges: one
sun without size, no bounces, no light from what glows. What other scenes get from bounces is a
share of the color that glows by itself, more on faces that look up.
"""
import bmesh
import bpy
from mathutils import Matrix, Quaternion, Vector

KEYS_PER_FRAME = 16  # linear between them


class Mesh:
    """Parts of one rigid object, each with a material."""

    def __init__(self, name):
        self.name = name
        self.bm = bmesh.new()
        self.materials = []

    def _take(self, made, material, smooth):
        if material not in self.materials:
            self.materials.append(material)
        for face in {face for vertex in made["verts"] for face in vertex.link_faces}:
            face.material_index = self.materials.index(material)
            face.smooth = smooth

    def box(self, center, size, material, rotation=Matrix()):
        """size: whole lengths along x, y, z."""
        matrix = Matrix.Translation(center) @ rotation.to_4x4() @ Matrix.Diagonal((*size, 1))
        self._take(bmesh.ops.create_cube(self.bm, size=1, matrix=matrix), material, False)

    def ball(self, center, radius, material, stretch=(1, 1, 1), segments=32):
        matrix = Matrix.Translation(center) @ Matrix.Diagonal((*stretch, 1))
        self._take(bmesh.ops.create_uvsphere(self.bm, u_segments=segments,
                                             v_segments=segments // 2, radius=radius,
                                             matrix=matrix), material, True)

    def rod(self, start, end, radius, material, end_radius=None, segments=16):
        """A cylinder or, with end_radius, a cone, closed at both ends."""
        start, end = Vector(start), Vector(end)
        along = end - start
        turn = Vector((0, 0, 1)).rotation_difference(along).to_matrix().to_4x4()
        matrix = Matrix.Translation((start + end) / 2) @ turn
        self._take(bmesh.ops.create_cone(self.bm, cap_ends=True, segments=segments,
                                         radius1=radius,
                                         radius2=radius if end_radius is None else end_radius,
                                         depth=along.length, matrix=matrix), material,
                   segments > 8)

    def limb(self, start, end, radius, material):
        """A rod with round ends."""
        self.rod(start, end, radius, material)
        self.ball(start, radius, material, segments=16)
        self.ball(end, radius, material, segments=16)

    def face(self, corners, material):
        made = [self.bm.verts.new(corner) for corner in corners]
        self.bm.faces.new(made)
        self._take({"verts": made}, material, False)

    def finish(self, auto_smooth=True):
        data = bpy.data.meshes.new(self.name)
        self.bm.to_mesh(data)
        self.bm.free()
        data.use_auto_smooth = auto_smooth  # caps of rods stay flat
        for material in self.materials:
            data.materials.append(material)
        made = bpy.data.objects.new(self.name, data)
        made.visible_diffuse = made.visible_glossy = False  # no bounces, not even one to a lamp
        bpy.context.scene.collection.objects.link(made)
        return made


class Nodes:
    """Short ways to build the node tree of one material."""

    def __init__(self, tree):
        self.tree = tree
        tree.nodes.clear()

    def add(self, kind, inputs=None, **properties):
        node = self.tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[name])
            else:
                node.inputs[name].default_value = value
        return node

    def position(self):
        """In the object's own space: a pattern moves with its object."""
        return self.add("ShaderNodeTexCoord").outputs["Object"]

    def ramp(self, factor, stops):
        """stops: (position, color) from 0 to 1."""
        node = self.add("ShaderNodeValToRGB", {"Fac": factor})
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(0.5)
        for element, (position, color) in zip(elements, stops):
            element.position = position
            element.color = (*color, 1)
        return node.outputs["Color"]

    def times(self, first, second, share=1.0):
        """Product of two colors; share: how much the second counts."""
        return self.add("ShaderNodeMixRGB", {"Fac": share, "Color1": first, "Color2": second},
                        blend_type="MULTIPLY").outputs["Color"]


def noise(nodes, scale, low=0.55, high=1.25):
    """Gray of low to high, from noise of the scale (features per meter)."""
    value = nodes.add("ShaderNodeTexNoise", {"Vector": nodes.position(), "Scale": scale,
                                             "Detail": 2.0}).outputs["Fac"]
    return nodes.ramp(value, [(0.3, (low,) * 3), (0.7, (high,) * 3)])


def checker(scale, first, second):
    def pattern(nodes):
        color = nodes.add("ShaderNodeTexChecker",
                          {"Vector": nodes.position(), "Scale": scale, "Color1": (*first, 1),
                           "Color2": (*second, 1)}).outputs["Color"]
        return nodes.times(color, noise(nodes, scale * 2.5))
    return pattern


def bricks(scale, first, second, mortar, plane="xz"):
    """Courses of bricks in the plane given; the third axis is not seen."""
    def pattern(nodes):
        axes = nodes.add("ShaderNodeSeparateXYZ", {"Vector": nodes.position()}).outputs
        flat = nodes.add("ShaderNodeCombineXYZ",
                         {"X": axes[plane[0].upper()], "Y": axes[plane[1].upper()]})
        color = nodes.add("ShaderNodeTexBrick",
                          {"Vector": flat.outputs["Vector"], "Scale": scale,
                           "Color1": (*first, 1), "Color2": (*second, 1),
                           "Mortar": (*mortar, 1), "Mortar Size": 0.025}).outputs["Color"]
        return nodes.times(color, noise(nodes, scale * 6))
    return pattern


def stripes(scale, first, second, axis="X", rings=False):
    """Two colors in turn; rings: about the axis instead of along it."""
    def pattern(nodes):
        kind = {"wave_type": "RINGS", "rings_direction": axis} if rings else {
            "wave_type": "BANDS", "bands_direction": axis}
        value = nodes.add("ShaderNodeTexWave", {"Vector": nodes.position(), "Scale": scale},
                          **kind).outputs["Fac"]
        color = nodes.ramp(value, [(0.46, first), (0.54, second)])
        return nodes.times(color, noise(nodes, scale * 4, 0.75, 1.15))
    return pattern


def mosaic(scale, colors):
    """Cells of random colors with dark joints."""
    def pattern(nodes):
        where = nodes.position()
        cell = nodes.add("ShaderNodeTexVoronoi", {"Vector": where, "Scale": scale})
        joint = nodes.add("ShaderNodeTexVoronoi", {"Vector": where, "Scale": scale},
                          feature="DISTANCE_TO_EDGE")
        value = nodes.add("ShaderNodeSeparateXYZ",
                          {"Vector": cell.outputs["Color"]}).outputs["X"]
        steps = [(i / len(colors), color) for i, color in enumerate(colors)]
        color = nodes.ramp(value, steps)
        color.node.color_ramp.interpolation = "CONSTANT"
        line = nodes.ramp(joint.outputs["Distance"], [(0.02, (0.1,) * 3), (0.06, (1, 1, 1))])
        return nodes.times(color, line)
    return pattern


def plain(color, grain=0.0):
    """grain: features per meter of a noise over the color; 0: none."""
    def pattern(nodes):
        node = nodes.add("ShaderNodeRGB")
        node.outputs["Color"].default_value = (*color, 1)
        flat = node.outputs["Color"]
        return nodes.times(flat, noise(nodes, grain)) if grain > 0 else flat
    return pattern


def _new_material(name):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.cycles.sample_as_light = False  # what glows is seen and lights nothing
    return made, Nodes(made.node_tree)


def paint(name, pattern, gloss=0.0, ambient=0.25):
    """Diffuse and, by the share `gloss`, a mirror of roughness 0.25; ambient: share that glows."""
    made, nodes = _new_material(name)
    color = pattern(nodes)
    normal = nodes.add("ShaderNodeNewGeometry").outputs["Normal"]
    up = nodes.add("ShaderNodeSeparateXYZ", {"Vector": normal}).outputs["Z"]
    sky = nodes.add("ShaderNodeMapRange",
                    {"Value": up, "From Min": -1.0, "From Max": 1.0, "To Min": 0.4 * ambient,
                     "To Max": 1.6 * ambient}).outputs["Result"]
    surface = nodes.add("ShaderNodeBsdfDiffuse", {"Color": color}).outputs["BSDF"]
    if gloss > 0:
        mirror = nodes.add("ShaderNodeBsdfGlossy", {"Roughness": 0.25}).outputs["BSDF"]
        surface = nodes.add("ShaderNodeMixShader", {0: gloss, 1: surface,
                                                    2: mirror}).outputs["Shader"]
    glow = nodes.add("ShaderNodeEmission", {"Color": color, "Strength": sky}).outputs["Emission"]
    both = nodes.add("ShaderNodeAddShader", {0: surface, 1: glow}).outputs["Shader"]
    nodes.add("ShaderNodeOutputMaterial", {"Surface": both})
    return made


def lamp(name, color, strength):
    """A surface of one color and radiance from all sides."""
    made, nodes = _new_material(name)
    glow = nodes.add("ShaderNodeEmission", {"Color": (*color, 1), "Strength": strength})
    nodes.add("ShaderNodeOutputMaterial", {"Surface": glow.outputs["Emission"]})
    return made


def sun(direction, strength):
    """direction: that of the light's way."""
    data = bpy.data.lights.new("sun", "SUN")
    data.angle = 0
    data.energy = strength
    made = bpy.data.objects.new("sun", data)
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = Vector(direction).to_track_quat("-Z", "Y")
    bpy.context.scene.collection.objects.link(made)


def sky(stops):
    """Color by height, stops from straight down (0) to straight up (1). Lights nothing."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.cycles.sampling_method = "NONE"
    world.cycles_visibility.diffuse = world.cycles_visibility.glossy = False
    nodes = Nodes(world.node_tree)
    up = nodes.add("ShaderNodeSeparateXYZ",
                   {"Vector": nodes.add("ShaderNodeTexCoord").outputs["Generated"]}).outputs["Z"]
    share = nodes.add("ShaderNodeMapRange", {"Value": up, "From Min": -1.0}).outputs["Result"]
    color = nodes.ramp(share, stops)
    shown = nodes.add("ShaderNodeBackground", {"Color": color}).outputs["Background"]
    nodes.add("ShaderNodeOutputWorld", {"Surface": shown})


def _curve(made, path, index, times, values):
    action = made.animation_data.action
    curve = action.fcurves.new(path, index=index)
    curve.keyframe_points.add(len(times))
    curve.keyframe_points.foreach_set("co", [number for pair in zip(times, values)
                                             for number in pair])
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def animate(made, pose, frames):
    """Moves an object along pose(time in frames) -> 4x4 matrix, from two frames before to two
    frames after the frames given: vectors need one on each side."""
    first, last = frames[0] - 2, frames[-1] + 2
    times = [first + i / KEYS_PER_FRAME for i in range((last - first) * KEYS_PER_FRAME + 1)]
    parts, previous = [], Quaternion()
    for time in times:
        place, turn, scale = pose(time).decompose()
        if turn.dot(previous) < 0:
            turn.negate()
        previous = turn
        parts.append((place, turn, scale))
    made.rotation_mode = "QUATERNION"
    made.animation_data_create().action = bpy.data.actions.new(made.name)
    for part, (path, count) in enumerate((("location", 3), ("rotation_quaternion", 4),
                                          ("scale", 3))):
        for index in range(count):
            _curve(made, path, index, times, [values[part][index] for values in parts])
    made.cycles.use_motion_blur = True
    made.cycles.motion_steps = 3  # 9 times over the shutter
