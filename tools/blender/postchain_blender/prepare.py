"""Prepare: sets what a render for postchain needs, lists the changes, and puts them back. The state is in
the scene, so it survives saving, loading and undo."""
import json
import os
import re

import bpy

from . import simulation, versions
from .camera import camera_at

LOSSY = {"DWAA", "DWAB", "B44", "B44A", "PXR24"}  # of depth and motion vectors too
PASSES = {"use_pass_z": "depth pass", "use_pass_vector": "motion vector pass",
          "use_pass_cryptomatte_object": "cryptomatte pass"}


def cameras(scene):
    """The cameras that the scene renders with: its own, and the markers' in the frame range."""
    starts = {scene.frame_start} | {marker.frame for marker in scene.timeline_markers
                                    if scene.frame_start < marker.frame <= scene.frame_end}
    found = [scene.camera] + [camera_at(scene, frame) for frame in sorted(starts)]
    return list(dict.fromkeys(one for one in found if one and one.type == "CAMERA"))


def wanted(scene):
    """[(camera or None, path of the property, value, text)]: what a render for postchain needs.
    The order matters: a file format has its own color depths."""
    found = []
    for layer in scene.view_layers:
        if not layer.use:
            continue
        base = f'view_layers["{bpy.utils.escape_identifier(layer.name)}"]'
        names = ["use_pass_z", "use_pass_vector"]
        if scene.postchain.cryptomatte:
            names.append("use_pass_cryptomatte_object")
        found += [(None, f"{base}.{name}", True, f"{layer.name}: {PASSES[name]} on")
                  for name in names]
        if scene.postchain.cryptomatte:
            levels = max(6, layer.pass_cryptomatte_depth)
            found.append((None, f"{base}.pass_cryptomatte_depth", levels,
                          f"{layer.name}: {levels} cryptomatte levels"))
    found.append((None, "render.use_motion_blur", False, "motion blur of the renderer off"))
    if path := versions.eevee_motion_blur_path(scene):
        found.append((None, path, False, "motion blur of EEVEE off"))
    for camera in cameras(scene):
        found.append((camera.data, "dof.use_dof", False, f"{camera.data.name}: depth of field off"))
    image = "render.image_settings"
    settings = scene.render.image_settings
    if path := versions.media_type_path(scene):
        found.append((None, path, "MULTI_LAYER_IMAGE", "media type multilayer image"))
    found.append((None, f"{image}.file_format", "OPEN_EXR_MULTILAYER",
                  "file format OpenEXR MultiLayer"))
    found.append((None, f"{image}.color_depth", "32", "color depth Float (Full)"))
    if settings.exr_codec in LOSSY:
        found.append((None, f"{image}.exr_codec", "ZIP", "compression ZIP (lossless)"))
    if scene.render.use_multiview:
        found.append((None, f"{image}.views_format", "MULTIVIEW", "both eyes in one file"))
    return found


def missing(scene):
    """The rows of wanted() that the scene lacks."""
    return [row for row in wanted(scene) if _get(scene, row[0], row[1]) != row[2]]


def apply(scene):
    """Sets the rows that are missing() and records the values from before. Returns a text for each change."""
    changes = missing(scene)
    before = [_get(scene, camera, path) for camera, path, _, _ in changes]
    # Indices: Blender moves the items of a collection when one is added.
    recorded = {(change.camera, change.path): index
                for index, change in enumerate(scene.postchain.changes)}
    for (camera, path, value, text), old in zip(changes, before):
        _set(scene, camera, path, value)
        index = recorded.get((camera, path))
        if index is not None:
            change = scene.postchain.changes[index]
        else:
            change = scene.postchain.changes.add()
            change.camera, change.path, change.before = camera, path, json.dumps(old)
        change.now, change.text = json.dumps(value), text
    return [text for _, _, _, text in changes]


def put_back(scene):
    """The values from before Prepare, unless they have been changed since. Returns the texts of
    what was put back, and of what was not."""
    done, left, unchanged = [], [], []
    for change in scene.postchain.changes:  # all are read before one is set: formats change depths
        try:
            same = _get(scene, change.camera, change.path) == json.loads(change.now)
        except (KeyError, ValueError, AttributeError):
            left.append(f"{change.path} no longer exists")
            continue
        if same:
            unchanged.append(change)
        else:
            left.append(f"{change.path} has been changed since")
    for change in unchanged:
        _set(scene, change.camera, change.path, json.loads(change.before))
        done.append(change.path)
    scene.postchain.changes.clear()
    return done, left


def _get(scene, camera, path):
    return (camera or scene).path_resolve(path)


def _set(scene, camera, path, value):
    owner, _, name = path.rpartition(".")
    setattr((camera or scene).path_resolve(owner), name, value)


def _animates(block, path):
    animation = block.animation_data
    return animation is not None and any(curve.data_path == path for curve in versions.curves(animation))


def _named(objects):
    """The names of objects, the first five of many."""
    names = ", ".join(f"'{one.name}'" for one in objects[:5])
    return names + (f" and {len(objects) - 5} more" if len(objects) > 5 else "")


_HELD_STILL = ("Cycles writes this motion into the motion vectors all the same, so the filter blurs it. To hold them "
               "still, tick Cryptomatte and set the pass's Matte to cryptomatte:NAME, Matte effect to unmoved")


def _motion_of_cycles(scene):
    """Texts: differences between Cycles' own motion blur and the filter's in this scene."""
    found = []
    objects = [one for one in scene.objects if one.type != "CAMERA" and not one.hide_render]
    off = [one for one in objects if not one.cycles.use_motion_blur]
    if off:
        found.append(f"Motion Blur is off for {_named(off)}: {_HELD_STILL}")
    off = [one for one in objects if one.cycles.use_motion_blur and not one.cycles.use_deform_motion
           and one.is_deform_modified(scene, "RENDER")]
    if off:
        found.append(f"Deformation (Motion Blur) is off for {_named(off)}: {_HELD_STILL}")
    found += [f"Motion Blur is off for camera '{camera.name}', but its motion blurs the sky: switch it on in Object "
              "properties, Motion Blur, or keep the camera still"
              for camera in cameras(scene) if not camera.cycles.use_motion_blur]
    if scene.cycles.rolling_shutter_type != "NONE":
        found.append("Rolling Shutter is on, but the filter opens the shutter for all rows at once: for equal blur "
                     "set it to None in Render properties, Motion Blur")
    points = scene.render.motion_blur_shutter_curve.curves[0].points
    if any(point.location.y != points[0].location.y for point in points):
        found.append("the Shutter Curve is not constant, but the filter's shutter opens and closes at once: for equal "
                     "blur make it constant in Render properties, Motion Blur")
    return found


def problems(scene, lens, motion):
    """[(error?, text)]: why a render of this scene cannot be filtered, or will look different.
    lens, motion: the chain has depth of field, motion blur."""
    found = []
    render = scene.render

    def error(text):
        found.append((True, text))

    def warning(text):
        found.append((False, text))

    if render.engine == "BLENDER_WORKBENCH":
        error("Workbench has neither depth nor motion vectors: choose Cycles as the render engine")
    if render.engine == "BLENDER_EEVEE" and motion and not versions.eevee_has_motion_vectors():
        error("EEVEE has no motion vectors in this version of Blender: choose Cycles as the render "
              "engine, or the order 'Depth of field only'")
    if not cameras(scene):
        error("the scene has no camera: choose one in Scene properties, Camera")
    for camera in cameras(scene):
        data = camera.data
        if data.type == "PANO":
            error(f"camera '{camera.name}' is panoramic: choose the lens type Perspective")
        if data.type == "ORTHO" and lens:
            error(f"camera '{camera.name}' is orthographic and has no lens: choose the order "
                  "'Motion blur only'")
        if data.dof.use_dof and data.library:
            error(f"camera '{camera.name}' is linked from {data.library.filepath} with depth of field "
                  "on: make a library override of it, or switch depth of field off in that file")
        if _animates(data, "dof.use_dof"):
            error(f"camera '{camera.name}': depth of field is switched by an animation: remove "
                  "its keys")
        if not 0.1 <= data.dof.aperture_ratio <= 10:
            error(f"camera '{camera.name}': aperture ratio {data.dof.aperture_ratio:g} is outside "
                  "0.1 to 10: change it in the camera's properties")
        if data.shift_x or data.shift_y:
            warning(f"camera '{camera.name}' has a shifted lens, so the motion of the sky is approximate while the "
                    "camera turns: for exact motion set Shift to 0 in the camera's properties")
        if data.dof.focus_object is None and data.dof.focus_distance <= 0 and lens:
            error(f"camera '{camera.name}' focuses at distance 0: set its focus distance or object")
    if len(cameras(scene)) > 1:
        warning("markers switch cameras: each shot has a camera file of its own")
    if render.use_sequencer and versions.has_strips(scene):
        error("the sequencer's strips replace the render: Output properties, Post Processing, "
              "Sequencer off")
    if render.use_border and render.use_crop_to_border:
        error("the render is cropped to a region, and the camera file has no place for it: Output "
              "properties, Crop to Render Region off")
    if render.pixel_aspect_x != render.pixel_aspect_y:
        warning(f"the pixel aspect is {render.pixel_aspect_x:g}:{render.pixel_aspect_y:g}, which Blender does not "
                "write into the files. The filter takes pixels for squares, so blur is too wide or too narrow: set both "
                "to 1 in Output properties, Format, Aspect")
    if motion and render.engine == "CYCLES":
        for text in _motion_of_cycles(scene):
            warning(text)
    token = re.search(r"#+|@+|%\d*d|\$F", os.path.basename(render.frame_path(frame=0)))
    if token:
        error(f"the output's file name holds '{token[0]}' beside its frame number, and the command would take it "
              "for a second number: rename the file in Output properties, Output")
    if lacking := simulation.unbaked(scene):
        warning(f"not baked: {', '.join(lacking)}. A render that begins after the first frame shows these simulations "
                "in another state, and Compare and Layer behind refuse them: Physics properties, Cache, Bake All Dynamics")
    if scene.frame_step > 1:
        warning(f"frame step {scene.frame_step}: the frames before and after are not rendered, so surfaces behind a "
                "blur are estimated: for better edges set Step to 1 in Output properties, Frame Range")
    if render.is_movie_format:
        warning("the output is a movie; Prepare makes it a sequence of EXR files")
    return found


class POSTCHAIN_OT_prepare(bpy.types.Operator):
    """Switches on the passes that postchain reads and the file format that holds them, and the
    renderer's own motion blur and depth of field off"""
    bl_idname = "postchain.prepare"
    bl_label = "Prepare"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        scene = context.scene
        found = problems(scene, lens=False, motion=False)
        errors = [text for wrong, text in found if wrong]
        if errors:
            self.report({"ERROR"}, "\n".join(errors))
            return {"CANCELLED"}
        for _, text in found:
            self.report({"WARNING"}, text)
        changed = apply(scene)
        self.report({"INFO"}, "changed: " + "; ".join(changed) if changed else
                    "everything was set already")
        return {"FINISHED"}


class POSTCHAIN_OT_put_back(bpy.types.Operator):
    """Sets what Prepare has changed to the values from before"""
    bl_idname = "postchain.put_back"
    bl_label = "Put Back"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return len(context.scene.postchain.changes) > 0

    def execute(self, context):
        done, left = put_back(context.scene)
        for text in left:
            self.report({"WARNING"}, f"not put back: {text}")
        self.report({"INFO"}, f"{len(done)} settings put back")
        return {"FINISHED"}


CLASSES = (POSTCHAIN_OT_prepare, POSTCHAIN_OT_put_back)
