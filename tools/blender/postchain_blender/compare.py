"""Compare with ground truth: the current frame with Cycles' own motion blur and depth of field, and
the chain's error against it."""
import json
import os
import pathlib

import bpy

from . import camera, command, filter as filtering, prepare, properties

SHOWN = {"psnr": ("PSNR", "{:.2f} dB"), "hdr_flip": ("HDR-FLIP", "{:.3f}"), "ssim": ("SSIM", "{:.3f}")}


def render(folder, frame, samples):
    """Runs in a Blender of its own, on a copy of the file: renders the frame and its neighbors as
    Prepare sets them up, and the frame with shutter and lens open."""
    scene = bpy.context.scene
    settings, image = scene.render, scene.render.image_settings
    scene.frame_set(frame)
    for marker in scene.timeline_markers:  # the neighbors are of the same camera
        marker.camera = None
    settings.engine = "CYCLES"
    settings.use_file_extension = settings.use_border = False
    settings.use_compositing = settings.use_sequencer = settings.use_multiview = False
    blurs = properties.blurs(scene)
    prepare.apply(scene)
    for number in (frame - 1, frame, frame + 1):
        _render(scene, number, os.path.join(folder, f"sharp.{number:04d}.exr"))
    set_truth(scene, samples, **blurs)
    image.file_format = "OPEN_EXR"
    image.color_mode = "RGBA" if settings.film_transparent else "RGB"
    _render(scene, frame, os.path.join(folder, f"truth.{frame:04d}.exr"))


def set_truth(scene, samples, lens, motion):
    """Shutter and lens open if the chain has their blur."""
    scene.render.use_motion_blur = motion
    scene.camera.data.dof.use_dof = lens and scene.camera.data.type == "PERSP"
    scene.cycles.samples = samples
    scene.cycles.seed += 1  # its noise is another than the input's


def _render(scene, frame, path):
    scene.frame_set(frame)
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


class POSTCHAIN_OT_compare(command.JobOperator, bpy.types.Operator):
    """Renders the current frame with Cycles' own motion blur and depth of field, and measures the error
    of the chain against it. Esc cancels"""
    bl_idname = "postchain.compare"
    bl_label = "Compare with Ground Truth"
    bl_options = {"REGISTER", "UNDO"}

    def steps(self, context):
        scene, frame = context.scene, context.scene.frame_current
        self._scene, self._frame = scene.name, frame  # the user goes on meanwhile
        filtering.check(self, scene)
        chain = properties.chain(scene)
        self._folder = os.path.join(filtering.output_folder(scene), f"ground_truth_{frame:04d}")
        os.makedirs(self._folder, exist_ok=True)
        lens = camera.write(self._at("camera.json"), scene, [frame])[0][0]
        for name, passes in (("as_rendered", []), ("filtered", chain["passes"])):
            with open(self._at(f"{name}.json"), "w", encoding="utf-8") as file:
                file.write(properties.chain_text({"passes": passes}))
        measure = ["ab", self._at("as_rendered.json"), self._at("filtered.json"), "-i",
                   self._at("sharp.####.exr"), "-r", self._at("truth.####.exr"), "--camera", lens,
                   f"--frames={frame}", "-o", self._at("report"), "--on-existing", "overwrite",
                   "--repeats", "1"]
        if len([layer for layer in scene.view_layers if layer.use]) > 1:
            measure += ["--view-layer", filtering.view_layer(scene)]
        call = f"compare.render({self._folder!r}, {frame}, {scene.postchain.truth_samples})"
        return [command.blender("Render", call, images=4),
                command.postchain("Measure", measure)]

    def _at(self, name):
        return os.path.join(self._folder, name)

    def done(self, context, job):
        with open(self._at("report/report.json"), encoding="utf-8") as file:
            variants = json.load(file)["variants"]
        rows = []
        for variant in variants:
            means = {key: variant["metrics"][key]["mean"] for key in SHOWN}
            # The PSNR of equal images and the SSIM of tiny ones do not exist.
            rows.append([variant["name"]] + ["none" if means[key] is None else form.format(means[key])
                                             for key, (_, form) in SHOWN.items()])
        job.warnings.clear()  # the report has them
        page = self._at("report/index.html")
        scene = bpy.data.scenes.get(self._scene)
        if scene:
            scene.postchain.comparison = json.dumps(
                {"frame": self._frame, "page": page, "rows": rows})
        if not bpy.app.background:
            bpy.ops.wm.url_open(url=pathlib.Path(page).as_uri())
        titles = [title for title, _ in SHOWN.values()]
        return "; ".join(f"{row[0]}: " + ", ".join(f"{title} {value}" for title, value in
                                                  zip(titles, row[1:])) for row in rows)


CLASSES = (POSTCHAIN_OT_compare,)
