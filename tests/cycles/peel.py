"""Shows the first surface behind the one that each pixel of a frame shows: materials become transparent
to the camera down to the frame's depth. Shadows, reflections and what glass refracts stay.
"""
import bpy
import numpy as np
import OpenImageIO

import model

ONE_SURFACE = 1.1  # adjacent pixels whose depths differ by less show one surface,
TOLERANCE = 1.005  # and so do depths that differ by less along a ray


def depths_of(path):
    """Rows from the top, meters along the camera's axis."""
    image = OpenImageIO.ImageBuf(path)
    channel = image.spec().channelnames.index("ViewLayer.Depth.Z")
    return OpenImageIO.ImageBufAlgo.channels(image, (channel,)).get_pixels()[:, :, 0]


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


def mark_closed_parts(mesh):
    """Sets the attribute `closed` of the faces of a mesh to 1 in connected parts without an open edge:
    their back faces are insides. Sheets are seen from both sides."""
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
    is_open = {part_of(mesh.edges[edge].vertices[0]) for edge in np.flatnonzero(faces_of == 1)}
    mesh.attributes.new("closed", "FLOAT", "FACE").data.foreach_set(
        "value", [float(part_of(polygon.vertices[0]) not in is_open) for polygon in mesh.polygons])


class Peel:
    """The materials of the scene, made once; show() selects a frame."""

    def __init__(self, width, height):
        self.image = bpy.data.images.new("peel", width, height, float_buffer=True, is_data=True)
        self.image.use_half_precision = False
        for mesh in bpy.data.meshes:
            mark_closed_parts(mesh)
        for material in bpy.data.materials:
            if material.use_nodes:
                self._make_transparent(model.Nodes(material.node_tree, clear=False))

    def _make_transparent(self, nodes):
        surface = nodes.tree.get_output_node("CYCLES").inputs["Surface"]
        if not surface.is_linked:
            return
        shown = surface.links[0].from_socket
        window = nodes.add("ShaderNodeTexCoord").outputs["Window"]
        peeled = nodes.add("ShaderNodeTexImage", {"Vector": window}, image=self.image,
                           interpolation="Closest", extension="EXTEND").outputs["Color"]
        depth = nodes.add("ShaderNodeCameraData").outputs["View Z Depth"]
        is_front = nodes.math("LESS_THAN", depth, peeled)
        is_inside = nodes.math("MULTIPLY", nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"],
                               nodes.add("ShaderNodeAttribute",
                                         attribute_name="closed").outputs["Fac"])
        is_camera = nodes.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
        through = nodes.math("MULTIPLY", nodes.math("MAXIMUM", is_front, is_inside), is_camera)
        clear = nodes.add("ShaderNodeBsdfTransparent").outputs["BSDF"]
        both = nodes.add("ShaderNodeMixShader", {0: through, 1: shown, 2: clear}).outputs["Shader"]
        nodes.tree.links.new(both, surface)

    def show(self, path):
        """Behind the surfaces of the frame of this file."""
        values = depths_to_peel(depths_of(path))[::-1]  # Blender's rows begin at the bottom
        pixels = np.ones((*values.shape, 4), np.float32)
        pixels[:, :, :3] = values[:, :, None]
        self.image.pixels.foreach_set(pixels.ravel())
        self.image.update()
