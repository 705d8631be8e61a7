"""Patterns and materials of the scenes, by Blender's nodes.

What glows lights nothing, so that it makes no noise. What other scenes get from bounces is a share of the color
that glows by itself, more on faces that look up.
"""
from math import pi

import bpy


class Nodes:
    """Short ways to build the node tree of one material."""

    def __init__(self, tree, clear=True, wrapped=False):
        self.tree = tree
        self.wrapped = wrapped
        if clear:
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
        """In the object's own space: a pattern moves with its object. wrapped: texture
        coordinates, so that it moves with a deformed mesh."""
        return self.add("ShaderNodeTexCoord").outputs["UV" if self.wrapped else "Object"]

    def axes(self, vector):
        """Outputs X, Y and Z."""
        return self.add("ShaderNodeSeparateXYZ", {"Vector": vector}).outputs

    def emission(self, color, strength=1.0):
        if isinstance(color, tuple):
            color = (*color, 1)
        return self.add("ShaderNodeEmission", {"Color": color, "Strength": strength}).outputs["Emission"]

    def transparent(self, color=(1, 1, 1)):
        return self.add("ShaderNodeBsdfTransparent", {"Color": (*color, 1)}).outputs["BSDF"]

    def mirror(self, roughness):
        return self.add("ShaderNodeBsdfGlossy", {"Roughness": roughness}).outputs["BSDF"]

    def mix(self, share, first, second):
        """Two shaders; share: of the second."""
        return self.add("ShaderNodeMixShader", {0: share, 1: first, 2: second}).outputs["Shader"]

    def end(self, surface):
        self.add("ShaderNodeOutputMaterial", {"Surface": surface})

    def surface(self):
        """What a finished material shows."""
        return self.tree.nodes["Material Output"].inputs["Surface"].links[0].from_socket

    def replace_surface(self, surface):
        self.tree.links.new(surface, self.tree.nodes["Material Output"].inputs["Surface"])

    def math(self, operation, first, second=0.0):
        return self.add("ShaderNodeMath", {0: first, 1: second}, operation=operation).outputs[0]

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
    value = nodes.add("ShaderNodeTexNoise", {"Vector": nodes.position(), "Scale": scale, "Detail": 2.0}).outputs["Fac"]
    return nodes.ramp(value, [(0.3, (low,) * 3), (0.7, (high,) * 3)])


def checker(scale, first, second):
    def pattern(nodes):
        color = nodes.add("ShaderNodeTexChecker", {"Vector": nodes.position(), "Scale": scale, "Color1": (*first, 1),
                                                   "Color2": (*second, 1)}).outputs["Color"]
        return nodes.times(color, noise(nodes, scale * 2.5))
    return pattern


def bricks(scale, first, second, mortar, plane="xz"):
    """Courses of bricks in the plane given; the third axis is not seen."""
    def pattern(nodes):
        axes = nodes.axes(nodes.position())
        flat = nodes.add("ShaderNodeCombineXYZ", {"X": axes[plane[0].upper()], "Y": axes[plane[1].upper()]})
        color = nodes.add("ShaderNodeTexBrick",
                          {"Vector": flat.outputs["Vector"], "Scale": scale, "Color1": (*first, 1),
                           "Color2": (*second, 1), "Mortar": (*mortar, 1), "Mortar Size": 0.025}).outputs["Color"]
        return nodes.times(color, noise(nodes, scale * 6))
    return pattern


def stripes(scale, first, second, axis="X", rings=False):
    """Two colors in turn; rings: about the axis instead of along it."""
    def pattern(nodes):
        kind = {"wave_type": "RINGS", "rings_direction": axis} if rings else \
            {"wave_type": "BANDS", "bands_direction": axis}
        value = nodes.add("ShaderNodeTexWave", {"Vector": nodes.position(), "Scale": scale}, **kind).outputs["Fac"]
        color = nodes.ramp(value, [(0.46, first), (0.54, second)])
        return nodes.times(color, noise(nodes, scale * 4, 0.75, 1.15))
    return pattern


def mosaic(scale, colors):
    """Cells of random colors with dark joints."""
    def pattern(nodes):
        where = nodes.position()
        cell = nodes.add("ShaderNodeTexVoronoi", {"Vector": where, "Scale": scale})
        joint = nodes.add("ShaderNodeTexVoronoi", {"Vector": where, "Scale": scale}, feature="DISTANCE_TO_EDGE")
        value = nodes.axes(cell.outputs["Color"])["X"]
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


def _new_material(name, wrapped=False):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.cycles.sample_as_light = False  # what glows is seen and lights nothing
    return made, Nodes(made.node_tree, wrapped=wrapped)


def paint(name, pattern, gloss=0.0, ambient=0.25, wrapped=False):
    """Diffuse and, by the share `gloss`, a mirror of roughness 0.25; ambient: share that glows;
    wrapped: the pattern is one of texture coordinates."""
    made, nodes = _new_material(name, wrapped)
    color = pattern(nodes)
    up = nodes.axes(nodes.add("ShaderNodeNewGeometry").outputs["Normal"])["Z"]
    sky = nodes.add("ShaderNodeMapRange", {"Value": up, "From Min": -1.0, "From Max": 1.0, "To Min": 0.4 * ambient,
                                           "To Max": 1.6 * ambient}).outputs["Result"]
    surface = nodes.add("ShaderNodeBsdfDiffuse", {"Color": color}).outputs["BSDF"]
    if gloss > 0:
        surface = nodes.mix(gloss, surface, nodes.mirror(0.25))
    both = nodes.add("ShaderNodeAddShader", {0: surface, 1: nodes.emission(color, sky)}).outputs["Shader"]
    nodes.end(both)
    return made


def leaf(name, color, gloss=0.0):
    """A leaf of toothed leaflets on a stalk, cut out of a sheet by its texture: alpha is 0 or 1.
    The stalk runs from place (0.5, 0) to (0.5, 1)."""
    made = paint(name, plain(color, 60), gloss)
    nodes = Nodes(made.node_tree, clear=False)
    places = nodes.axes(nodes.add("ShaderNodeTexCoord").outputs["UV"])
    x, y = places["X"], places["Y"]
    aside = nodes.math("ABSOLUTE", nodes.math("SUBTRACT", nodes.math("MULTIPLY", x, 2.0), 1.0))
    whole = nodes.math("SINE", nodes.math("MULTIPLY", y, pi))
    slant = nodes.math("SUBTRACT", y, nodes.math("MULTIPLY", aside, 0.25))
    lobes = nodes.math("ABSOLUTE", nodes.math("SINE", nodes.math("MULTIPLY", slant, 6 * pi)))
    reach = nodes.math("MULTIPLY", whole, nodes.math("ADD", nodes.math("MULTIPLY", lobes, 0.75), 0.12))
    inside = nodes.math("LESS_THAN", aside, nodes.math("MAXIMUM", reach, 0.05))
    nodes.replace_surface(nodes.mix(inside, nodes.transparent(), nodes.surface()))
    return made


def glass(name, color, index=1.45):
    """Clear, refracting and reflecting. Lets the light of lamps through straight on, tinted."""
    made, nodes = _new_material(name)
    body = nodes.add("ShaderNodeBsdfGlass", {"Color": (*color, 1), "Roughness": 0.0, "IOR": index}).outputs["BSDF"]
    clear = nodes.transparent(color)
    shadow = nodes.add("ShaderNodeLightPath").outputs["Is Shadow Ray"]
    nodes.end(nodes.mix(shadow, body, clear))
    return made


def veil(name, color, opacity):
    """A thin sheet or a drop: its color glows, the rest is seen through."""
    made, nodes = _new_material(name)
    nodes.end(nodes.mix(opacity, nodes.transparent(), nodes.emission(color)))
    return made


def mirrored(made, share, least=0.03, roughness=0.0):
    """Adds a mirror over a material, by `share` of Fresnel's amount and `least` more."""
    nodes = Nodes(made.node_tree, clear=False)
    shown, mirror = nodes.surface(), nodes.mirror(roughness)
    fresnel = nodes.add("ShaderNodeFresnel", {"IOR": 1.5}).outputs["Fac"]
    amount = nodes.math("MINIMUM", nodes.math("ADD", nodes.math("MULTIPLY", fresnel, share), least), 1.0)
    nodes.replace_surface(nodes.mix(amount, shown, mirror))
    return made


def haze(name, color, per_meter):
    """A volume that takes light away and glows by itself: no noise, as nothing is scattered. A
    mesh of it fogs what is behind; far inside it everything has the color."""
    made, nodes = _new_material(name)
    dim = nodes.add("ShaderNodeVolumeAbsorption", {"Color": (0, 0, 0, 1), "Density": per_meter}).outputs["Volume"]
    glow = nodes.emission(color, per_meter)
    both = nodes.add("ShaderNodeAddShader", {0: dim, 1: glow}).outputs["Shader"]
    nodes.add("ShaderNodeOutputMaterial", {"Volume": both})
    return made


def lamp(name, color, strength):
    """A surface of one color and radiance from all sides."""
    made, nodes = _new_material(name)
    nodes.end(nodes.emission(color, strength))
    return made
