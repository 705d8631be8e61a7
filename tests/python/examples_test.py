"""The examples of tools/python/examples run as they are, and the ten lines of docs/python.md."""
import re
import subprocess
import sys

import numpy
import postchain
import pytest
from conftest import CAMERA, ROOT, bits, color_of_exr, planes_of

EXAMPLES = ROOT / "tools/python/examples"


def example(name, *words, code=0):
    done = subprocess.run([sys.executable, "-B", EXAMPLES / name, *map(str, words)], text=True,
                          capture_output=True, check=False)
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


@pytest.fixture
def fast(tmp_path):
    path = tmp_path / "fast.yaml"
    path.write_text("postchain: 1\npasses:\n  - motion_blur: {mode: inverse_warp, samples: 9}\n")
    return path


def test_filter_folder(frames, fast, tmp_path):
    words = [frames, tmp_path / "out", "--chain", fast, "--camera", frames / "camera.json"]
    out = example("filter_folder.py", *words)
    assert "3/3" in out and "frame.####.exr: 3 written, 0 skipped, 0 failed" in out
    assert len(list((tmp_path / "out").glob("frame.*.exr"))) == 3
    assert "0 written, 3 skipped" in example("filter_folder.py", *words)
    error = example("filter_folder.py", tmp_path / "none", tmp_path / "out", code=1)
    assert "error: " in error and "Traceback" not in error


def test_sweep(frames, fast, tmp_path):
    pattern = frames / "frame.####.exr"
    out = example("sweep.py", pattern, pattern, "--camera", frames / "camera.json", "--frame", 2,
                  "--chain", fast, "--key", "motion_blur.samples", "--values", 9, 17, "-o",
                  tmp_path / "sweep.png")
    assert len(re.findall(r"motion_blur.samples \d+: [\d.]+ ms, hdr_flip 0\.\d+", out)) == 2
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_custom_loader(fast, tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    planes = [planes_of(number) for number in range(3)]
    for number, one in enumerate(planes):
        one.pop("motion_back")
        numpy.savez(folder / f"{number}.npz", **one, **CAMERA)
    example("custom_loader.py", folder / "*.npz", tmp_path / "out", "--chain", fast)
    found = numpy.load(tmp_path / "out/1.npy")
    expected = postchain.Chain(fast).run(**planes[1], camera=CAMERA, frame=1, before=planes[0],
                                         after=planes[2])
    assert (bits(found) == bits(expected)).all()


def test_frame_by_frame(frames, fast, tmp_path):
    out = example("frame_by_frame.py", frames / "frame.####.exr", tmp_path / "out" / "a.####.exr",
                  "--chain", fast, "--camera", frames / "camera.json")
    assert len(re.findall(r"a\.000\d\.exr: 0\.motion_blur [\d.]+ ms", out)) == 3
    postchain.run_sequence(fast, frames / "frame.####.exr", tmp_path / "b.####.exr",
                           camera=frames / "camera.json")
    for number in ("0001", "0002", "0003"):
        found, expected = (color_of_exr(tmp_path / name) for name in (
            f"out/a.{number}.exr", f"b.{number}.exr"))
        assert (bits(found) == bits(expected)).all()


def test_the_first_lines_of_the_page(tmp_path, monkeypatch):
    page = (ROOT / "docs/python.md").read_text()
    code = re.search(r"```python\n(.*?)```", page, re.S)[1]
    assert len(code.splitlines()) <= 10
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace("(640, 360)", "(48, 27)"), "docs/python.md", "exec"), {})
    assert (tmp_path / "out/shot.0001.exr").exists()
