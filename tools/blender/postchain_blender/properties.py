"""The chain as properties of the scene: a shipped chain, the order, the samples, and every parameter of
the passes, made from the tables that the command printed when this package was built."""
import json
import pkgutil
import re

import bpy

SHIPPED = {
    "balanced": ("Balanced", "28 samples and the frames before and after, then FXAA: the lowest error for its time"),
    "fast": ("Fast", "15 samples, each frame alone"),
    "best": ("Best", "128 samples, without FXAA: for renders that have little noise"),
    "paper": ("Paper", "motion blur and depth of field of published filters, for comparison only"),
    "dof_first": ("Paper, lens first", "the same in the order most engines use, for comparison only"),
}
# Motion blur and depth of field in two passes, in the quality of a shipped chain.
MOTION = {"fast": {"samples": 9}, "balanced": {}, "best": {"path_px_per_time": 0.5}}
ORDERS = {
    "JOINT": ("Together", "shutter and lens in one pass: the lowest error"),
    "LENS_MOTION": ("Lens, then motion", "depth of field first; each pass can be set by itself"),
    "MOTION_LENS": ("Motion, then lens", "motion blur first; each pass can be set by itself"),
    "MOTION": ("Motion blur only", "no depth of field"),
    "LENS": ("Depth of field only", "no motion blur"),
}


def _read(name):
    return pkgutil.get_data(__package__, name).decode("utf-8")  # also from the zip


def shipped(name):
    """[(pass, {key: value})] of a shipped chain: its file has one pass a line."""
    passes = []
    for line in _read(f"chains/{name}.yaml").splitlines():
        found = re.fullmatch(r"  - (\w+)(?:: \{(.*)\})?", line)
        if not found:
            continue
        values = {}
        for pair in filter(None, (found[2] or "").split(", ")):
            key, value = pair.split(": ")
            values[key] = json.loads(value) if re.fullmatch(r"-?[\d.]+|true|false", value) else value
        passes.append((found[1], values))
    return passes


def blurs(scene):
    """Whether the scene's chain has depth of field, and motion blur."""
    names = {name for name, _ in chain(scene)["passes"]}
    return {"lens": bool(names & {"joint_blur", "depth_of_field"}),
            "motion": bool(names & {"joint_blur", "motion_blur"})}


def chain(scene):
    """{"postchain": 1, "passes": [(pass, {key: value})]} of the scene's properties."""
    settings = scene.postchain
    passes = shipped(settings.preset)
    if settings.preset in MOTION:
        passes = _ordered(settings, passes)
    for name, values in passes:
        if settings.samples and _reads_samples(name, values):
            # Motion blur has its samples on both sides of the frame's own time.
            values["samples"] = settings.samples | 1 if name == "motion_blur" else settings.samples
        values.update(_own_values(getattr(settings, name)))
    return {"postchain": 1, "passes": passes}


def automatic_samples(scene):
    """Samples of the first pass that reads them, as the quality sets them."""
    return next(values["samples"] for name, values in shipped(scene.postchain.preset) if "samples" in values)


def effective(scene, name):
    """{key: value} of a pass in the scene's chain: the chain's values and the defaults. None: unset."""
    values = dict(getattr(scene.postchain, name).defaults)
    for one, own in chain(scene)["passes"]:
        if one == name:
            values.update(own)
    return values


def _reads_samples(name, values):
    return name in ("joint_blur", "motion_blur") or (
        name == "depth_of_field" and values.get("method") != "gilham")


def _ordered(settings, passes):
    """The passes of a tier with its joint blur in the chosen order."""
    joint, rest = passes[0][1], passes[1:]
    if settings.order == "JOINT":
        return passes
    both = {key: joint[key] for key in ("neighbors", "starts") if key in joint}
    motion = ("motion_blur", {**both, **MOTION[settings.preset]})
    lens = ("depth_of_field", {**both, "samples": joint["samples"]})
    return {"LENS_MOTION": [lens, motion], "MOTION_LENS": [motion, lens], "MOTION": [motion],
            "LENS": [lens]}[settings.order] + rest


def chain_text(content, neighbors=None):
    """A chain file. neighbors: for each pass that has this parameter, at most these frames."""
    passes = []
    for name, values in content["passes"]:
        if neighbors and values.get("neighbors") != "none" and _has_neighbors(name, values):
            values = {**values, "neighbors": neighbors}
        passes.append({name: values})
    return json.dumps({"postchain": 1, "passes": passes}, indent=1) + "\n"


def _has_neighbors(name, values):
    method = {"joint_blur": None, "motion_blur": "mode", "depth_of_field": "method"}
    return name in method and values.get(method[name], "inverse_warp") == "inverse_warp"


def _own_values(group):
    """{key: value} of the parameters that are set by hand: for the others the chain decides."""
    values = {}
    for key, kind in group.kinds.items():
        if group.is_property_set(key):
            value = getattr(group, key)
            if kind == "list":
                value = list(value)
            elif kind == "allowed":
                value = int(value)
            values[key] = value
    return values


def _property(row):
    """A property of Blender for a parameter of a pass."""
    unset = f"; otherwise {row['unset_means']}" if row.get("unset_means") else ""
    text = f"{row['help']} ({row['unit'] + '; ' if row['unit'] else ''}{row['domain']}{unset})"
    options = {"name": row["key"].replace("_", " ").capitalize(), "description": text}
    limits = {}
    if "min" in row:
        limits["min"] = row["min"]
    if "max" in row and row["max"] <= 2**31 - 1:
        limits["max"] = row["max"]
    default, kind = row.get("default"), _kind(row)
    if kind in ("choice", "allowed"):
        items = [(str(word), str(word), "") for word in row.get("choices") or row["allowed"]]
        return bpy.props.EnumProperty(**options, items=items,
                                      default=items[0][0] if default is None else str(default))
    if kind == "boolean":
        return bpy.props.BoolProperty(**options, default=bool(default))
    if kind == "text":
        return bpy.props.StringProperty(**options)
    if kind == "list":
        return bpy.props.FloatVectorProperty(**options, **limits, size=2)
    default = row.get("min", 0) if default is None else default
    if kind == "integer":
        return bpy.props.IntProperty(**options, **limits, default=default)
    return bpy.props.FloatProperty(**options, **limits, precision=3, default=default)


def _kind(row):
    if "choices" in row:
        return "choice"
    if "allowed" in row:
        return "allowed"
    return {"point": "list"}.get(row["type"], row["type"])


def tables():
    """The tables of parameters, of the command that this package was built with."""
    return json.loads(_read("passes.json"))


def _pass_class(name, rows):
    members = {"__annotations__": {row["key"]: _property(row) for row in rows},
               "kinds": {row["key"]: _kind(row) for row in rows},
               "defaults": {row["key"]: row.get("default") for row in rows}}
    return type(f"POSTCHAIN_PG_{name}", (bpy.types.PropertyGroup,), members)


class POSTCHAIN_PG_change(bpy.types.PropertyGroup):
    """A setting that Prepare has changed."""
    camera: bpy.props.PointerProperty(type=bpy.types.Camera)
    path: bpy.props.StringProperty()
    before: bpy.props.StringProperty()
    now: bpy.props.StringProperty()
    text: bpy.props.StringProperty()


def _items(table):
    return [(name, title, text) for name, (title, text) in table.items()]


def _settings_class(passes):
    """The class has a group for each pass, so it is made when the passes are known."""
    class POSTCHAIN_PG_settings(bpy.types.PropertyGroup):
        preset: bpy.props.EnumProperty(name="Quality", items=_items(SHIPPED), default="balanced",
                                       description="Shipped chain")
        order: bpy.props.EnumProperty(name="Order", items=_items(ORDERS), default="JOINT",
                                      description="Passes of the chain, and their order")
        samples: bpy.props.IntProperty(
            name="Samples", min=0, max=1023, default=0,
            description="Samples of a pixel over shutter and lens; 0: automatic, as the quality sets them")
        cryptomatte: bpy.props.BoolProperty(
            name="Cryptomatte", description="Prepare also switches on object cryptomattes, and Filter "
                                            "blurs their coverage like the image")
        behind: bpy.props.BoolProperty(
            name="Layer behind", description="Filter also reads what Render Layer Behind has written")
        output: bpy.props.StringProperty(
            name="Output", subtype="DIR_PATH", default="//filtered",
            description="Folder of the filtered frames; // is the folder of this file")
        existing: bpy.props.EnumProperty(
            name="Existing frames", default="skip",
            items=[("skip", "Keep", "Keep frames of the same chain and input, make the others"),
                   ("overwrite", "Replace", "Make every frame again"),
                   ("fail", "Refuse", "Stop before the first if one exists")])
        result: bpy.props.EnumProperty(
            name="Show", default="EDITOR",
            items=[("EDITOR", "Image editor", "Input and result side by side in image editors"),
                   ("NODE", "Compositor", "An image node with the result in the compositor"),
                   ("NONE", "Nowhere", "Only write the files")])
        truth_samples: bpy.props.IntProperty(
            name="Samples", min=1, max=65536, default=256,
            description="Samples of Cycles for the ground truth")
        comparison: bpy.props.StringProperty(options={"HIDDEN"})  # JSON of the last comparison
        changes: bpy.props.CollectionProperty(type=POSTCHAIN_PG_change)

    for name, made in passes.items():
        POSTCHAIN_PG_settings.__annotations__[name] = bpy.props.PointerProperty(type=made)
    return POSTCHAIN_PG_settings


class POSTCHAIN_OT_own(bpy.types.Operator):
    """Sets this parameter by hand, beginning with its present value"""
    bl_idname = "postchain.own"
    bl_label = "Set"
    bl_options = {"REGISTER", "UNDO"}
    name: bpy.props.StringProperty()  # of the pass; empty: samples of all passes
    key: bpy.props.StringProperty()

    def execute(self, context):
        if not self.name:
            context.scene.postchain.samples = automatic_samples(context.scene)
            return {"FINISHED"}
        group = getattr(context.scene.postchain, self.name)
        value = effective(context.scene, self.name).get(self.key)
        if value is None:
            value = getattr(group, self.key)
        setattr(group, self.key, str(value) if group.kinds[self.key] == "allowed" else value)
        return {"FINISHED"}


class POSTCHAIN_OT_reset(bpy.types.Operator):
    """Leaves this parameter to the chain, or all of the pass"""
    bl_idname = "postchain.reset"
    bl_label = "Reset"
    bl_options = {"REGISTER", "UNDO"}
    name: bpy.props.StringProperty()  # of the pass; empty: samples of all passes
    key: bpy.props.StringProperty()

    def execute(self, context):
        if not self.name:
            context.scene.postchain.property_unset("samples")
            return {"FINISHED"}
        group = getattr(context.scene.postchain, self.name)
        for key in [self.key] if self.key else group.kinds:
            group.property_unset(key)
        return {"FINISHED"}


_registered = []


def register():
    found = tables()
    passes = {one["name"]: _pass_class(one["name"], one["parameters"] + found["every_pass"])
              for one in found["passes"]}
    settings = _settings_class(passes)
    for made in (POSTCHAIN_PG_change, *passes.values(), settings, POSTCHAIN_OT_own,
                 POSTCHAIN_OT_reset):
        bpy.utils.register_class(made)
        _registered.append(made)
    bpy.types.Scene.postchain = bpy.props.PointerProperty(type=settings)


def unregister():
    del bpy.types.Scene.postchain
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
