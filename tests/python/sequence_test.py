"""run_sequence(), plan_sequence(), inspect(), diff() and scene() against the command."""
import json
import threading

import numpy
import postchain
import pytest
from conftest import (BLUR, CAMERA, FXAA, bits, color_of_exr, command, expect_errors, planes_of,
                      python)


def test_run_sequence_writes_the_bytes_of_the_command(frames, tmp_path):
    camera, pattern = frames / "camera.json", frames / "frame.####.exr"
    command("run", frames / "blur.yaml", "-i", pattern, "--camera", camera, "-o",
            tmp_path / "a.####.exr", "--compression", "zips", "--no-sidecar", "--frames", "1-2")
    reports = []
    summary = postchain.run_sequence(
        frames / "blur.yaml", pattern, tmp_path / "b.####.exr", camera=camera, compression="zips",
        sidecar=False, frames=range(1, 3), progress=reports.append)
    for number in (1, 2):
        name = f"{number:04}.exr"
        assert (tmp_path / f"a.{name}").read_bytes() == (tmp_path / f"b.{name}").read_bytes()
    assert (summary["total"], summary["written"], summary["left"]) == (2, 2, 0)
    assert not summary["canceled"] and summary["elapsed_s"] > 0
    assert [(one["frame"], one["outcome"], one["done"], one["total"]) for one in reports] == [
        (1, "written", 1, 2), (2, "written", 2, 2)]
    assert not (tmp_path / "b.0001.exr.json").exists()


def test_a_camera_as_a_dict(frames, tmp_path):
    postchain.run_sequence(BLUR, frames / "frame.####.exr", tmp_path / "a.####.exr", CAMERA,
                           frames=2)
    found = color_of_exr(tmp_path / "a.0002.exr")
    before, frame, after = (planes_of(number) for number in range(3))
    expected = postchain.Chain(BLUR).run(**frame, camera=CAMERA, frame=2, before=before,
                                         after=after)
    assert (bits(found) == bits(expected)).all()
    sidecar = json.loads((tmp_path / "a.0002.exr.json").read_text())
    assert sidecar["version"] == postchain.__version__
    again = postchain.run_sequence(BLUR, frames / "frame.####.exr", tmp_path / "a.####.exr", CAMERA,
                                   frames=2, on_existing="skip")
    assert again["skipped"] == 1


def test_frames_as_arrays_of_numpy(frames, tmp_path):
    for given in (numpy.array([2, 1]), [numpy.int64(1), 2], (1, 2), numpy.array(2)):
        summary = run_fxaa(frames, tmp_path, frames=given, on_existing="overwrite")
        assert summary["written"] == numpy.size(given)


class BytesPath:
    def __fspath__(self):
        return b"a.exr"


def run_fxaa(folder, out, **settings):
    return postchain.run_sequence(FXAA, folder / "frame.####.exr", out / "out.####.exr", **settings)


def test_a_callback_or_an_event_ends_the_run(frames, tmp_path):
    def fails(report):
        raise KeyError(report["frame"])
    with pytest.raises(KeyError, match="1"):
        run_fxaa(frames, tmp_path, progress=fails)
    summary = run_fxaa(frames, tmp_path, progress=lambda report: False, on_existing="overwrite")
    assert summary["canceled"] and summary["written"] >= 1
    assert summary["written"] + summary["left"] == 3
    event = threading.Event()
    event.set()
    # Waits for a frame that never comes.
    summary = run_fxaa(frames, tmp_path, frames="1-9", watch=True, stop=event, on_existing="overwrite")
    assert summary["canceled"] and summary["total"] == 9


def test_failures(frames, tmp_path):
    expect_errors((kind, words, lambda more=more: run_fxaa(frames, tmp_path, **more)) for kind, words, more in [
        (postchain.UsageError, "frames: .*'x'", {"frames": "x"}),
        (postchain.UsageError, "frames: is empty", {"frames": []}),
        (postchain.UsageError, "frames: is a float", {"frames": numpy.array([1.5])}),
        (postchain.UsageError, "on_existing: .*one of fail, overwrite, skip", {"on_existing": "ask"}),
        (postchain.UsageError, "mkdir: is a str", {"mkdir": "yes"}),
        (postchain.UsageError, "progress: is not callable", {"progress": 5}),
        (postchain.UsageError, "stop: has no is_set", {"stop": 5}),
        (postchain.UsageError, "frames: is a bool", {"frames": True}),
        (postchain.UsageError, "max_memory: .*is too large a number", {"max_memory": 1 << 64}),
        (postchain.UsageError, "camera: is a path of bytes", {"camera": BytesPath()}),
        (postchain.InputError, "missing.json", {"camera": "missing.json"}),
        (postchain.InputError, "on disk", {"frames": "7"})])
    expect_errors([(postchain.UsageError, "input: is a int",
                    lambda: postchain.run_sequence(FXAA, 5, tmp_path / "out.exr"))])
    assert not list(tmp_path.iterdir())
    damaged = tmp_path / "bad.0001.exr"
    damaged.write_bytes((frames / "frame.0001.exr").read_bytes()[:-4000])
    with pytest.raises(postchain.InputError, match="bad.0001.exr") as caught:
        postchain.run_sequence(FXAA, tmp_path / "bad.####.exr", tmp_path / "out.####.exr")
    assert caught.value.place == str(damaged)
    summary = postchain.run_sequence(FXAA, tmp_path / "bad.####.exr", tmp_path / "out.####.exr",
                                     on_error="continue")
    assert summary["failed"] == 1 and summary["left"] == 0


def test_an_output_that_the_run_reads(frames, tmp_path):
    """Pictures of a camera's dict, or of the chain's, are inputs as those of its file are."""
    aperture = tmp_path / "aperture.exr"
    postchain.write(aperture, numpy.ones((9, 9, 3), "f4"))
    before, one = aperture.read_bytes(), {"aperture_image": str(aperture)}
    def run(chain=FXAA, camera=None, output=aperture):
        return lambda: postchain.run_sequence(chain, frames / "frame.0001.exr", output, camera, on_existing="overwrite")
    (tmp_path / "fxaa.exr").write_text(json.dumps(FXAA))
    expect_errors([
        (postchain.UsageError, "aperture.exr", run(camera=one)),
        (postchain.UsageError, "aperture.exr", run(camera={"frames": {"1": one}})),
        (postchain.UsageError, "aperture.exr", run(dict(FXAA, camera=one))),
        (postchain.UsageError, "the chain file", run(tmp_path / "fxaa.exr", output=tmp_path / "fxaa.exr"))])
    assert aperture.read_bytes() == before


def test_plan_sequence(frames):
    expected = command("plan", frames / "blur.yaml", "-i", frames / "frame.####.exr", "--camera",
                       frames / "camera.json", "--json").splitlines()
    found = postchain.plan_sequence(frames / "blur.yaml", frames / "frame.####.exr",
                                    camera=frames / "camera.json")
    assert all(one.pop("warnings") == [] for one in found)
    assert found == [json.loads(line) for line in expected]
    with pytest.raises(postchain.ChainError, match="frame.0001.exr.*focal_length_mm"):
        postchain.plan_sequence({"postchain": 1, "passes": ["depth_of_field"]},
                                frames / "frame.####.exr")


def test_inspect(frames):
    first, sequence = command("inspect", frames / "frame.####.exr", "--json").splitlines()
    assert postchain.inspect(frames / "frame.####.exr") == {
        "frames": [json.loads(first)], "sequence": json.loads(sequence)["sequence"]}
    assert postchain.inspect(frames) == json.loads(command("inspect", frames, "--json"))
    one = postchain.inspect(frames / "frame.0001.exr")
    assert list(one) == ["frames"] and one["frames"][0]["match"]["profile"] == "generic"
    pattern = frames / "frame.####.exr"
    expect_errors([
        (postchain.InputError, "no such file", lambda: postchain.inspect(frames / "other.exr")),
        (postchain.UsageError, "is a folder.*give a sequence", lambda: postchain.inspect(frames, camera=CAMERA)),
        # Settings that have no effect here.
        *((TypeError, f"'{key}'; it is an argument of run_sequence",
           lambda key=key: postchain.inspect(pattern, **{key: True}))
          for key in ("watch", "png", "dump_stages", "precision")),
        (TypeError, "'on_existing'; it is an argument of run_sequence",
         lambda: postchain.plan_sequence(FXAA, pattern, on_existing="skip"))])


def test_read_names_one_frame(frames):
    pattern = frames / "frame.####.exr"
    expect_errors([
        (postchain.UsageError, "frame: is a str; give an integer", lambda: postchain.read(pattern, "1")),
        (postchain.UsageError, "has 3 frames; name one", lambda: postchain.read(pattern)),
        (postchain.InputError, "frame is not on disk", lambda: postchain.read(pattern, frame=9))])


def test_diff(frames, tmp_path):
    first, second = frames / "frame.0001.exr", frames / "frame.0002.exr"
    expected = json.loads(command("diff", first, second, "--json"))
    metrics = [key for key in expected
               if key not in ("frame", "a", "b", "nonfinite_reference", "settings")]
    assert len(metrics) >= 13
    expected = {key: expected[key] for key in metrics}
    a, b = planes_of(0)["color"], planes_of(1)["color"]
    assert postchain.diff(first, second) == expected
    assert postchain.diff(a, b) == expected
    assert postchain.diff(a, b, metrics=["psnr", "ssim"]) == {
        key: expected[key] for key in ("psnr", "ssim")}
    assert postchain.diff(a, a)["psnr"] is None and postchain.diff(a, a)["flip"] == 0
    over = json.loads(command("diff", first, second, "--json", "--over", 0.25))
    found = postchain.diff(a, b, over=0.25)
    assert found == {key: over[key] for key in metrics} and found != expected
    assert postchain.diff([a], [b]) == {"frames": [expected], "summary": expected}

    mapped = postchain.diff(a, b, map="difference")["map"]
    assert mapped.shape == a.shape[:2]
    assert mapped == pytest.approx(numpy.abs(a - b)[..., :3].max(-1))


def test_diff_of_sequences(frames, tmp_path):
    a = [planes_of(number)["color"] for number in (0, 1, 2)]
    b = [0.9 * one for one in a]
    both = postchain.diff(a, b)
    assert len(both["frames"]) == 3
    assert both["frames"][0]["tde"] is None and both["frames"][0]["temporal_error"] is None
    change = [numpy.abs((y1 - x1) - (y0 - x0))[..., :3].mean()
              for x0, x1, y0, y1 in zip(a, a[1:], b, b[1:])]
    assert both["summary"]["tde"] == pytest.approx(numpy.mean(change), rel=1e-5)
    shown = [[(numpy.maximum(x, 0) / (1 + numpy.maximum(x, 0)))[..., :3] ** (1 / 2.2) for x in side] for side in (a, b)]
    truth, test = (numpy.diff(side, axis=0) for side in shown)
    rms = [numpy.sqrt((one ** 2).mean((1, 2, 3))) for one in (test - truth, truth)]
    assert both["summary"]["temporal_error"] == pytest.approx(numpy.mean(rms[0] / rms[1]), rel=1e-5)
    assert set(postchain.diff(a, b, metrics=["temporal_error"])["summary"]) == {"nonfinite", "temporal_error"}
    files = postchain.diff(frames / "frame.####.exr", frames / "frame.####.exr")
    assert files["summary"]["hdr_flip"] == 0 and len(files["frames"]) == 3
    for number in (2, 3, 4):
        (tmp_path / f"other.{number:04}.exr").symlink_to(frames / f"frame.{number - 1:04}.exr")
    expect_errors([
        (postchain.InputError, "the frames of the patterns differ",
         lambda: postchain.diff(frames / "frame.####.exr", tmp_path / "other.####.exr")),
        (postchain.InputError, "none.####.exr", lambda: postchain.diff(tmp_path / "none.####.exr", b))])


def test_wrong_diffs():
    a = planes_of(0)["color"]
    expect_errors([
        (postchain.InputError, "48x31|differ", lambda: postchain.diff(a, a[:-1])),
        (postchain.UsageError, "give one of each", lambda: postchain.diff([a, a], [a])),
        (postchain.UsageError, "give one of each", lambda: postchain.diff(a, [a])),
        (postchain.UsageError, "is empty", lambda: postchain.diff([], [])),
        (postchain.UsageError, "reference: is a int", lambda: postchain.diff(5, a)),
        (postchain.UsageError, "unknown tone mapper 'film'", lambda: postchain.diff(a, a, tone_mapper="film")),
        (postchain.UsageError, "known are flip", lambda: postchain.diff(a, a, metrics=["fl1p"])),
        (postchain.UsageError, "tde needs two frames", lambda: postchain.diff(a, a, metrics=["tde"])),
        (postchain.UsageError, "known are", lambda: postchain.diff(a, a, map="ssim")),
        (postchain.UsageError, "pixels_per_degree", lambda: postchain.diff(a, a, pixels_per_degree=0)),
        (postchain.InputError, "nowhere.exr", lambda: postchain.diff("nowhere.exr", a))])


def test_a_diff_that_the_exit_ends_is_canceled():
    process = python("""
import atexit, sys, threading, time
ends = []
atexit.register(lambda: (thread.join(), print(*ends, flush=True)))  # runs after postchain's
import numpy, postchain
a = numpy.zeros((256, 256, 3), "f4")
def work():
    try:
        ends.append(postchain.diff([a] * 200, [a] * 200))
    except BaseException as error:
        ends.append(type(error).__name__)
thread, begin = threading.Thread(target=work, daemon=True), time.process_time()
thread.start()
while time.process_time() < begin + 0.3:
    time.sleep(0.01)
sys.exit(7)
""")
    out, error = process.communicate(timeout=300)
    assert (process.returncode, out) == (7, "CanceledError\n"), error


def test_scene(tmp_path):
    command("scene", "wheels", "-o", tmp_path / "a", "--size", "32x18", "--frames", "1", "--behind",
            "--deep")
    reports = []
    postchain.scene("wheels", tmp_path / "b", size=(32, 18), frames=1, behind=True, deep=True,
                    progress=reports.append)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert {"behind.0001.exr", "deep.0001.exr"} < set(names)
    assert names == sorted(path.name for path in (tmp_path / "b").iterdir())
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert reports[-1]["frame"] == 1 and reports[-1]["picture"] == "deep"
    done = [one["done"] for one in reports]
    assert done == sorted(done) and 0 <= done[0] < done[-1] <= 1
    postchain.scene("wheels", tmp_path / "lens", size=(32, 18), frames=1, camera={"f_stop": 1.25})
    camera = json.loads((tmp_path / "lens" / "camera.json").read_text())
    assert camera == json.loads((tmp_path / "a" / "camera.json").read_text()) | {"f_stop": 1.25}
    expect_errors((kind, words, lambda name=name, more=more: postchain.scene(name, tmp_path / "c", **more))
                  for kind, words, name, more in [
        (postchain.UsageError, "wheels", "wheel", {}),
        (postchain.UsageError, "camera: is a str; give a dict", "wheels", {"camera": "camera.json"}),
        (postchain.UsageError, "size: 0x9", "wheels", {"size": (0, 9)}),
        (postchain.UsageError, "size: 9x0", "wheels", {"size": (9, 0)}),
        (postchain.UsageError, "size: 16385x9", "wheels", {"size": (16385, 9)}),
        (postchain.UsageError, "size: 9x16385", "wheels", {"size": (9, 16385)}),
        (postchain.UsageError, "fail or overwrite", "wheels", {"on_existing": "skip"}),
        (postchain.CanceledError, "", "wheels", {"progress": lambda report: False, "frames": "1-50"})])
    with pytest.raises(postchain.OutputError, match="exist"):
        postchain.scene("wheels", tmp_path / "b", frames=1)
