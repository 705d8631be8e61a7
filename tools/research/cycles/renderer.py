"""Renders the images of a scene: passes, lens, shutter, files. Work that was interrupted goes on
where it stopped: an image gets its name when it is complete."""
import os
import re
import sys
import time
from math import radians

import bpy

import model
import request

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "blender",
                             "postchain_blender"))
import camera  # noqa: E402
import peel  # noqa: E402


FILTER_PX = {"gbuf": 0.01, request.BEHIND: 1.0}  # of box filters


def _add_camera(view, frames):
    focus = view.focus if callable(view.focus) else lambda frame: view.focus
    data = bpy.data.cameras.new("camera")
    if callable(view.focal_length_mm):
        model.animate_value(data, "lens", view.focal_length_mm, frames)
    else:
        data.lens = view.focal_length_mm
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = 36.0
    data.clip_start, data.clip_end = 0.05, view.far
    data.dof.aperture_fstop = view.f_stop
    data.dof.aperture_blades = view.blades
    data.dof.aperture_rotation = radians(view.rotation_deg)
    for frame in frames:
        data.dof.focus_distance = focus(frame)
        data.dof.keyframe_insert("focus_distance", frame=frame)
    made = bpy.data.objects.new("camera", data)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made
    model.animate(made, view.pose, frames)
    return data


def _set_up(options, bounces):
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = options.size
    render.resolution_percentage = 100
    render.fps = request.FPS
    render.film_transparent = options.transparent
    render.use_file_extension = False
    render.use_compositing = render.use_sequencer = False
    if options.threads > 0:
        render.threads_mode, render.threads = "FIXED", options.threads
    render.motion_blur_shutter = request.SHUTTER_FRAMES
    # A setting of the engine before Blender 4.2.
    (render if hasattr(render, "motion_blur_position") else cycles).motion_blur_position = "CENTER"
    cycles.device = "CPU"
    # Light of lamps only, without the noise of bounces; of mirrors and glass as many as are given.
    cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.diffuse_bounces = 0
    cycles.transparent_max_bounces = 32
    cycles.caustics_reflective = cycles.caustics_refractive = True  # lamps seen in mirrors
    cycles.sample_clamp_indirect = 0
    cycles.use_denoising = False
    cycles.adaptive_threshold = 0.005
    cycles.adaptive_min_samples = options.min_samples
    cycles.sample_clamp_direct = 0


def _set_kind(kind, frame, options, lens):
    shutter, opened, planes = request.KINDS[request.like(kind)]
    scene = bpy.context.scene
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    scene.frame_set(frame)
    render.use_motion_blur = shutter
    lens.dof.use_dof = opened
    layer.use_pass_z = layer.use_pass_vector = planes
    cycles.samples = {"gbuf": 1, "sharp": options.sharp_samples}.get(request.like(kind), options.samples)
    cycles.use_adaptive_sampling = not planes
    cycles.seed = request.seed_of(kind, frame, options.half)
    # gbuf: the pixel's center, by Blender's least width; behind: the pixel alone, because what the
    # adjacent pixel hides may be another surface.
    cycles.pixel_filter_type = "BOX" if kind in FILTER_PX else "BLACKMAN_HARRIS"
    cycles.filter_width = FILTER_PX.get(kind, 1.5)
    image = render.image_settings
    image.file_format = "OPEN_EXR_MULTILAYER" if planes else "OPEN_EXR"
    image.color_mode = "RGBA" if planes or options.transparent else "RGB"
    image.color_depth = "16"  # of color; other passes stay float
    image.exr_codec = "ZIP"


def _frames_in(folder, frames):
    """Those given and those of pictures in the folder."""
    found = {int(match[1]) for name in os.listdir(folder) if (match := re.fullmatch(r"\w+\.(\d{4,})\.exr", name))}
    return sorted(found | set(frames))


def render_scene(scene, options):
    """Renders the images of options.kinds and options.frames that options.out lacks. With options.blend saves
    the scene as an artist would have it, with shutter and lens open."""
    os.makedirs(options.out, exist_ok=True)
    scene.build(options.frames, options.transparent)
    frames = _frames_in(options.out, options.frames)
    lens = _add_camera(scene.camera, frames)
    _set_up(options, scene.bounces)
    blender_scene = bpy.context.scene
    blender_scene.name = options.scene
    if options.blend:
        _set_kind("both", frames[0], options, lens)
        blender_scene.cycles.samples = options.sharp_samples
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(os.path.abspath(options.out), options.blend))
        return
    camera.write(os.path.join(options.out, "camera.json"), blender_scene, frames)
    peeled = None
    for kind, frame in request.images_to_render(options):
        start = time.monotonic()
        if kind == request.BEHIND:
            peeled = peeled or peel.Peel(*options.size)
            peeled.show(peel.depths_of(os.path.join(options.out, request.file_name("sharp", frame))))
        _set_kind(kind, frame, options, lens)
        path = os.path.join(os.path.abspath(options.out), request.file_name(kind, frame, options.half))
        blender_scene.render.filepath = path + ".tmp"
        bpy.ops.render.render(write_still=True)
        os.replace(path + ".tmp", path)
        print(f"{path}: {time.monotonic() - start:.0f} s", flush=True)
