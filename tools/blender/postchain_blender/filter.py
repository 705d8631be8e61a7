"""Filter: the finished sequence or the render result, through the command, and its result shown."""
import glob
import os
import re

import bpy

from . import camera, command, prepare, properties, versions


def files(scene):
    """Pattern of the files that the scene renders: the place of the frame number is ####."""
    render = scene.render
    # Read from Blender's own names of two frames, which know extensions and all forms of tokens.
    long, short = (render.frame_path(frame=frame) for frame in (987654, 1))
    folder, name = os.path.split(os.path.abspath(bpy.path.abspath(long)))
    start = name.rfind("987654")
    digits = len(os.path.basename(short)) - len(name) + 6
    return os.path.join(folder, name[:start] + "#" * digits + name[start + 6:])


def beside(pattern, name):
    """Path of another file of the same shot: shot_####.exr -> shot_NAME."""
    folder, file = os.path.split(pattern)
    return os.path.join(folder, file.split("#")[0] + name)


def output_folder(scene):
    return os.path.abspath(bpy.path.abspath(scene.postchain.output) or ".")


def on_disk(pattern):
    """{frame: path} of the files of a pattern."""
    folder, file = os.path.split(pattern)
    before, _, after = re.split("(#+)", file, maxsplit=1)
    found = {}
    for path in glob.glob(os.path.join(glob.escape(folder), "*")):
        match = re.fullmatch(re.escape(before) + r"(-?\d+)" + re.escape(after), os.path.basename(path))
        if match:
            found[int(match[1])] = path
    return found


def layer_behind(path):
    """Path or pattern of the layer behind, for that of a frame: in a folder beside it."""
    folder, name = os.path.split(path)
    return os.path.join(folder, "behind", name)


def without_layer_behind(pattern, frames):
    """Those frames of a pattern that lack their layer behind, or are newer."""
    there, layers = on_disk(pattern), on_disk(layer_behind(pattern))
    return [frame for frame in frames if frame not in layers
            or os.path.getmtime(layers[frame]) < os.path.getmtime(there[frame])]


def ranges(frames):
    """The value of --frames."""
    return ",".join(str(frame) for frame in frames)


def check(operator, scene):
    """Raises CommandError if a render of the scene cannot be filtered. The operator reports what will look
    different."""
    found = prepare.problems(scene, **properties.blurs(scene))
    errors = [text for wrong, text in found if wrong]
    if errors:
        raise command.CommandError("; ".join(errors))
    for _, text in found:
        operator.report({"WARNING"}, text)


def check_rendered(pattern, frames):
    """Raises CommandError if a frame has no file."""
    there = on_disk(pattern)
    missing = [frame for frame in frames if frame not in there]
    if missing:
        raise command.CommandError(
            f"{len(missing)} of {len(frames)} frames have not been rendered (first: "
            f"{missing[0]}): render the animation to {pattern}, or change the frame range")


def check_layer_behind(pattern, frames):
    """Raises CommandError if a frame lacks its layer behind."""
    lacking = without_layer_behind(pattern, frames)
    if lacking:
        raise command.CommandError(
            f"{len(lacking)} of {len(frames)} frames have no layer behind, or one older than the frame "
            f"(first: {lacking[0]}): press Render Layer Behind, or switch Layer behind off")


def check_format(scene):
    if scene.render.image_settings.file_format != "OPEN_EXR_MULTILAYER":
        raise command.CommandError("the file format is not OpenEXR MultiLayer: press Prepare and "
                                   "render again")


def check_motion(scene, path):
    """The command would take the camera's motion for that of all objects."""
    with open(path, "rb") as file:
        header = file.read(1 << 20)
    if properties.blurs(scene)["motion"] and b".Vector." not in header:
        raise command.CommandError(f"{path} has no motion vectors: press Prepare and render again")


def runs(shot, chain):
    """[(frames, chain text)]: the calls for the frames of one camera. shot: (frames, whether a
    cut comes before them, and after them). Across a cut a frame uses no neighbor."""
    frames, before, after = shot
    whole = properties.chain_text(chain)
    single = len(frames) == 1
    parts = [(frames[:1], "none" if before or single and after else None), (frames[1:-1], None),
             ([] if single else frames[-1:], "before" if after else None)]
    found = []
    for part, neighbors in parts:
        text = properties.chain_text(chain, neighbors) if neighbors else whole
        if part and found and found[-1][1] == text:
            found[-1][0].extend(part)
        elif part:
            found.append((list(part), text))
    return found


def steps(scene, pattern, behind, output, frames, existing):
    """The calls of the command for frames of the files of a pattern. behind: pattern of the layer behind, or
    None; existing: value of --on-existing."""
    chain = properties.chain(scene)
    shots = camera.write(beside(output, "camera.json"), scene, frames)
    found = []
    for path, numbers in shots:
        # The files beyond the range may be there, and of another camera.
        shot = numbers, *(camera.camera_at(scene, inside) != camera.camera_at(scene, outside)
                          for inside, outside in ((numbers[0], numbers[0] - 1),
                                                  (numbers[-1], numbers[-1] + 1)))
        for part, text in runs(shot, chain):
            name = beside(output, f"chain{len(found) or ''}.json")
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
            arguments = ["run", name, "-i", pattern, "--camera", path, "--frames=" + ranges(part),
                         "-o", output, "--on-existing", existing]
            if len([layer for layer in scene.view_layers if layer.use]) > 1:
                arguments += ["--view-layer", view_layer(scene)]
            if behind:
                arguments += ["--behind", behind]
            if scene.render.use_multiview:
                arguments += ["--view", "all"]
            if scene.postchain.cryptomatte:
                arguments += ["--cryptomatte", "filter"]
            found.append(command.postchain("Filter", arguments))
    return found


def view_layer(scene):
    """The view layer that is filtered: the active one, or the first that is rendered."""
    active = bpy.context.view_layer
    if scene == bpy.context.scene and active.use:
        return active.name
    return next((layer.name for layer in scene.view_layers if layer.use), scene.view_layers[0].name)


class POSTCHAIN_OT_filter(command.JobOperator, bpy.types.Operator):
    """Filters rendered frames with the chain. Esc cancels"""
    bl_idname = "postchain.filter"
    bl_label = "Filter"
    bl_options = {"REGISTER", "UNDO"}
    source: bpy.props.EnumProperty(
        name="Source", default="SEQUENCE",
        items=[("SEQUENCE", "Sequence", "The rendered frames of the frame range, from their files"),
               ("FRAME", "Preview", "The current frame, from its file and those before and after, into a "
                "temporary folder"),
               ("RENDER", "Render result", "The last render, without the frames before and after")])

    def steps(self, context):
        scene = context.scene
        check(self, scene)
        check_format(scene)
        pattern, behind = files(scene), None
        folder = output_folder(scene)
        if self.source == "RENDER":
            frames = [scene.frame_current]
            pattern = self._save_render(scene, frames[0])
        else:
            frames = camera.scene_frames(scene)
            if self.source == "FRAME":
                frames = [scene.frame_current]
                folder = os.path.join(bpy.app.tempdir, "postchain", "preview")
            check_rendered(pattern, frames)
            if scene.postchain.behind:
                check_layer_behind(pattern, frames)
                behind = layer_behind(pattern)
        self._input, self._frames = pattern, frames
        check_motion(scene, on_disk(pattern)[frames[0]])
        name = os.path.basename(pattern)  # without extension if File Extensions is off
        self._output = os.path.join(folder, name if name.endswith(".exr") else name + ".exr")
        if self._output == pattern:
            raise command.CommandError(f"the folder {folder} is that of the render: choose another "
                                       "output folder in the panel")
        os.makedirs(folder, exist_ok=True)
        # A preview that the same chain has made of the same input is kept.
        existing = "skip" if self.source == "FRAME" else scene.postchain.existing
        return steps(scene, pattern, behind, self._output, frames, existing)

    @staticmethod
    def _save_render(scene, frame):
        """The render result as a file."""
        folder = os.path.join(bpy.app.tempdir, "postchain")
        os.makedirs(folder, exist_ok=True)
        for former in on_disk(os.path.join(folder, "render_####.exr")).values():
            os.remove(former)  # they would be its neighbors
        path = os.path.join(folder, f"render_{frame:04d}.exr")
        result = bpy.data.images.get("Render Result")
        try:
            result.save_render(path, scene=scene)
        except (AttributeError, RuntimeError) as error:  # no such image, or an empty one
            raise command.CommandError("there is no render result: render an image first (F12)"
                                       ) from error
        return os.path.join(folder, "render_####.exr")

    def done(self, context, job):
        made = on_disk(self._output)
        show = made.get(context.scene.frame_current, made.get(self._frames[0]))
        kind = "EDITOR" if self.source == "FRAME" else context.scene.postchain.result
        if show and kind != "NONE":
            image = load(show, self._frames)
            image.name = f"postchain {os.path.basename(show)}"
            if kind == "NODE":
                add_node(context.scene, image, self._frames)
            else:
                source = on_disk(self._input)
                there = source.get(context.scene.frame_current, source.get(self._frames[0]))
                show_beside(context, load(there, self._frames), image, self._frames)
        count = len(self._frames)
        return f"{count} frame{'s are' if count > 1 else ' is'} in {os.path.dirname(self._output)}"


def load(path, frames):
    """The file as an image of Blender, of a sequence if there are several frames."""
    image = bpy.data.images.load(path, check_existing=True)
    image.reload()
    if len(frames) > 1:
        image.source = "SEQUENCE"
    return image


def _play(user, frames):
    """Makes an image user show the file of the scene's frame."""
    user.frame_start = frames[0]
    user.frame_duration = frames[-1] - frames[0] + 1
    user.frame_offset = frames[0] - 1
    user.use_auto_refresh = True


def add_node(scene, image, frames):
    """An image node with the result; an earlier one of this add-on gets the new image."""
    tree = versions.node_tree(scene)
    node = tree.nodes.get("postchain")
    if node is None or node.bl_idname != "CompositorNodeImage":
        node = tree.nodes.new("CompositorNodeImage")
        node.name = node.label = "postchain"
        node.location = -300, 500
    node.image = image
    if image.source == "SEQUENCE":
        _play(node, frames)
    return node


def show_beside(context, source, result, frames):
    """Two image editors: the input and the result. Uses those that the window shows, and opens a
    window otherwise. Does nothing without windows."""
    if bpy.app.background or not context.window:
        return
    editors = [area for area in context.window.screen.areas if area.type == "IMAGE_EDITOR"]
    window = context.window
    if not editors:
        bpy.ops.wm.window_new()
        window = context.window_manager.windows[-1]
        editors = [max(window.screen.areas, key=lambda area: area.width * area.height)]
        editors[0].type = "IMAGE_EDITOR"
    editors.sort(key=lambda area: area.x)
    if len(editors) == 1:
        with context.temp_override(window=window, area=editors[0], region=editors[0].regions[-1]):
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
        # The new area is the left one. Its place is known when the screen has been drawn.
        editors = [area for area in window.screen.areas
                   if area.type == "IMAGE_EDITOR" and area != editors[0]] + editors
    for area, image in zip(editors, (source, result)):
        space = area.spaces.active
        space.image = image
        if image.source == "SEQUENCE":
            _play(space.image_user, frames)
        area.tag_redraw()


CLASSES = (POSTCHAIN_OT_filter,)
