"""Shows the first surface behind the one that each pixel of a frame shows: materials become transparent
to the camera down to the frame's depth. Shadows, reflections and what glass refracts stay. Imports nothing
else of this package.
"""
import bpy
import numpy as np

ONE_SURFACE = 1.1  # adjacent pixels whose depths differ by less show one surface,
TOLERANCE = 1.005  # and so do depths that differ by less along a ray
CLOSED = "postchain_closed"  # an attribute of faces


def depths_of(path, layer="ViewLayer"):
    """Depths in a multilayer file: rows from the top, meters along the camera's axis. Raises ImportError, or
    OSError if the file or its depth cannot be read."""
    import OpenImageIO  # Blender brings it since 3.5
    file = OpenImageIO.ImageInput.open(path)
    if not file:
        raise OSError(OpenImageIO.geterror())
    spec, name = file.spec(), f"{layer}.Depth.Z"
    if name not in spec.channelnames:
        raise OSError(f"{path}: no channel {name}")
    channel = spec.channelnames.index(name)
    depths = file.read_image(0, 0, channel, channel + 1, "float")
    if depths is None:  # the file is cut off, or damaged
        raise OSError(file.geterror())
    return depths.reshape(spec.height, spec.width)


def depths_to_peel(depths):
    """In each pixel the depth of its surface's farthest point there: a pixel is wider than a point, and
    its surface may be slanted."""
    height, width = depths.shape
    framed = np.pad(depths, 1, mode="edge")
    farthest = depths.copy()
    for y in range(3):
        for x in range(3):
            beside = framed[y:y + height, x:x + width]
            farthest = np.where(beside < depths * ONE_SURFACE, np.maximum(farthest, beside), farthest)
    return farthest * TOLERANCE


def _open_parts(mesh):
    """For each vertex a number of its connected part, and the set of the parts that have an open edge."""
    part = list(range(len(mesh.vertices)))

    def part_of(vertex):
        while part[vertex] != vertex:
            part[vertex] = vertex = part[part[vertex]]
        return vertex

    faces_of = np.zeros(len(mesh.edges), int)
    for polygon in mesh.polygons:
        for key in polygon.loop_indices:
            faces_of[mesh.loops[key].edge_index] += 1
        for vertex in polygon.vertices:
            part[part_of(vertex)] = part_of(polygon.vertices[0])
    return part_of, {part_of(mesh.edges[edge].vertices[0]) for edge in np.flatnonzero(faces_of == 1)}


def mark_closed_parts(thing, graph):
    """Sets the attribute CLOSED of the faces of a mesh object to 1 in connected parts without an open edge:
    their back faces are insides. Sheets are seen from both sides. Modifiers may close all parts."""
    mesh = thing.data
    former = mesh.attributes.get(CLOSED)
    if former:
        mesh.attributes.remove(former)
    part_of, is_open = _open_parts(mesh)
    if is_open and thing.modifiers and not _open_parts(thing.evaluated_get(graph).data)[1]:
        is_open = set()
    mesh.attributes.new(CLOSED, "FLOAT", "FACE").data.foreach_set(
        "value", [float(part_of(polygon.vertices[0]) not in is_open) for polygon in mesh.polygons])


def _make_local():
    """Data of linked libraries cannot be changed."""
    for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.curves, bpy.data.metaballs, bpy.data.materials):
        for block in list(kind):
            if block.library:
                block.make_local()


def _diffuse(material):
    """Makes the nodes that look as Cycles renders a material without nodes."""
    color = material.diffuse_color[:]
    material.use_nodes = True
    material.node_tree.nodes.clear()
    shader = _node(material.node_tree, "ShaderNodeBsdfDiffuse", {"Color": color})["BSDF"]
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(shader, output.inputs["Surface"])


def _give_materials():
    """Surfaces without one are shown in a default material, which cannot become transparent."""
    default = bpy.data.materials.new("postchain_default")
    for thing in bpy.data.objects:
        if thing.type not in {"MESH", "CURVE", "SURFACE", "FONT", "META"}:
            continue
        if not thing.data.materials:
            thing.data.materials.append(default)
        for slot in thing.material_slots:
            if slot.material is None:
                slot.material = default
    for material in bpy.data.materials:
        if not material.use_nodes and not material.is_grease_pencil:
            _diffuse(material)


def _node(tree, kind, inputs=None, **properties):
    """inputs: of the node, by name or index, as sockets or values."""
    node = tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(node, name, value)
    for name, value in (inputs or {}).items():
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, node.inputs[name])
        else:
            node.inputs[name].default_value = value
    return node.outputs


def _math(tree, operation, *inputs):
    return _node(tree, "ShaderNodeMath", dict(enumerate(inputs)), operation=operation)[0]


class Peel:
    """Changes the materials of the file once; show() selects a frame of width x height pixels."""

    def __init__(self, width, height):
        self.image = bpy.data.images.new("peel", width, height, float_buffer=True, is_data=True)
        self.image.use_half_precision = False
        _make_local()
        _give_materials()
        graph = bpy.context.evaluated_depsgraph_get()
        for thing in {one.data: one for one in bpy.data.objects if one.type == "MESH"}.values():
            mark_closed_parts(thing, graph)
        for material in bpy.data.materials:
            if material.use_nodes:
                self._make_transparent(material.node_tree)

    def _make_transparent(self, tree):
        output = tree.get_output_node("CYCLES")
        if output is None or not output.inputs["Surface"].is_linked:
            return
        surface = output.inputs["Surface"]
        shown = surface.links[0].from_socket
        window = _node(tree, "ShaderNodeTexCoord")["Window"]
        peeled = _node(tree, "ShaderNodeTexImage", {"Vector": window}, image=self.image,
                       interpolation="Closest", extension="EXTEND")["Color"]
        depth = _node(tree, "ShaderNodeCameraData")["View Z Depth"]
        is_front = _math(tree, "LESS_THAN", depth, peeled)
        is_inside = _math(tree, "MULTIPLY", _node(tree, "ShaderNodeNewGeometry")["Backfacing"],
                          _node(tree, "ShaderNodeAttribute", attribute_name=CLOSED)["Fac"])
        is_camera = _node(tree, "ShaderNodeLightPath")["Is Camera Ray"]
        through = _math(tree, "MULTIPLY", _math(tree, "MAXIMUM", is_front, is_inside), is_camera)
        clear = _node(tree, "ShaderNodeBsdfTransparent")["BSDF"]
        tree.links.new(_node(tree, "ShaderNodeMixShader", {0: through, 1: shown, 2: clear})["Shader"],
                       surface)

    def show(self, depths):
        """Behind the surfaces at these depths, a frame's depths_of()."""
        values = depths_to_peel(depths)[::-1]  # Blender's rows begin at the bottom
        pixels = np.ones((*values.shape, 4), np.float32)
        pixels[:, :, :3] = values[:, :, None]
        self.image.pixels.foreach_set(pixels.ravel())
        self.image.update()
