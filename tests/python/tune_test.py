"""postchain.tune() against the command, on two frames."""
import json
import threading

import postchain
import pytest
from conftest import BLUR, CAMERA, FXAA, command, expect_errors

# Fields that vary from run to run.
TIMES = ("seconds", "spread_s", "doubt", "repeats", "front", "chosen")


def settings_of(frames, **more):
    return dict({"camera": frames / "camera.json", "frames": "1-2", "repeats": 1, "max_chains": 4,
                 "measure_frames": 2, "chains": frames / "blur.yaml"}, **more)


def tune(frames, **more):
    with pytest.warns(postchain.Warning):  # the walk ends early, the machine may be busy
        return postchain.tune(frames / "frame.####.exr", **settings_of(frames, **more))


def test_the_result_of_the_command(frames, tmp_path):
    words = ["tune", frames / "blur.yaml", "-i", frames / "frame.####.exr", "--camera",
             frames / "camera.json", "--frames", "1-2", "--repeats", "1", "--max-chains", "4",
             "--measure-frames", "2", "--error", "0.9", "-o", tmp_path / "tuned.yaml", "--json"]
    expected = json.loads(command(*words))
    reports = []
    found = tune(frames, error=0.9, progress=reports.append)
    for key in ("version", "input", "frames", "reference", "with_truth", "timing", "budget_s",
                "error"):
        assert found[key] == expected[key], key
    assert len(found["points"]) == len(expected["points"]) == 4
    for one, other in zip(found["points"], expected["points"]):
        chain = one.pop("chain")
        assert chain.hash == one["chain_hash"] and isinstance(chain, postchain.Chain)
        one["chain"] = one.pop("knobs")
        assert {key: value for key, value in one.items() if key not in TIMES} == {
            key: value for key, value in other.items() if key not in TIMES}
        one["chain"] = chain
    points = found["points"]
    assert found["front"] == sorted((one for one in points if one["front"]),
                                    key=lambda one: one["seconds"])
    chosen, = [one for one in points if one["chosen"]]
    assert found["chain"] == chosen["chain"] and chosen["repeats"] == 2
    assert postchain.Chain.from_text(found["text"]) == found["chain"]
    assert found["text"].startswith("# postchain tune ")
    assert reports[0]["what"].startswith("frame 1: the converged") and reports[-1]["total"] == 4
    assert not list(frames.glob("*.yaml.*"))


def test_a_truth_a_budget_and_set_values(frames):
    found = tune(frames, truth=frames / "frame.####.exr", budget=1e3, chains=[BLUR, FXAA],
                 set=None, max_chains=2)
    assert found["with_truth"] and found["budget_s"] == 1000
    assert [one["start"] for one in found["points"]] == ["chain", "chain"]
    best, = [one for one in found["points"] if one["chosen"]]
    assert best["hdr_flip"] == min(one["hdr_flip"] for one in found["points"])
    assert {one["chain"].passes[0] for one in found["points"]} == {"motion_blur", "fxaa"}
    found = tune(frames, budget="5s", max_chains=3, set={"motion_blur.samples": 5}, camera=CAMERA)
    for one in found["points"]:
        assert one["chain"].dict()["passes"][0]["motion_blur"]["samples"] == 5


def test_a_goal_that_no_chain_meets(frames):
    with pytest.warns(postchain.Warning, match="error=1e-09: the closest of 1 chain.*; allow"):
        found = postchain.tune(frames / "frame.####.exr",
                               **settings_of(frames, error=1e-9, max_chains=1))
    assert found["chain"] is None and found["text"] is None and len(found["front"]) == 1


def test_wrong_arguments(frames):
    event = threading.Event()
    event.set()
    expect_errors((kind, words, lambda more=more: postchain.tune(
        frames / "frame.####.exr", **settings_of(frames, **more))) for kind, words, more in [
            (postchain.UsageError, "give a time per frame .budget='0.2s'.", {}),
            (postchain.UsageError, "give one of the two", {"budget": 1, "error": 0.1}),
            (postchain.UsageError, "budget: 'x' is not a time above 0", {"budget": "x"}),
            (postchain.UsageError, "budget: .*is not a time above 0", {"budget": -1.0}),
            (postchain.UsageError, "error", {"error": 5}),
            (TypeError, "unexpected keyword argument 'on_existing'", {"error": 0.5, "on_existing": "fail"}),
            (postchain.UsageError, "2 chains are given; name one, or give truth",
             {"error": 0.5, "chains": [BLUR, FXAA]}),
            (postchain.UsageError, "chains: is empty", {"error": 0.5, "chains": []}),
            (postchain.ChainError, "shipped", {"error": 0.5, "chains": "no_such"}),
            (postchain.InputError, "the ground truth has no file",
             {"error": 0.5, "truth": frames / "none.####.exr"}),
            (postchain.CanceledError, "", {"error": 0.5, "progress": lambda report: False}),
            (postchain.CanceledError, "", {"error": 0.5, "stop": event})])
