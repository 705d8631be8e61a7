"""Layers, mattes and cryptomattes of arrays against the command on files with the same values."""
import json

import exr
import numpy
import postchain
import pytest
from conftest import (BLUR, CAMERA, FXAA, HEIGHT, WIDTH, bits, channels_of_exr, color_of_exr,
                      command, expect_errors, planes_of, write_exr)

IDS = {"square": 0x3f1a5b2c, "wall": 0x41c2d3e4}
MANIFEST = {name: f"{number:08x}" for name, number in IDS.items()}


def chain_with(matte, **more):
    blur = dict(BLUR["passes"][0]["motion_blur"], matte=matte, **more)
    return {"postchain": 1, "passes": [{"motion_blur": blur}]}


def extras_of(frame):
    """Two lights, one without alpha and named as data; the square's matte; a cryptomatte."""
    planes = planes_of(frame)
    square = (planes["depth"] == 3).astype(numpy.float32)
    key = planes["color"] * numpy.float32(0.75)
    ids = numpy.array([IDS["square"], IDS["wall"]], numpy.uint32).view(numpy.float32)
    ranks = numpy.zeros((HEIGHT, WIDTH, 4), numpy.float32)
    ranks[..., 0] = numpy.where(square > 0, ids[0], ids[1])
    ranks[..., 1] = 1
    ranks[5, 5] = ids[1], 0.75, ids[0], 0.25
    return {"aovs": {"View.key": key, "uv": planes["color"][..., :3] - key[..., :3]},
            "mattes": {"hero": square}, "cryptomattes": {"Object": (ranks, MANIFEST)}}


def write_frame(path, frame):
    extras = extras_of(frame)
    channels = {"hero": extras["mattes"]["hero"]}
    for name, layer in (("View.key", extras["aovs"]["View.key"]),
                        ("color_uv", extras["aovs"]["uv"])):
        for i in range(layer.shape[2]):
            channels[f"{name}.{'RGBA'[i]}"] = layer[..., i]
    for i, letter in enumerate("rgba"):
        channels[f"Object00.{letter}"] = extras["cryptomattes"]["Object"][0][..., i]
    write_exr(path, planes_of(frame), channels,
              {"cryptomatte/1234567/name": "Object", "cryptomatte/1234567/manifest": json.dumps(MANIFEST),
               "cryptomatte/1234567/hash": "MurmurHash3_32",
               "cryptomatte/1234567/conversion": "uint32_to_float32"})


@pytest.fixture(scope="module")
def layered(tmp_path_factory, frames):
    folder = tmp_path_factory.mktemp("layers")
    for number in (1, 2, 3):
        write_frame(folder / f"frame.{number:04}.exr", number - 1)
    (folder / "camera.json").write_text((frames / "camera.json").read_text())
    return folder


def run_command(folder, chain, out, *words):
    (out / "chain.yaml").write_text(json.dumps(chain))
    command("run", out / "chain.yaml", "-i", folder / "frame.####.exr", "--camera",
            folder / "camera.json", "-o", out / "o.####.exr", "--frames", "2", *words)
    return out / "o.0002.exr"


def frame_of(number, **settings):
    return postchain.Frame(**planes_of(number), **extras_of(number), camera=CAMERA,
                           frame=number + 1, **settings)


def test_the_bits_of_the_command(layered, tmp_path):
    chain = postchain.Chain(chain_with("hero"))
    written = run_command(layered, chain_with("hero"), tmp_path, "--aovs",
                          "View.key,color_uv", "--cryptomatte", "filter")
    before, frame, after = (frame_of(number, cryptomatte="filter") for number in range(3))
    found = chain.filter(frame, before=before, after=after)
    assert (bits(found.color) == bits(color_of_exr(written))).all()
    assert list(found.aovs) == ["View.key", "uv"] and list(found.cryptomattes) == ["Object"]
    for name, channels in [("View.key", [f"View.key.{letter}" for letter in "RGBA"]),
                           ("uv", [f"color_uv.{letter}" for letter in "RGB"])]:
        assert numpy.array_equal(bits(found.aovs[name]), bits(channels_of_exr(written, channels))), name
    ranks = channels_of_exr(written, [f"Object00.{letter}" for letter in "rgba"])
    assert (bits(found.cryptomattes["Object"]) == bits(ranks)).all()
    given = extras_of(1)
    # The matte holds the square out; without it the coverage is blurred too.
    assert (bits(ranks) == bits(given["cryptomattes"]["Object"][0])).all()
    (tmp_path / "blurred").mkdir()
    blurred = run_command(layered, BLUR, tmp_path / "blurred", "--cryptomatte", "filter=square")
    settings = {"cryptomatte": "filter=square"}
    only = postchain.Chain(BLUR).filter(frame_of(1, **settings), before=frame_of(0, **settings),
                                            after=frame_of(2, **settings)).cryptomattes["Object"]
    expected = channels_of_exr(blurred, [f"Object00.{letter}" for letter in "rgba"])
    assert (bits(only) == bits(expected)).all() and (bits(only) != bits(ranks)).any()

    # As arguments, with dicts as neighbors; the color of run() is the same.
    neighbors = {"before": dict(planes_of(0), **extras_of(0)),
                 "after": dict(planes_of(2), **extras_of(2))}
    again = chain.filter(**planes_of(1), **given, **neighbors, camera=CAMERA, frame=2,
                             cryptomatte="filter")
    assert (bits(again.aovs["uv"]) == bits(found.aovs["uv"])).all()
    mattes = {name: dict(planes_of(number), mattes=extras_of(number)["mattes"])
              for name, number in (("before", 0), ("after", 2))}
    alone = chain.run(**planes_of(1), mattes=given["mattes"], camera=CAMERA, frame=2, **mattes)
    assert (bits(alone) == bits(found.color)).all()

    # From the files.
    read = [postchain.read(layered / "frame.####.exr", frame=number, aovs="View.key,color_uv",
                           camera=layered / "camera.json", cryptomatte="filter")
            for number in (1, 2, 3)]
    files = chain.filter(read[1], before=read[0], after=read[2])
    assert (bits(files.color) == bits(found.color)).all()
    assert (bits(files.aovs["color_uv"]) == bits(found.aovs["uv"])).all()
    assert (bits(files.cryptomattes["Object"]) == bits(ranks)).all()

    # Written, it is the file of the command; a layer that the frame filters must be there, in its size.
    postchain.write(tmp_path / "back.exr", files, read[1])
    back, its = (exr.read(path) for path in (tmp_path / "back.exr", written))
    assert back.channels == its.channels
    def written_with(**more):
        return lambda: postchain.write(tmp_path / "not.exr", files._replace(**more), read[1])
    expect_errors((postchain.UsageError, words, call) for words, call in [
        ("image.aovs: has no 'View.key'", written_with(aovs={"color_uv": files.aovs["color_uv"]})),
        ("image.aovs: is 47x32 pixels, the frame 48x32",
         written_with(aovs={name: layer[:, :-1] for name, layer in files.aovs.items()})),
        ("image.cryptomattes: has no 'Object'", written_with(cryptomattes={})),
        ("image.cryptomattes: is 48x31 pixels", written_with(cryptomattes={"Object": ranks[:-1]})),
        (r"cryptomattes\['Object'\]: give height x width x", written_with(cryptomattes={"Object": ranks[..., :3]})),
        (r"cryptomattes\['Object'\]: give height x width x", written_with(cryptomattes={"Object": ranks[0]}))])
    assert not (tmp_path / "not.exr").exists()


def test_a_matte_of_ids(layered, tmp_path):
    described = chain_with("cryptomatte:square", matte_effect="unmoved")
    written = run_command(layered, described, tmp_path)
    chain = postchain.Chain(described)
    found = chain.run(frame_of_ids(1), before=frame_of_ids(0), after=frame_of_ids(2))
    assert (bits(found) == bits(color_of_exr(written))).all()
    with pytest.raises(postchain.InputError, match="no 'sqare' in the crypto.* mean 'square'"):
        postchain.Chain(chain_with("cryptomatte:sqare")).run(frame_of_ids(1))
    with pytest.raises(postchain.InputError, match="has no cryptomatte"):
        chain.run(**planes_of(1), camera=CAMERA)
    # Without a manifest a name is found by its hash.
    unnamed = dict(planes_of(1), cryptomattes={"Object": extras_of(1)["cryptomattes"]["Object"][0]})
    with pytest.warns(postchain.Warning, match="hash of its name"):
        chain.run(**unnamed, camera=CAMERA)


def frame_of_ids(number):
    return postchain.Frame(**planes_of(number), camera=CAMERA, frame=number + 1,
                           cryptomattes=extras_of(number)["cryptomattes"])


def test_a_plan_with_aovs():
    without, plan = (postchain.Chain(FXAA).plan(planes_of(1)["color"], aovs=aovs)
                     for aovs in (None, extras_of(1)["aovs"]))
    assert len(without["textures"]) < len(plan["textures"])


def test_a_neighbor_without_a_layer():
    before = dict(planes_of(0), aovs={"uv": extras_of(0)["aovs"]["uv"]})
    chain, frame = postchain.Chain(BLUR), dict(planes_of(1), aovs=extras_of(1)["aovs"], camera=CAMERA)
    with pytest.warns(postchain.Warning, match="before: lacks these layers.*View.key"):
        found = chain.filter(**frame, before=before)
    without = chain.filter(**frame)
    assert (bits(found.aovs["View.key"]) == bits(without.aovs["View.key"])).all()
    assert (bits(found.aovs["uv"]) != bits(without.aovs["uv"])).any()


def test_a_frame_with_a_matte_and_without():
    """A Frame keeps how it was read with a matte or a fill mask for the next call only if that asks for the same."""
    frame, plain = frame_of(1), postchain.Chain(BLUR)
    matted = postchain.Chain(chain_with("hero"))
    def found(chain, **more):
        return chain.filter(frame, before=frame_of(0), after=frame_of(2), **more)
    expected = [found(chain).color for chain in (plain, matted)]
    assert (bits(expected[0]) != bits(expected[1])).any()
    for fill_mask in (True, True, False):
        for chain, color in zip((matted, plain), reversed(expected)):
            again = found(chain, fill_mask=fill_mask)
            assert (again.fill_mask is not None) == fill_mask and (bits(again.color) == bits(color)).all()


@pytest.mark.parametrize("argument, value, words", [
    ("aovs", [1], "aovs: is a list; give a dict of arrays by name"),
    ("aovs", {"a": numpy.zeros((32, 48), "f4")}, r"aovs\['a'\]: has the shape 32x48; give"),
    ("aovs", {"a": numpy.zeros((32, 48, 3))}, r"aovs\['a'\]: has the type float64; convert"),
    ("aovs", {"a": numpy.zeros((31, 48, 3), "f4")}, "is 48x31 pixels, color 48x32; the planes"),
    ("aovs", {5: numpy.zeros((32, 48, 3), "f4")}, "aovs: 5 is not a name; give a string"),
    ("aovs", {"a,b": numpy.zeros((32, 48, 3), "f4")}, "'a,b' is not a name"),
    ("mattes", {"m": numpy.zeros((32, 48, 3), "f4")}, r"mattes\['m'\]: has the shape 32x48x3"),
    ("mattes", {"Z": numpy.zeros((32, 48), "f4")}, "another array has the channel Z; rename"),
    ("aovs", {"motion": numpy.zeros((32, 48, 3), "f4")}, r"aovs\['motion'\]: another plane or"),
    ("cryptomattes", {"c": numpy.zeros((32, 48, 6), "f4")}, "32x48x6; give height x width x 4, 8"),
    ("cryptomattes", {"c": numpy.zeros((32, 48, 4), "f2")}, "float16, and ids are the bits of"),
    ("cryptomattes", {"c": (numpy.zeros((32, 48, 4), "f4"), 5)}, "its manifest is a int; give a d"),
])
def test_wrong_arrays(argument, value, words):
    with pytest.raises(postchain.UsageError, match=words) as caught:
        postchain.Chain(BLUR).filter(**planes_of(0), camera=CAMERA, **{argument: value})
    assert caught.value.place.startswith(argument) and caught.value.remedy


def test_names_of_planes():
    """A matte must not become the alpha, depth or motion that the frame lacks."""
    color, matte = planes_of(0)["color"][..., :3], numpy.zeros((HEIGHT, WIDTH), "f4")
    expect_errors((postchain.UsageError, words, lambda more=more: postchain.Frame(color, **more)) for words, more in [
        (r"mattes\['A'\]: the channel A is one of color; rename", {"mattes": {"A": matte}}),
        (r"mattes\['Z'\]: the channel Z is one of depth", {"mattes": {"Z": matte}}),
        ("motion.x is one of motion", {"mattes": {"motion.x": matte, "motion.y": matte}}),
        (r"mattes\['key.A'\]: the channel key.A is one of aovs\['key'\]",
         {"aovs": {"key": color}, "mattes": {"key.A": matte}})])
    found = postchain.Chain(FXAA).filter(color, aovs={"a\0b": color, "a\0c": color})
    assert list(found.aovs) == ["a\0b", "a\0c"]


def test_wrong_calls():
    matted, fxaa = postchain.Chain(chain_with("hero")), postchain.Chain(FXAA)
    planes, extras = dict(planes_of(1), camera=CAMERA), extras_of(1)
    aovs, mattes = ({key: extras[key]} for key in ("aovs", "mattes"))
    expect_errors((postchain.UsageError, words, call) for words, call in [
        ("mattes: there is no 'hero'; give mattes=", lambda: matted.run(**planes)),
        ("before: mattes: there is no 'hero'", lambda: matted.run(**planes, **mattes, before=planes_of(0))),
        ("before: is frame 3, but the one before frame 2 is frame 1",
         lambda: fxaa.filter(frame_of(1), before=frame_of(2))),
        ("call filter", lambda: fxaa.run(frame_of(1))),
        ("give them to Frame", lambda: fxaa.filter(frame_of(1), **aovs)),
        ("cryptomatte: unknown policy", lambda: frame_of(1, cryptomatte="blur")),
        ("aovs: run.. returns the color; call filter", lambda: fxaa.run(planes["color"], **aovs))])
