"""Writes the camera file (docs/chain_file.md#camerajson) of a scene, frame by frame from the evaluated
scene, without a render. Imports nothing else of this package, so one line of a farm's job is enough:

blender -b shot.blend --python-expr "import sys; sys.path.insert(0, 'postchain_blender.zip'); \
from postchain_blender import camera; camera.write('camera.json')"
"""
import json
import math
import os

import bpy


class CameraError(Exception):
    """A scene whose camera has no camera file. The text names the place and the remedy."""


def scene_frames(scene):
    return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))


def shutter_position(scene):
    """START, CENTER or END. A setting of the engine, in newer versions of the render settings."""
    engine = scene.cycles if scene.render.engine == "CYCLES" else scene.eevee
    for owner in (scene.render, engine):
        found = getattr(owner, "motion_blur_position", None)
        if found:
            return found
    return "CENTER"


def focus_distance(camera):
    """In scene units along the camera's axis, as Blender computes it. `camera` is evaluated."""
    dof = camera.data.dof
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    place = target.matrix_world
    bone = target.pose.bones.get(dof.focus_subtarget) if target.pose else None
    if bone:
        place = place @ bone.matrix
    axis = camera.matrix_world.col[2].xyz.normalized()
    return abs(axis.dot(place.translation - camera.matrix_world.translation))


def _short(value):
    """Blender's floats have seven digits: 0.95, not 0.949999988079071."""
    return float(f"{value:.7g}")


def _lens(camera):
    """The values of one frame. An orthographic camera has no lens, only clip planes."""
    data, dof = camera.data, camera.data.dof
    values = {"near_clip": _short(data.clip_start), "far_clip": _short(data.clip_end)}
    if data.type != "PERSP":
        return values
    vertical = data.sensor_fit == "VERTICAL"
    values.update(
        focal_length_mm=_short(data.lens),
        sensor_width_mm=_short(data.sensor_height if vertical else data.sensor_width),
        sensor_fit=data.sensor_fit.lower(),
        f_stop=_short(dof.aperture_fstop),
        focus_distance=_short(focus_distance(camera)),
        aperture_blades=dof.aperture_blades,
        aperture_rotation_deg=_short(math.degrees(dof.aperture_rotation) % 360),
        aperture_ratio=_short(dof.aperture_ratio))
    if data.shift_x or data.shift_y:
        values["lens_shift"] = [_short(data.shift_x), _short(data.shift_y)]
    return values


def _rigid(matrix):
    """Rows of the matrix without its scale, which Blender ignores in cameras."""
    position, rotation, _ = matrix.decompose()
    rows = rotation.to_matrix().to_4x4()
    rows.translation = position
    return [list(row) for row in rows]


def check(camera, frame):
    """Raises CameraError for a camera that has no camera file."""
    where = f"frame {frame}"
    if camera is None:
        raise CameraError(f"{where}: the scene has no camera; choose one in Scene properties, Camera")
    if camera.type != "CAMERA":
        raise CameraError(f"{where}: '{camera.name}', the scene's camera, is not a camera object; "
                          "choose a camera in Scene properties, Camera")
    if camera.data.type == "PANO":
        raise CameraError(f"{where}: camera '{camera.name}' is panoramic; postchain needs straight "
                          "lines: choose the lens type Perspective in the camera's properties")
    columns = [camera.matrix_world.col[i].xyz.normalized() for i in range(3)]
    if max(abs(columns[i].dot(columns[(i + 1) % 3])) for i in range(3)) > 1e-4:
        raise CameraError(f"{where}: camera '{camera.name}' is sheared by a parent with unequal "
                          "scales; apply the parent's scale")


def camera_at(scene, frame):
    """The camera of a frame: that of the last marker with one up to it, or of the first marker with
    one, as Blender chooses it."""
    markers = sorted((marker for marker in scene.timeline_markers
                      if marker.camera and not marker.camera.hide_render),
                     key=lambda marker: marker.frame)
    until = [marker for marker in markers if marker.frame <= frame]
    if until:
        return until[-1].camera
    return markers[0].camera if markers else scene.camera


class _Sequence:
    """The scene at other frames; afterwards it is at its own again."""

    def __init__(self, scene):
        self.scene = scene

    def __enter__(self):
        self.frame = self.scene.frame_current, self.scene.frame_subframe
        return self

    def __exit__(self, *_):
        self.scene.frame_set(self.frame[0], subframe=self.frame[1])

    def at(self, frame):
        self.scene.frame_set(frame)
        layer = self.scene.view_layers[0]
        if self.scene == bpy.context.scene:
            layer = bpy.context.view_layer
        return layer.depsgraph


def describe(scene, frames):
    """One camera file, as a dict, for each run of frames of one camera: [(frames, dict)]. Markers may
    switch cameras. The matrices of the frames before and after are those of the same camera."""
    if not frames:
        raise CameraError("no frames: the end frame is before the start frame; change the frame range")
    shots = []  # (camera, frames, {frame: values}, {frame: matrix})
    with _Sequence(scene) as sequence:
        for frame in sorted(frames):
            graph = sequence.at(frame)
            camera = scene.camera
            evaluated = camera.evaluated_get(graph) if camera else None
            check(evaluated, frame)
            if not shots or shots[-1][0] != camera:
                shots.append((camera, [], {}, {}))
            render = scene.evaluated_get(graph).render
            values = dict(_lens(evaluated), shutter_frames=_short(render.motion_blur_shutter))
            shots[-1][1].append(frame)
            shots[-1][2][frame] = values
        wanted = {}  # frame: the shots that need its matrix
        for shot in shots:
            for frame in {number + step for number in shot[1] for step in (-1, 0, 1)}:
                wanted.setdefault(frame, []).append(shot)
        for frame in sorted(wanted):
            graph = sequence.at(frame)
            for camera, _, _, matrices in wanted[frame]:
                matrices[frame] = _rigid(camera.evaluated_get(graph).matrix_world)
    return [(shot[1], _content(scene, *shot)) for shot in shots]


def _content(scene, camera, frames, values, matrices):
    render = scene.render
    percentage = render.resolution_percentage
    first = values[frames[0]]
    changing = [key for key in first if any(values[frame].get(key) != first[key] for frame in frames)]
    return {
        "scene": scene.name,
        "camera": camera.name,
        "resolution": [render.resolution_x * percentage // 100,
                       render.resolution_y * percentage // 100],
        **first,
        # Blender takes a scene unit for a meter in its lens, whatever the scene's unit scale is.
        "meters_per_unit": 1,
        "shutter_position": shutter_position(scene).lower(),
        "fps": _short(render.fps / render.fps_base),
        "frames": {str(frame): {key: values[frame][key] for key in changing} for frame in frames},
        "camera_matrix_world": {str(frame): matrices[frame] for frame in sorted(matrices)},
    }


def write(path, scene=None, frames=None):
    """Writes the camera file of a scene (the current one) for frames (the scene's range). If markers
    switch cameras, PATH gets a file for each shot: camera.json, camera.2.json, ... Returns
    [(path, frames)]."""
    scene = scene or bpy.context.scene
    written = []
    for number, (numbers, content) in enumerate(describe(scene, frames or scene_frames(scene)), 1):
        stem, extension = os.path.splitext(os.path.abspath(path))
        name = f"{stem}{'' if number == 1 else f'.{number}'}{extension}"
        os.makedirs(os.path.dirname(name), exist_ok=True)
        with open(name + ".tmp", "w", encoding="utf-8") as file:
            file.write(json.dumps(content, indent=1) + "\n")
        os.replace(name + ".tmp", name)
        print(f"postchain: {name}: frames {numbers[0]} to {numbers[-1]}, camera '{content['camera']}'")
        written.append((name, numbers))
    return written
