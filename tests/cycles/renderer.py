"""Renders the pictures of a scene: passes, lens, shutter, files. Work that was interrupted goes on
where it stopped: a picture gets its name when it is complete."""
import os
import re
import sys
import time

import bpy

import model
import request


class View:
    """The camera. pose: time in frames -> 4x4, camera to world, looking along -z; focus: frame ->
    meters along the camera's axis; blades: of the aperture, 0: a disc."""

    def __init__(self, pose, focus, focal_length_mm, f_stop, blades=0, rotation_deg=0.0):
        self.pose = pose
        self.focus = focus
        self.lens = {"focal_length_mm": focal_length_mm, "sensor_width_mm": 36.0,
                     "f_stop": f_stop, "aperture_blades": blades,
                     "aperture_rotation_deg": rotation_deg, "near_clip": 0.05, "far_clip": 60.0}


def script_options(description):
    """The options after "--"."""
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return request.parse_options(arguments, description)


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def _add_camera(view, frames):
    data = bpy.data.cameras.new("camera")
    data.lens = view.lens["focal_length_mm"]
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = view.lens["sensor_width_mm"]
    data.clip_start, data.clip_end = view.lens["near_clip"], view.lens["far_clip"]
    data.dof.aperture_fstop = view.lens["f_stop"]
    data.dof.aperture_blades = view.lens["aperture_blades"]
    data.dof.aperture_rotation = view.lens["aperture_rotation_deg"] * 3.141592653589793 / 180
    made = bpy.data.objects.new("camera", data)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = made
    model.animate(made, view.pose, frames)
    return data


def _set_up(options):
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
    cycles.motion_blur_position = "CENTER"
    cycles.device = "CPU"
    cycles.max_bounces = 0  # light of the sun only: no noise of bounces
    cycles.use_denoising = False
    cycles.adaptive_threshold = 0.005
    cycles.adaptive_min_samples = 64
    cycles.sample_clamp_direct = 0


def _set_kind(kind, frame, options, lens, view):
    shutter, opened, planes = request.KINDS[kind]
    scene = bpy.context.scene
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    scene.frame_set(frame)
    render.use_motion_blur = shutter
    lens.dof.use_dof = opened
    lens.dof.focus_distance = view.focus(frame)
    layer.use_pass_z = layer.use_pass_vector = planes
    cycles.samples = {"gbuf": 1, "sharp": options.sharp_samples}.get(kind, options.samples)
    cycles.use_adaptive_sampling = not planes
    cycles.seed = request.seed_of(kind, frame)
    cycles.pixel_filter_type = "BOX" if kind == "gbuf" else "BLACKMAN_HARRIS"
    cycles.filter_width = 0.01 if kind == "gbuf" else 1.5  # pixels; Blender's least and default
    image = render.image_settings
    image.file_format = "OPEN_EXR_MULTILAYER" if planes else "OPEN_EXR"
    image.color_mode = "RGBA" if planes or options.transparent else "RGB"
    image.color_depth = "16"  # of color; other passes stay float
    image.exr_codec = "ZIP"


def _frames_in(folder, frames):
    """Those given and those of pictures in the folder."""
    found = {int(match[1]) for name in os.listdir(folder)
             if (match := re.fullmatch(r"\w+\.(\d{4,})\.exr", name))}
    return sorted(found | set(frames))


def _write_camera(name, description, view, options):
    frames = _frames_in(options.out, options.frames)
    matrices = {frame: [list(row) for row in view.pose(frame)]
                for frame in range(frames[0] - 1, frames[-1] + 2)}
    text = request.camera_json(name, description, options.size, view.lens,
                               {frame: view.focus(frame) for frame in frames}, matrices)
    with open(os.path.join(options.out, "camera.json"), "w", encoding="utf-8") as file:
        file.write(text)


def render_scene(name, description, view, options):
    """Renders what is not there yet of options.kinds and options.frames into options.out."""
    os.makedirs(options.out, exist_ok=True)
    lens = _add_camera(view, options.frames)
    _set_up(options)
    _write_camera(name, description, view, options)
    for kind, frame in request.images_to_render(options):
        start = time.monotonic()
        _set_kind(kind, frame, options, lens, view)
        path = os.path.join(os.path.abspath(options.out), request.file_name(kind, frame))
        bpy.context.scene.render.filepath = path + ".tmp"
        bpy.ops.render.render(write_still=True)
        os.replace(path + ".tmp", path)
        print(f"{path}: {time.monotonic() - start:.0f} s", flush=True)
