"""Render Layer Behind: renders, for each rendered frame, the first surface behind the one that each pixel
shows. Motion and lens uncover these surfaces."""
import os

import bpy

from . import camera, command, filter as filtering, prepare


def check(scene):
    """Raises CommandError if the scene can have no layer behind."""
    if scene.render.engine != "CYCLES":
        raise command.CommandError("the layer behind needs Cycles: choose it as the render engine")
    if scene.render.use_multiview:
        raise command.CommandError("the layer behind knows one eye only: Output properties, Stereoscopy off")


def render(pattern, frames, layer):
    """Runs in a Blender of its own, on a copy of the file. pattern: of the rendered frames."""
    scene = bpy.context.scene
    prepare.apply(scene)
    scene.render.use_file_extension = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.cycles.transparent_max_bounces = min(scene.cycles.transparent_max_bounces + 32, 1024)
    # The pixel alone, because what the adjacent pixel hides may be another surface.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    frame_files, peeled = filtering.on_disk(pattern), None
    for frame in frames:
        try:
            from . import peel
            depths = peel.depths_of(frame_files[frame], layer)
        except ImportError as error:
            raise command.CommandError(
                f"Blender's Python has no module {error.name}. A distribution's Blender uses the system's Python: "
                "install OpenImageIO and NumPy for it. Blender of blender.org has both from 3.5 on") from None
        peeled = peeled or peel.Peel(*reversed(depths.shape))
        scene.frame_set(frame)
        peeled.show(depths)
        path = filtering.layer_behind(frame_files[frame])
        scene.render.filepath = path + ".tmp"
        bpy.ops.render.render(write_still=True)
        os.replace(path + ".tmp", path)


class POSTCHAIN_OT_behind(command.JobOperator, bpy.types.Operator):
    """Renders what is behind the surfaces of the rendered frames: those that lack this layer, or all
    again if none does. Filter reads it. Esc cancels"""
    bl_idname = "postchain.behind"
    bl_label = "Render Layer Behind"
    bl_options = {"REGISTER", "UNDO"}

    def steps(self, context):
        scene = context.scene
        filtering.check(self, scene)
        filtering.check_format(scene)
        check(scene)
        pattern = filtering.files(scene)
        frames = camera.scene_frames(scene)
        filtering.check_rendered(pattern, frames)
        lacking = filtering.without_layer_behind(pattern, frames) or frames
        self._folder = os.path.dirname(filtering.layer_behind(pattern))
        os.makedirs(self._folder, exist_ok=True)
        call = f"behind.render({pattern!r}, {lacking}, {filtering.view_layer(scene)!r})"
        self._count = len(lacking)
        unfinished = [filtering.layer_behind(filtering.on_disk(pattern)[frame]) + ".tmp" for frame in lacking]
        return [command.blender("Render layer behind", call, images=self._count, temporary=unfinished)]

    def done(self, context, job):
        context.scene.postchain.behind = True
        return f"the layer behind {self._count} frame{'s is' if self._count > 1 else ' is'} in {self._folder}"


CLASSES = (POSTCHAIN_OT_behind,)
