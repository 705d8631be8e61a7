"""Chain.filter(), frames(), write() and what a Frame holds, against the command."""
import json

import numpy
import postchain
import pytest
from conftest import (ALONE, BLUR, CAMERA, FXAA, HEIGHT, WIDTH, bits, channels_of_exr, color_of_exr,
                      command, expect_errors, planes_of, write_exr)


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """A generated scene with the layer behind."""
    folder = tmp_path_factory.mktemp("wheels")
    postchain.scene("wheels", folder, size=(WIDTH, HEIGHT), frames="1-3", behind=True)
    return folder


def run(folder, out, *words):
    command("run", folder / "blur.yaml", "-i", folder / "frame.####.exr",
            "--camera", folder / "camera.json", "--frames", 2, "-o", out / "out.####.exr", *words)
    return out / "out.0002.exr"


def test_stages_fill_mask_and_times(frames, tmp_path):
    path = run(frames, tmp_path, "--dump-stages", tmp_path / "stages", "--fill-mask", "fill")
    chain = postchain.Chain(BLUR)
    given = dict(planes_of(1), before=planes_of(0), after=planes_of(2), camera=CAMERA, frame=2)
    found = chain.filter(**given, fill_mask=True, stages=True)
    assert (bits(found.color) == bits(color_of_exr(path))).all()
    expected = channels_of_exr(path, ["fill.frame", "fill.neighbor", "fill.background"])
    numpy.testing.assert_allclose(found.fill_mask, expected, atol=1e-3)  # halves in the file
    written = {one.name for one in (tmp_path / "stages").rglob("*.exr")}
    assert len(written) == len(found.stages) and len(written) > 2
    assert list(found.times_ms) == ["0.motion_blur"] and found.times_ms["0.motion_blur"] > 0

    name = next(iter(found.stages))
    one = chain.filter(**given, stages=[name])
    assert list(one.stages) == [name] and one.fill_mask is None
    assert (bits(one.color) == bits(found.color)).all()
    with pytest.raises(postchain.UsageError, match="stages: unknown stage .*nothing"):
        chain.filter(**given, stages=["nothing"])


def test_the_layer_behind(wheels, tmp_path):
    chain = wheels / "chain.yaml"
    chain.write_text(json.dumps(BLUR))
    words = ["run", chain, "-i", wheels / "sharp.####.exr", "--camera", wheels / "camera.json",
             "--frames", 2]
    command(*words, "-o", tmp_path / "without.####.exr")
    command(*words, "--behind", wheels / "behind.####.exr", "-o", tmp_path / "with.####.exr")
    expected, without = (postchain.read(tmp_path / f"{name}.0002.exr").planes()["color"]
                         for name in ("with", "without"))
    assert (bits(expected) != bits(without)).any()

    def read(number, pattern="{0}/sharp.####.exr", **more):
        return postchain.read(pattern.format(wheels), number, wheels / "camera.json", **more)
    given = {"before": read(1), "after": read(3)}
    both = read(2, "color={0}/sharp.####.exr,behind={0}/behind.####.exr")
    found = postchain.Chain(BLUR).run(both, **given)
    assert (found.astype("f2") == expected).all(), "the scene's color is half"
    again = postchain.Chain(BLUR).run(read(2, behind=wheels / "behind.####.exr"), **given)
    assert (bits(again) == bits(found)).all()
    # The same from arrays.
    here, behind = read(2), read(2, "{0}/behind.####.exr")

    def arrays(frame):
        planes = frame.planes()
        return {"color": planes["color"], "depth": planes["inverse_depth"],
                "motion": planes["motion"], "motion_back": planes["motion_back"]}
    frame = postchain.Frame(**arrays(here), depth_encoding="inverse", camera=here.camera, frame=2,
                            behind=postchain.Frame(**arrays(behind), depth_encoding="inverse"))
    assert (bits(postchain.Chain(BLUR).run(frame, **given)) == bits(found)).all()
    lacking = postchain.Frame(arrays(behind)["color"])
    with pytest.raises(postchain.InputError, match="the layer behind has no inverse_depth"):
        postchain.Chain(BLUR).run(**planes_of(1), **ALONE, camera=CAMERA, behind=lacking)
    with pytest.warns(postchain.Warning, match="behind: not read"):
        postchain.Chain(FXAA).run(planes_of(1)["color"], depth=planes_of(1)["depth"],
                                  behind=planes_of(0))


def test_layers_and_mattes_of_a_frame(tmp_path):
    planes, matte = planes_of(0), planes_of(0)["depth"] / 16
    matte[matte > 1] = 0
    more = {"hero": matte[..., None]}
    more.update({f"key.{letter}": planes["color"][..., i:i + 1] / 2
                 for i, letter in enumerate("RGB")})
    write_exr(tmp_path / "a.exr", planes, more)
    frame = postchain.read(tmp_path / "a.exr", aovs=["key"])
    assert list(frame.aovs()) == ["key"]
    assert (frame.aovs()["key"] == planes["color"][..., :3] / 2).all()
    assert (frame.mattes("hero")["hero"] == matte).all() and frame.cryptomattes() == {}
    of_arrays = postchain.Frame(planes["color"], aovs=frame.aovs(), mattes={"hero": matte})
    assert (of_arrays.aovs()["key"] == frame.aovs()["key"]).all()
    assert (of_arrays.mattes("hero")["hero"] == matte).all()
    assert postchain.read(tmp_path / "a.exr").aovs() == {}
    expect_errors([(postchain.InputError, "hera", lambda: frame.mattes("hera")),
                   (postchain.UsageError, "no name is given", frame.mattes)])


def test_frames_of_a_sequence(frames, tmp_path):
    camera, pattern = frames / "camera.json", frames / "frame.####.exr"
    postchain.run_sequence(BLUR, pattern, tmp_path / "all.####.exr", camera=camera)
    postchain.run_sequence(BLUR, pattern, tmp_path / "cut.####.exr", camera=camera, cuts=1)
    chain = postchain.Chain(BLUR)
    for name, settings in (("all", {}), ("cut", {"cuts": 1})):
        shots = postchain.frames(pattern, camera, **settings)
        numbers = []
        for shot in shots:
            numbers.append(shot.frame.number)
            color = chain.run(shot.frame, before=shot.before, after=shot.after)
            path = tmp_path / f"{name}.{shot.frame.number:04}.exr"
            assert (bits(color) == bits(color_of_exr(path))).all(), path.name
        assert numbers == [1, 2, 3]
    shot, = postchain.frames(pattern, frames=2)
    assert (shot.before.number, shot.after.number) == (1, 3)
    seen = list(postchain.frames(pattern))
    assert seen[0].before is None and seen[2].after is None
    assert seen[0].after is seen[1].frame is seen[2].before, "read twice"
    expect_errors([
        (postchain.InputError, "frame.0007.exr: frame is not on disk", lambda: postchain.frames(pattern, frames=7)),
        (TypeError, r"^frames\(\) got .*'output'; it is an argument of run_",
         lambda: postchain.frames(pattern, output="x"))])


def test_frames_of_several_crops(tmp_path):
    """Neighbors may be cropped otherwise, as the command allows."""
    for number in (1, 2, 3):
        write_exr(tmp_path / f"a.{number:04}.exr", planes_of(number - 1), left=4 * (number - 1))
    pattern = tmp_path / "a.####.exr"
    postchain.run_sequence(BLUR, pattern, tmp_path / "out.####.exr", CAMERA, data_window="keep")
    for shot in postchain.frames(pattern, CAMERA, data_window="keep"):
        found = postchain.Chain(BLUR).run(shot.frame, before=shot.before, after=shot.after)
        expected = color_of_exr(tmp_path / f"out.{shot.frame.number:04}.exr")
        assert (bits(found) == bits(expected)).all(), shot.frame.number


def test_write(frames, tmp_path):
    expected = run(frames, tmp_path)
    shot, = postchain.frames(frames / "frame.####.exr", frames / "camera.json", frames=2)
    found = postchain.Chain(BLUR).filter(shot.frame, before=shot.before, after=shot.after)
    # As run writes it: other channels are those of the frame.
    postchain.write(tmp_path / "a.exr", found, shot.frame)
    names = ["R", "G", "B", "A", "Z", "motion.x", "motion_back.y"]
    assert (bits(channels_of_exr(tmp_path / "a.exr", names))
            == bits(channels_of_exr(expected, names))).all()
    # A new file.
    postchain.write(tmp_path / "b.exr", found.color)
    assert (bits(color_of_exr(tmp_path / "b.exr")) == bits(found.color)).all()
    postchain.write(tmp_path / "b.exr", found.color[..., :3], half=True, on_existing="overwrite")
    half = channels_of_exr(tmp_path / "b.exr", "RGB")
    assert (half == found.color[..., :3].astype("f2")).all()
    masked = postchain.Chain(BLUR).filter(shot.frame, before=shot.before, after=shot.after, fill_mask=True)
    aovs = masked._replace(aovs={"key": found.color[..., :3]})
    postchain.write(tmp_path / "new" / "c.exr", aovs, mkdir=True)
    assert (channels_of_exr(tmp_path / "new" / "c.exr", ["key.R", "key.G", "key.B"]) == found.color[..., :3]).all()
    mask = channels_of_exr(tmp_path / "new" / "c.exr", ["fill.frame", "fill.neighbor", "fill.background"])
    assert masked.fill_mask.any() and (mask == masked.fill_mask.astype("f2")).all()
    with pytest.warns(postchain.Warning, match="f.exr: 1 pixels? clamped"):
        bright = found.color.copy()
        bright[3, 4, 1] = 1e6
        postchain.write(tmp_path / "f.exr", bright, half=True, overflow="clamp")
    assert channels_of_exr(tmp_path / "f.exr", "G").max() == 65504
    shown = numpy.minimum(found.color, found.color[..., 3:])  # a PNG has no light above its alpha
    postchain.write(tmp_path / "d.png", shown)
    assert postchain.diff(tmp_path / "d.png", shown)["psnr"] > 60
    bad = tmp_path / "e.exr"
    expect_errors([
        (postchain.OutputError, "on_existing='overwrite'", lambda: postchain.write(tmp_path / "b.exr", found.color)),
        (postchain.UsageError, "AOVs and a fill mask need an EXR", lambda: postchain.write(tmp_path / "e.png", aovs)),
        (postchain.UsageError, "48x31 pixels, the frame 48x32", lambda: postchain.write(bad, found.color[:-1], shot.frame)),
        (postchain.UsageError, "47x32 pixels, the frame 48x32",
         lambda: postchain.write(bad, found.color[:, :-1], shot.frame)),
        (postchain.UsageError, "AOVs and a fill mask need an EXR", lambda: postchain.write(tmp_path / "e.png", masked)),
        (postchain.UsageError, "skip is for runs", lambda: postchain.write(bad, found.color, on_existing="skip")),
        (postchain.Error, "65504|largest", lambda: postchain.write(bad, bright, half=True)),
        (postchain.UsageError, "frame: is a str", lambda: postchain.write(bad, found.color, "frame")),
        (postchain.UsageError, "not a NumPy array", lambda: postchain.write(bad, [1, 2])),
        (postchain.Error, "frame.0002.exr",
         lambda: postchain.write(frames / "frame.0002.exr", found, shot.frame, on_existing="overwrite"))])
