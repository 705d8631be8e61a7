"""ab(), bench(), study(), check() and sheet() against the command."""
import json
import threading

import postchain
import pytest
from conftest import BLUR, FXAA, command, expect_errors

SETTINGS = {"repeats": 1, "page_frames": 1, "stability_frames": 0}
OPTIONS = ["--repeats", 1, "--page-frames", 1, "--stability-frames", 0]


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chains")
    (folder / "blur.yaml").write_text(json.dumps(BLUR))
    (folder / "fxaa.yaml").write_text(json.dumps(FXAA))
    return folder


def metrics_of(report):
    return [{name: one["mean"] for name, one in variant["metrics"].items() if name != "time_ms"}
            for variant in report["variants"]]


def test_ab(frames, chains, tmp_path):
    pattern, camera = frames / "frame.####.exr", frames / "camera.json"
    command("ab", chains / "blur.yaml", chains / "fxaa.yaml", "-i", pattern, "--camera", camera,
            "--truth", pattern, "--frames", "1-2", "-o", tmp_path / "a", *OPTIONS)
    expected = json.loads((tmp_path / "a" / "report.json").read_text())
    seen = []
    found = postchain.ab(chains / "blur.yaml", postchain.Chain(FXAA), pattern, tmp_path / "b",
                         camera, truth=pattern, frames="1-2", progress=seen.append, **SETTINGS)
    assert metrics_of(found) == metrics_of(expected) and found["kind"] == "ab"
    assert found["page"] == str(tmp_path / "b" / "index.html")
    assert (tmp_path / "b" / "index.html").exists() and seen[-1]["total"] > 0
    written = json.loads((tmp_path / "b" / "report.json").read_text())
    assert written == {key: value for key, value in found.items() if key != "page"}
    expect_errors((kind, words, lambda out=out, more=more: postchain.ab(
        BLUR, FXAA, pattern, tmp_path / out, camera, **more)) for kind, words, out, more in [
            (postchain.OutputError, "on_existing='overwrite'", "b", SETTINGS),
            (TypeError, "'repeat'; did you mean 'repeats'", "c", {"repeat": 1}),
            (postchain.CanceledError, "", "c", {"progress": lambda now: False})])


def test_bench(frames, chains, tmp_path):
    pattern, camera = frames / "frame.####.exr", frames / "camera.json"
    command("bench", chains / "blur.yaml", "-i", pattern, "--camera", camera, "--truth", pattern,
            "--frames", 2, "--sweep", "motion_blur.samples=5,9", "-o", tmp_path / "a", *OPTIONS)
    expected = json.loads((tmp_path / "a" / "report.json").read_text())
    found = postchain.bench(chains / "blur.yaml", pattern, tmp_path / "b", camera, truth=pattern,
                            frames=2, sweep={"motion_blur.samples": [5, 9]}, under={"flip": 1},
                            **SETTINGS)
    assert metrics_of(found) == metrics_of(expected) and len(found["variants"]) == 2
    assert found["met"] and (tmp_path / "b" / "under_flip.yaml").exists()
    alone = postchain.bench(FXAA, pattern, tmp_path / "d", truth=pattern, frames=2, **SETTINGS)
    assert len(alone["variants"]) == 1 and "motion_blur" not in alone["variants"][0]["name"]
    # A variant that fails is a warning.
    lens = {"camera": {"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 2}, "postchain": 1,
            "passes": ["depth_of_field"]}
    with pytest.warns(postchain.Warning, match="=0.01: .*is not beyond the focal length"):
        partly = postchain.bench(lens, pattern, tmp_path / "e", truth=pattern, frames=2,
                                 sweep={"camera.focus_distance": [4, 0.01]}, **SETTINGS)
    assert [bool(one["metrics"]) for one in partly["variants"]] == [True, False]
    # Results are kept, as by the command.
    again = postchain.bench(chains / "blur.yaml", pattern, tmp_path / "b", camera, truth=pattern,
                            frames=2, sweep={"motion_blur.samples": [5, 9]}, **SETTINGS)
    assert metrics_of(again) == metrics_of(found)
    expect_errors((postchain.UsageError, words, lambda more=more: postchain.bench(
        BLUR, pattern, tmp_path / "c", **more)) for words, more in [
            ("sweep: is a list; give a dict", {"sweep": ["samples=5"]}),
            ("motion_blur.mode", {"sweep": {"motion_blur.mode": ["guertin", "gertin"]}}),
            ("under: no metric .fl1p.; did you mean", {"under": {"fl1p": 1}})])


def test_study(frames, chains, tmp_path):
    study = tmp_path / "study.yaml"
    study.write_text(json.dumps({
        "postchain_study": 1, "title": "test", "kind": "ab",
        "chains": {"blur": str(chains / "blur.yaml"), "fxaa": str(chains / "fxaa.yaml")},
        "questions": [["blur", "fxaa"]],
        "settings": SETTINGS,
        "scenes": [{"name": "square", "input": str(frames / "frame.####.exr"),
                    "camera": str(frames / "camera.json"),
                    "truth": str(frames / "frame.####.exr")}]}))
    command("study", study, "-o", tmp_path / "a")
    expected = json.loads((tmp_path / "a" / "report.json").read_text())
    found = postchain.study(study, tmp_path / "b")
    page = found.pop("page")
    for report in (found, expected):
        report.pop("revisions")  # of module and command, which may not be built at once
    assert found == expected and page == str(tmp_path / "b" / "index.html")
    # In two chunks; the last one writes the report.
    half = postchain.study(study, tmp_path / "e", chunk="1/2")
    assert half["results"] + 1 == half["tasks"] and not (tmp_path / "e" / "report.json").exists()
    chunked = postchain.study(study, tmp_path / "e", chunk="2/2")
    assert chunked["scenes"] == found["scenes"] and (tmp_path / "e" / "index.html").exists()
    event = threading.Event()
    event.set()
    (tmp_path / "bad.yaml").write_text("postchain_study: 1")
    expect_errors([
        (postchain.UsageError, "chunk: ", lambda: postchain.study(study, tmp_path / "c", chunk="3/2")),
        (postchain.CanceledError, "", lambda: postchain.study(study, tmp_path / "c", stop=event)),
        (postchain.UsageError, "", lambda: postchain.study(tmp_path / "bad.yaml", tmp_path / "d"))])


def test_check(frames, tmp_path):
    pattern = tmp_path / "out.####.exr"
    postchain.run_sequence(FXAA, frames / "frame.####.exr", pattern)
    assert postchain.check(pattern) == json.loads(command("check", pattern, "--json"))
    assert postchain.check(pattern)["whole"]
    (tmp_path / "out.0002.exr").unlink()
    found = postchain.check([pattern], frames="1-4")
    assert found == json.loads(command("check", pattern, "--frames", "1-4", "--json", code=1))
    assert not found["whole"] and found["sequences"][0]["counts"]["missing"] == 2
    with pytest.raises(postchain.InputError, match="like: .*nothing.exr"):
        postchain.check(pattern, like=tmp_path / "nothing.exr")


def test_sheet(frames, tmp_path):
    pattern = frames / "frame.####.exr"
    command("sheet", pattern, "-o", tmp_path / "a.png", "--width", 32, "--beside", pattern,
            "--frames", "1-3")
    found = postchain.sheet(pattern, tmp_path / "b.png", width=32, beside=pattern, frames="1-3")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert found == {"frames": 3, "of": 3, "absent": 0}
    seen = []
    small = postchain.sheet(pattern, tmp_path / "d.png", width=32, cells=2, columns=1, progress=seen.append)
    assert (small["frames"], small["of"]) == (2, 3)
    assert seen == [{"frame": 1, "done": 0, "total": 2}, {"frame": 3, "done": 1, "total": 2}]
    command("sheet", pattern, "-o", tmp_path / "e.png", "--width", 32, "--cells", 2, "--columns", 1)
    assert (tmp_path / "d.png").read_bytes() == (tmp_path / "e.png").read_bytes()
    expect_errors((kind, words, lambda out=out, more=more: postchain.sheet(pattern, tmp_path / out, **more))
                  for kind, words, out, more in [
        (postchain.OutputError, "on_existing='overwrite'", "b.png", {}),
        (TypeError, "'png'", "c.png", {"png": True}),
        (postchain.UsageError, "width: 9 is not in 16..4096", "c.png", {"width": 9}),
        (postchain.UsageError, "width: 4097 is not", "c.png", {"width": 4097}),
        *((postchain.UsageError, f"{key}: {value} is not in", "c.png", {key: value})
          for key, value in (("cells", 0), ("cells", 10001), ("columns", -1), ("columns", 10001))),
        (postchain.CanceledError, "", "c.png", {"progress": lambda now: False}),
        (postchain.UsageError, "does not end in .png", "c.jpg", {})])
