import json
import os
import pathlib
import subprocess
import sys
import warnings

import numpy
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/command"))
import exr  # noqa: E402

import postchain  # noqa: E402

COMMAND = os.environ["POSTCHAIN_COMMAND"]
WIDTH, HEIGHT = 48, 32
# One program of the inverse warp and one small pass serve nearly all tests: compiling takes longest.
BLUR = {"postchain": 1, "passes": [{"motion_blur": {"mode": "inverse_warp", "samples": 9}}]}
FXAA = {"postchain": 1, "passes": ["fxaa"]}
CAMERA = {"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 2, "focus_distance": 3,
          "shutter_frames": 0.8}
ALONE = {"before": None, "after": None}  # there are no such frames


def planes_of(frame):
    """A textured square that moves over a textured wall; a border is clear and infinitely far."""
    random = numpy.random.default_rng(5)
    wall = random.random((HEIGHT, WIDTH, 3), dtype=numpy.float32)
    square = random.random((12, 12, 3), dtype=numpy.float32) * 4
    color = numpy.ones((HEIGHT, WIDTH, 4), numpy.float32)
    color[..., :3] = wall
    depth = numpy.full((HEIGHT, WIDTH), 8, numpy.float32)
    motion = numpy.zeros((HEIGHT, WIDTH, 2), numpy.float32)
    left = 4 + 7 * frame
    color[10:22, left:left + 12, :3] = square
    depth[10:22, left:left + 12] = 3
    motion[10:22, left:left + 12] = 7, 0.5
    depth[:4], color[:3] = 1e10, 0
    color[3] *= 0.5  # partly covered, with the depth of the background
    return {"color": color, "depth": depth, "motion": motion, "motion_back": motion.copy()}


def write_exr(path, planes, more=None, attributes=None, left=0):
    """`more`: further float channels by name. `attributes`: strings of the header. `left`: columns
    that a crop leaves out at the left."""
    planes = {name: plane[:, left:] for name, plane in planes.items()}
    channels = {name: ("f", plane.ravel().tolist()) for name, plane in (more or {}).items()}
    strings = {name: ("string", text.encode()) for name, text in (attributes or {}).items()}
    for name, plane in (("RGBA", planes["color"]), ("Z", planes["depth"][..., None])):
        for i, letter in enumerate(name):
            channels[letter] = ("f", plane[..., i].ravel().tolist())
    for name in ("motion", "motion_back"):
        for i, letter in enumerate("xy"):
            channels[f"{name}.{letter}"] = ("f", planes[name][..., i].ravel().tolist())
    data, display = (numpy.array([first, 0, WIDTH - 1, HEIGHT - 1], "<i4").tobytes()
                     for first in (left, 0))
    header = {
        "dataWindow": ("box2i", data), "displayWindow": ("box2i", display),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", numpy.float32(1).tobytes()),
        "screenWindowCenter": ("v2f", numpy.zeros(2, "<f4").tobytes()),
        "screenWindowWidth": ("float", numpy.float32(1).tobytes())}
    exr.write(path, exr.Picture(WIDTH - left, HEIGHT, dict(strings, **header), channels))


def channels_of_exr(path, names):
    picture = exr.read(path)
    rows = [numpy.array(picture.values(name), numpy.float32) for name in names]
    return numpy.stack(rows, -1).reshape(picture.height, picture.width, len(names))


def color_of_exr(path):
    return channels_of_exr(path, "RGBA")


def bits(array):
    return numpy.ascontiguousarray(array).view(numpy.uint32)


def command(*words, code=0):
    done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done.stdout


def python(code):
    """A process with the module."""
    return subprocess.Popen([sys.executable, "-B", "-c", code], text=True, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE)


def expect_errors(rows):
    """Rows: class, words of the message, and a call that must end with both. No message names options
    of the command."""
    for kind, words, call in rows:
        with pytest.raises(kind, match=words) as caught:
            call()
        assert "--" not in str(caught.value)


@pytest.fixture(scope="session")
def frames(tmp_path_factory):
    """frame.0001.exr to frame.0003.exr, camera.json, blur.yaml."""
    folder = tmp_path_factory.mktemp("frames")
    for number in (1, 2, 3):
        write_exr(folder / f"frame.{number:04}.exr", planes_of(number - 1))
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    (folder / "blur.yaml").write_text(json.dumps(BLUR))
    return folder


@pytest.fixture(autouse=True)
def software(monkeypatch):
    """The tests run with and without a GPU; the warning that there is none is no finding."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "no GPU", postchain.Warning)
        yield
