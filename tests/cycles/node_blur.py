"""A frame through Blender's Vector Blur and Defocus nodes; runs inside Blender."""
import bpy

ORDERS = ("lens_motion", "motion_lens")
FACTORS = (0.35, 0.5, 0.6, 0.7, 0.85, 1)
STOPS = (0.7, 0.85, 1, 1.2, 1.4)  # times that of a thin lens
BOKEH = {3: "TRIANGLE", 4: "SQUARE", 5: "PENTAGON", 6: "HEXAGON", 7: "HEPTAGON", 8: "OCTAGON"}


class NodeBlur:
    """path: a multilayer EXR. The scene has its camera and size."""

    def __init__(self, scene, path):
        self.scene = scene
        scene.use_nodes = scene.render.use_compositing = True
        self.tree = scene.node_tree
        self.tree.nodes.clear()
        self.source = self.tree.nodes.new("CompositorNodeImage")
        self.source.image = bpy.data.images.load(path)
        self.blur = self.tree.nodes.new("CompositorNodeVecBlur")
        self.blur.samples, self.blur.speed_max = 128, 0
        self.defocus = self.tree.nodes.new("CompositorNodeDefocus")
        self.defocus.use_zbuffer, self.defocus.use_preview, self.defocus.scene = True, False, scene
        self.defocus.threshold, self.defocus.blur_max = 1, 100
        dof = scene.camera.data.dof
        self.defocus.bokeh = BOKEH.get(dof.aperture_blades, "CIRCLE")
        self.defocus.angle = dof.aperture_rotation
        # With this stop the node is a thin lens. It is one by itself in 4.3; in 3.4 it takes the camera's width for a
        # meter. Versions between have not been measured.
        is_thin_lens = bpy.app.version >= (4, 2, 0)
        self.thin_lens = dof.aperture_fstop * (1 if is_thin_lens else 1000 / scene.camera.data.sensor_width)
        self.result = self.tree.nodes.new("CompositorNodeComposite")
        for node in (self.blur, self.defocus):
            self.tree.links.new(self.source.outputs["Depth"], node.inputs["Z"])
        self.tree.links.new(self.source.outputs["Vector"], self.blur.inputs["Speed"])
        image = scene.render.image_settings
        image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"

    def render(self, path, order, factor=0.5, curved=False, stop=1):
        """order: of ORDERS, or one of "lens" and "motion"."""
        self.blur.factor, self.blur.use_curved = factor, curved
        self.defocus.f_stop = self.thin_lens * stop
        last = self.source.outputs["Combined"]
        for one in order.split("_"):
            node = self.defocus if one == "lens" else self.blur
            self.tree.links.new(last, node.inputs["Image"])
            last = node.outputs["Image"]
        self.tree.links.new(last, self.result.inputs["Image"])
        self.scene.render.filepath = path
        bpy.ops.render.render(write_still=True)
