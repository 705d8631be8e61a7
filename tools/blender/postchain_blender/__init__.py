"""postchain in Blender: motion blur, depth of field and anti-aliasing of rendered frames."""

bl_info = {
    "name": "postchain",
    "author": "The authors of postchain",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Output > postchain",
    "description": "Motion blur, depth of field and anti-aliasing of rendered frames",
    "category": "Render",
}

import bpy  # noqa: E402

from . import behind, camera, command, compare, filter, panel, prepare, properties  # noqa: E402,F401


class POSTCHAIN_preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    command: bpy.props.StringProperty(
        name="Command", subtype="FILE_PATH",
        description="Path of the program postchain; empty: it is searched for in PATH and ~/.local/bin")

    device: bpy.props.EnumProperty(
        name="Device", default="auto",
        items=[("auto", "Automatic", "The first GPU, otherwise the CPU with a warning"),
               ("gpu", "GPU", "The first GPU, otherwise an error"),
               ("software", "CPU", "The software renderer")])

    def draw(self, context):
        self.layout.prop(self, "command")
        self.layout.prop(self, "device")


CLASSES = (POSTCHAIN_preferences, *prepare.CLASSES, *filter.CLASSES, *behind.CLASSES, *compare.CLASSES,
           *panel.CLASSES)


def register():
    properties.register()
    bpy.types.WindowManager.postchain_outcome = bpy.props.StringProperty(options={"SKIP_SAVE"})
    for made in CLASSES:
        bpy.utils.register_class(made)


def unregister():
    command.cancel_all()
    for made in reversed(CLASSES):
        bpy.utils.unregister_class(made)
    del bpy.types.WindowManager.postchain_outcome
    properties.unregister()
