"""Frames of Cycles as arrays, for the baseline and the masks of quality.py. Needs python3-numpy and
python3-openimageio."""
import dataclasses
import json
import math

import numpy as np
import OpenImageIO as oiio


def read(path):
    """(array of height x width x channels, specification)."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise SystemExit(f"{path}: {oiio.geterror()}")
    return np.asarray(source.read_image("float")), source.spec()


def renderer_of(spec):
    """Attributes that name Cycles as the renderer: without them no zoom is added to its vectors."""
    return {one.name: one.value for one in spec.extra_attribs if one.name.startswith("cycles.")}


def write(path, pixels, names, attributes=None):
    """Float EXR."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    spec.channelnames = tuple(names)
    spec["compression"] = "zip"
    for name, value in (attributes or {}).items():
        spec.attribute(name, value)
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), spec)
    target.write_image(np.ascontiguousarray(pixels, np.float32))
    target.close()


def columns(names, ending):
    """Indices of the channels of "Combined.RGB", "Depth.Z", "Vector.XYZW"."""
    layer, letters = ending.split(".")
    return [next(i for i, name in enumerate(names) if name.endswith(f"{layer}.{letter}"))
            for letter in letters]


@dataclasses.dataclass
class Camera:
    focal_length_mm: float
    sensor_width_mm: float
    f_stop: float
    focus_distance: float
    aperture_blades: int = 0
    aperture_rotation_deg: float = 0.0
    shutter_frames: float = 0.5

    @classmethod
    def of(cls, path, frame):
        """camera.json, with the values of the frame."""
        with open(path, encoding="utf8") as file:
            content = json.load(file)
        frames = content.get("frames", {})
        if isinstance(frames, dict):
            content.update(frames.get(str(frame), {}))
        names = [field.name for field in dataclasses.fields(cls)]
        return cls(**{name: content[name] for name in names if name in content})

    def signed_radius(self, depth, width):
        """Radius of the circle of confusion in pixels of an image of this width; > 0 behind the focus."""
        focal = self.focal_length_mm / 1000
        inverse = 1 / np.maximum(depth, 1e-6)
        return 0.5 * focal * focal / self.f_stop * (1 / self.focus_distance - inverse) \
            * width / (self.sensor_width_mm / 1000)

    def in_aperture(self, x, y, radius):
        """Whether the offset (x right, y up) is in the image of the aperture of this signed radius."""
        distance = np.hypot(x, y)
        if self.aperture_blades < 3:
            return distance <= abs(radius)
        step = 2 * math.pi / self.aperture_blades
        corner = math.radians(self.aperture_rotation_deg) + step / 2 + (math.pi if radius < 0 else 0)
        angle = np.mod(np.arctan2(y, x) - corner, step) - step / 2
        return distance * np.cos(angle) <= abs(radius) * math.cos(step / 2)


def displayed(color):
    """After x/(1+x) and gamma 2.2, as postchain diff compares it."""
    color = np.maximum(color[..., :3], 0)
    return (color / (1 + color))**(1 / 2.2)
