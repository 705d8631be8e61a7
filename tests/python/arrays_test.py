"""Arrays of every layout give the same bits, and wrong ones an error that names the argument."""
import warnings

import numpy
import postchain
import pytest
from conftest import ALONE, BLUR, CAMERA, FXAA, HEIGHT, WIDTH, bits, expect_errors, planes_of


def run(chain=BLUR, **planes):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "no GPU")
        return postchain.Chain(chain).run(camera=CAMERA, frame=1, **ALONE, **planes)


@pytest.fixture(scope="module")
def planes():
    return planes_of(0)


@pytest.fixture(scope="module")
def expected(planes):
    return run(**planes)


def test_result(planes, expected):
    assert expected.dtype == numpy.float32 and expected.shape == (HEIGHT, WIDTH, 4)
    assert expected.flags.c_contiguous and expected.flags.writeable
    assert (bits(expected) != bits(planes["color"])).any()
    # Depth may have a third axis, or be broadcast.
    assert (bits(run(**dict(planes, depth=planes["depth"][..., None]))) == bits(expected)).all()
    flat, broadcast = (run(**dict(planes, depth=function(numpy.float32(3)))) for function in (
        lambda value: numpy.full((HEIGHT, WIDTH), value),
        lambda value: numpy.broadcast_to(value, (HEIGHT, WIDTH))))
    assert (bits(broadcast) == bits(flat)).all()


def negative(array):
    return array[::-1, ::-1].copy()[::-1, ::-1]


def strided(array):
    wide = numpy.zeros((array.shape[0] * 2, array.shape[1] * 3) + array.shape[2:], array.dtype)
    wide[::2, ::3] = array
    return wide[::2, ::3]


def unaligned(array):
    data = numpy.zeros(array.nbytes + 1, numpy.uint8)
    data[1:] = numpy.frombuffer(array.tobytes(), numpy.uint8)
    return data[1:].view(array.dtype).reshape(array.shape)


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


@pytest.mark.parametrize("layout", [negative, strided, unaligned, read_only, numpy.asfortranarray])
def test_layouts(planes, expected, layout):
    changed = {name: layout(plane) for name, plane in planes.items()}
    assert (bits(run(**changed)) == bits(expected)).all()
    for name, plane in planes.items():
        assert (bits(changed[name]) == bits(plane)).all(), f"{name} was changed"


def test_halves_are_the_floats_that_they_are(planes):
    planes = dict(planes, depth=numpy.minimum(planes["depth"], 6e4))
    halves = {name: plane.astype(numpy.float16) for name, plane in planes.items()}
    floats = {name: plane.astype(numpy.float32) for name, plane in halves.items()}
    with pytest.warns(postchain.Warning, match="depth is half float"):
        result = postchain.Chain(BLUR).run(camera=CAMERA, frame=1, **ALONE, **halves)
    assert result.dtype == numpy.float32
    assert (bits(result) == bits(run(**floats))).all()


def test_without_alpha(planes):
    opaque = dict(planes, color=planes["color"].copy())
    opaque["color"][..., 3] = 1
    rgb = run(**dict(planes, color=planes["color"][..., :3]))
    assert rgb.shape == (HEIGHT, WIDTH, 3) and rgb.flags.c_contiguous
    assert (bits(rgb) == bits(run(**opaque)[..., :3])).all()


def test_depth_encodings(planes, expected):
    inverse = dict(planes, depth=(1 / planes["depth"].astype(float)).astype(numpy.float32))
    chain = postchain.Chain(BLUR)
    result = chain.run(camera=CAMERA, frame=1, depth_encoding="inverse", **inverse)
    assert (bits(result) == bits(expected)).all()
    with pytest.raises(postchain.UsageError, match="known are linear"):
        chain.run(depth_encoding="log", **planes)
    with pytest.raises(postchain.ChainError, match="camera.near_clip"):
        chain.run(depth_encoding="reverse_infinite", **planes)


def test_nan_and_infinity(planes):
    color = planes["color"].copy()
    color[5, 6, 1], color[7, 8, 0] = numpy.nan, numpy.inf
    depth, motion = planes["depth"].copy(), planes["motion"].copy()
    depth[9, 9], motion[9, 9] = numpy.nan, numpy.inf
    with pytest.warns(postchain.Warning) as caught:
        result = postchain.Chain(BLUR).run(camera=CAMERA, frame=1, **ALONE, color=color, depth=depth,
                                           motion=motion)
    text = "\n".join(str(one.message) for one in caught)
    for words in ("frame 1: 2 pixels with non-finite color", "1 pixels with non-finite depth",
                  "non-finite motion", "the first non-finite pixel is (6, 5)"):
        assert words in text
    with pytest.raises(postchain.Warning, match="non-finite"):  # run() makes warnings errors
        run(color=color, depth=depth, motion=motion)
    clamped = color.copy()
    clamped[5, 6, 1], clamped[7, 8, 0] = 0, 65504
    depth[9, 9], motion[9, 9] = numpy.inf, 0
    assert (bits(result) == bits(run(color=clamped, depth=depth, motion=motion))).all()


@pytest.mark.parametrize("name, change, words", [
    ("color", lambda a: a.tolist(), "is a list, not a NumPy array"),
    ("color", lambda a: a.astype(numpy.float64), r"float64; convert it with .astype"),
    ("color", lambda a: (a * 10).astype(numpy.uint8), "uint8; convert it with .x / 255."),
    ("color", lambda a: (a * 10).astype(numpy.uint16), "uint16; convert it with .x / 65535."),
    ("color", lambda a: a.astype(">f4"), "byte order"),
    ("color", lambda a: a.astype(object), "object"),
    ("color", lambda a: a[..., 0], "32x48; give height x width x 3 .RGB. or 4"),
    ("color", lambda a: a[None], "1x32x48x4; give height"),
    ("color", lambda a: a[:0], "no pixels: 0x48x4"),
    ("color", lambda a: numpy.broadcast_to(a[:1, :1], (1, 16385, 4)), "at most 16384 pixels"),
    ("color", lambda a: numpy.broadcast_to(a[:1, :1], (16385, 1, 4)), "at most 16384 pixels"),
    ("depth", lambda a: a[:-1], "is 48x31 pixels, color 48x32; the planes"),
    ("depth", lambda a: a[:, :-1], "is 47x32 pixels, color 48x32; the planes"),
    ("depth", lambda a: numpy.stack([a, a], -1), "give height x width"),
    ("motion", lambda a: a[..., 0], "give height x width x 2"),
    ("motion", lambda a: a.transpose(1, 0, 2), "is 32x48 pixels, color 48x32"),
    ("motion_back", lambda a: "motion", "is a str, not a NumPy array"),
    ("color", lambda a: a.astype("u4"), "uint32; convert it with .astype"),
])
def test_wrong_arrays(planes, name, change, words):
    with pytest.raises(postchain.UsageError, match=words) as caught:
        run(**dict(planes, **{name: change(planes[name])}))
    assert caught.value.place == name and caught.value.remedy


def test_a_missing_plane_or_camera(planes):
    with pytest.raises(postchain.InputError, match="motion was looked for as motion.x"):
        run(color=planes["color"], depth=planes["depth"])
    chain = {"postchain": 1, "passes": [{"depth_of_field": {}}]}
    with pytest.raises(postchain.ChainError, match="focal_length_mm") as caught:
        postchain.Chain(chain).run(planes["color"], planes["depth"])
    assert "camera" in caught.value.remedy and "--" not in str(caught.value)


def test_wrong_cameras(planes):
    chain = postchain.Chain(FXAA)
    for camera, words in [({"f_stop": -1}, "f_stop"), ({"focus_distance": "near"}, "near"),
                          ("missing.json", "missing.json")]:
        with pytest.raises(postchain.InputError, match=words):
            chain.run(planes["color"], camera=camera)
    with pytest.warns(postchain.Warning, match="focal_lenght_mm"):
        chain.run(planes["color"], camera={"focal_lenght_mm": 50})


def test_wrong_arguments(planes):
    chain, color = postchain.Chain(FXAA), planes["color"]
    expect_errors((postchain.UsageError, words, lambda more=more: chain.run(color, **more)) for words, more in [
        ("precision", {"precision": "fp8"}), ("unknown rule 'speed'", {"no_elide": "speed"}),
        ("device: is a str; give a Device", {"device": "gpu"}), ("frame: is a str; give an integer", {"frame": "7"}),
        ("frame: 1099511627776 is too large", {"frame": 2 ** 40}), ("pixel_aspect", {"pixel_aspect": 0})])


def test_frame_keeps_what_it_has(planes, expected):
    frame = postchain.Frame(**planes, camera=CAMERA, frame=1)
    assert (frame.number, frame.width, frame.height) == (1, WIDTH, HEIGHT)
    assert frame.camera == pytest.approx(CAMERA)
    assert (bits(postchain.Chain(BLUR).run(frame)) == bits(expected)).all()
    kept = frame.planes()["color"]
    assert (bits(kept) == bits(planes["color"])).all() and not kept.flags.writeable
    assert kept.ctypes.data == frame.planes()["color"].ctypes.data, "copied"
    assert frame.planes()["inverse_depth"][20, 40] == numpy.float32(1 / 8)
    assert postchain.Frame(planes["color"]).planes()["motion"] is None
    for call in (postchain.Chain(BLUR).run, postchain.Chain(BLUR).plan):
        for settings in ({"camera": CAMERA}, {"pixel_aspect": 2.0}):
            with pytest.raises(postchain.UsageError, match="give them to Frame"):
                call(frame, **settings)


def test_plan(planes):
    plan = postchain.Chain(BLUR).plan(camera=CAMERA, frame=1, **planes)
    assert plan["passes"][0]["pass"] == "motion_blur" and plan["steps"]
    shutter, = [one["values"]["shutter_frames"] for one in plan["resolved"]["passes"]]
    assert shutter["value"] == 0.8
