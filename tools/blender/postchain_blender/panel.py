"""The panel in Output properties."""
import json
import textwrap

import bpy

from . import command, compare, prepare, properties, versions


def _text(context, layout, text, icon="NONE"):
    """Text in as many lines as the panel's width needs."""
    width = max(24, int(context.region.width / (7 * context.preferences.system.ui_scale)) - 4)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in text.splitlines():
        for part in textwrap.wrap(line, width) or [""]:
            column.label(text=part, icon=icon)
            icon = "BLANK1" if icon != "NONE" else icon


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "output"


class POSTCHAIN_PT_main(_Panel, bpy.types.Panel):
    bl_label = "postchain"

    def draw(self, context):
        layout, scene = self.layout, context.scene
        settings = scene.postchain
        try:
            command.path()
        except command.CommandError as error:
            _text(context, layout, str(error), "ERROR")
        lacking = prepare.missing(scene)
        row = layout.row(align=True)
        row.operator("postchain.prepare", icon="CHECKMARK" if not lacking else "MODIFIER")
        row.operator("postchain.put_back", icon="LOOP_BACK")
        layout.prop(settings, "cryptomatte")
        if lacking:
            _text(context, layout, "Prepare will set: " + "; ".join(row[3] for row in lacking), "INFO")
        elif settings.changes:
            _text(context, layout, "Prepared: " + "; ".join(one.text for one in settings.changes),
                  "CHECKMARK")
        for wrong, text in prepare.problems(scene, **properties.blurs(scene)):
            _text(context, layout, text, "CANCEL" if wrong else "ERROR")
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(settings, "output")
        column.prop(settings, "existing")
        column.prop(settings, "result")
        row = column.row(align=True)
        row.prop(settings, "behind")
        row.operator("postchain.behind", text="Render", icon="RENDERLAYERS")
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.operator("postchain.filter", text="Filter Sequence", icon="SEQUENCE").source = "SEQUENCE"
        row.operator("postchain.filter", text="Preview Frame", icon="HIDE_OFF").source = "FRAME"
        row.operator("postchain.filter", text="Filter Render", icon="IMAGE_DATA").source = "RENDER"
        icon, _, text = context.window_manager.postchain_outcome.partition("\n")
        if text:
            _text(context, layout.box(), text, {"ERROR": "CANCEL", "WARNING": "ERROR"}.get(icon, icon))


class POSTCHAIN_PT_chain(_Panel, bpy.types.Panel):
    bl_label = "Chain"
    bl_parent_id = "POSTCHAIN_PT_main"

    def draw(self, context):
        scene, layout = context.scene, self.layout
        settings = scene.postchain
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "preset")
        row = layout.row()
        row.active = settings.preset in properties.MOTION
        row.prop(settings, "order")
        _parameter(layout, settings, "samples", settings.samples != 0, "automatic", pass_name="")
        layout.prop(scene.render, "motion_blur_shutter", text="Shutter (frames)")
        if not (scene.camera and scene.camera.type == "CAMERA"):
            return
        dof = scene.camera.data.dof
        layout.prop(dof, "aperture_fstop", text="F-Stop")
        layout.prop(dof, "focus_object")
        row = layout.row(align=True)
        row.active = dof.focus_object is None
        row.prop(dof, "focus_distance")
        if versions.eyedropper_takes_a_path():
            row.operator("ui.eyedropper_depth", icon="EYEDROPPER",
                         text="").prop_data_path = "scene.camera.data.dof.focus_distance"
        elif dof.focus_object is None:
            _text(context, layout, "Press E over the distance to pick it in a view", "EYEDROPPER")


class POSTCHAIN_PT_compare(_Panel, bpy.types.Panel):
    bl_label = "Ground Truth"
    bl_parent_id = "POSTCHAIN_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, settings = self.layout, context.scene.postchain
        row = layout.row(align=True)
        row.prop(settings, "truth_samples")
        row.operator("postchain.compare", text="Compare", icon="RENDER_STILL")
        if not settings.comparison:
            return
        found = json.loads(settings.comparison)
        grid = layout.grid_flow(row_major=True, columns=1 + len(compare.SHOWN), even_columns=True)
        grid.label(text=f"Frame {found['frame']}")
        for title, _ in compare.SHOWN.values():
            grid.label(text=title)
        for row in found["rows"]:
            for text in row:
                grid.label(text=text.replace("_", " "))
        layout.operator("wm.path_open", text="Open Report", icon="URL").filepath = found["page"]


def _parameter(layout, group, key, is_set, value, pass_name):
    """A row: the property if it is set by hand, with a cross; otherwise the value that is used, with a pen."""
    if is_set:
        row = layout.row(align=True)
        row.prop(group, key)
        button = row.operator("postchain.reset", text="", icon="X")
    else:
        split = layout.split(factor=0.4)
        column = split.row()
        column.alignment = "RIGHT"
        column.label(text=group.bl_rna.properties[key].name)
        row = split.row(align=True)
        shown = row.row()
        shown.active = False
        shown.label(text=value)
        button = row.operator("postchain.own", text="", icon="GREASEPENCIL")
    button.name, button.key = pass_name, key


def _parameters_panel(name, title):
    """The panel of every parameter of a pass: those that are set by hand, and the chain's values of
    the others."""
    def poll(cls, context):
        return any(one == name for one, _ in properties.chain(context.scene)["passes"])

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        group = getattr(context.scene.postchain, name)
        values = properties.effective(context.scene, name)
        layout.operator("postchain.reset", text="Reset All", icon="LOOP_BACK").name = name
        for key in group.kinds:
            _parameter(layout, group, key, group.is_property_set(key),
                       "automatic" if values[key] is None else str(values[key]), name)
    return type(f"POSTCHAIN_PT_{name}", (_Panel, bpy.types.Panel), {
        "bl_label": title, "bl_parent_id": "POSTCHAIN_PT_chain", "bl_options": {"DEFAULT_CLOSED"},
        "poll": classmethod(poll), "draw": draw})


CLASSES = (POSTCHAIN_PT_main, POSTCHAIN_PT_chain, POSTCHAIN_PT_compare,
           *(_parameters_panel(one["name"], one["title"]) for one in properties.tables()["passes"]))
