"""Errors and warnings: TypeError for calls that do not fit a signature, postchain.Error for all else, in
the words of Python."""
import warnings

import postchain
import pytest
from conftest import BLUR, CAMERA, FXAA, expect_errors, planes_of, python


@pytest.mark.parametrize("call, words", [
    (lambda: postchain.run_sequence(FXAA, "a.exr", "b.exr", frame=1),
     r"^run_sequence\(\) got an unexpected keyword argument 'frame'; did you mean 'frames'\?$"),
    (lambda: postchain.Chain(FXAA).run(planes_of(0)["color"], dept=1), r"^run\(\).*'depth'\?"),
    (lambda: postchain.Frame(planes_of(0)["color"], mattres={}), r"^Frame\(\).*'mattes'\?"),
    (lambda: postchain.read("a.exr", output="b.exr"), "it is an argument of run_sequence"),
    (lambda: postchain.tune("a.exr", budget=1, speed=2), "unexpected keyword argument 'speed'$"),
    (lambda: postchain.diff("a.exr"), "incompatible function arguments"),
])
def test_a_call_that_does_not_fit_is_a_type_error(call, words):
    with pytest.raises(TypeError, match=words) as caught:
        call()
    assert not isinstance(caught.value, postchain.Error)


@pytest.mark.parametrize("call, words", [
    (lambda: postchain.diff("a.exr", "b.exr", metrics=5), "metrics: is a int; give a list of names"),
    (lambda: postchain.diff("a.exr", "b.exr", map=1.5), "map: is a float; give a name"),
    (lambda: postchain.diff("a.exr", "b.exr", pixels_per_degree="x"), "give a number"),
    (lambda: postchain.scene("wheels", "out", size="640x360"), "size: is a str; give width and"),
    (lambda: postchain.scene("wheels", "out", truth_samples="many"), "truth_samples: is a str"),
    (lambda: postchain.set_threads("all"), "threads: is a str; give an integer"),
    (lambda: postchain.Chain.from_text(5), "text: is a int; give a string"),
    (lambda: postchain.Chain(FXAA).run(planes_of(0)["color"], depth_encoding=5), "give a name"),
    (lambda: postchain.Frame(planes_of(0)["color"], pixel_aspect="wide"), "give a number"),
    (lambda: postchain.Chain({"postchain": 1, "passes": [{"depth_of_field": {"focus_at": "xy"}}]}),
     "focus_at"),
    (lambda: postchain.Chain(FXAA).run(planes_of(0)["color"], camera={"f_stop": object()}),
     "a object has no place in it; give numbers"),
])
def test_a_wrong_value_is_a_usage_error(call, words):
    with pytest.raises((postchain.UsageError, postchain.ChainError), match=words):
        call()


def test_remedies_are_arguments(frames, tmp_path):
    def run(**settings):
        return postchain.run_sequence(FXAA, frames / "frame.####.exr",
                                      tmp_path / "new" / "out.####.exr", **settings)
    expect_errors([
        (postchain.OutputError, "create it or use mkdir=True", run),
        (postchain.InputError, "missing='skip' or 'hold'", lambda: run(frames="2-9")),
        (postchain.UsageError, "frames='1-48'.*idle=600", lambda: run(watch=True))])
    run(mkdir=True, frames=1)
    expect_errors([(postchain.OutputError, "on_existing='skip' or 'overwrite'", lambda: run(frames=1))])


def test_a_device_that_there_is_not():
    try:
        postchain.Device("gpu").close()
    except postchain.DeviceError as error:
        assert "or give device='auto' or 'software' to compute" in str(error)


def test_neighbors_that_a_chain_reads_are_asked_for():
    chain, frame = postchain.Chain(BLUR), planes_of(1)
    asked = "reads the frames before and after, which are not given.*or None where there is no such"
    with pytest.warns(postchain.Warning, match=asked):
        expected = chain.run(**frame, camera=CAMERA)
    with pytest.warns(postchain.Warning, match=asked):
        chain.run(**frame, camera=CAMERA, before=planes_of(0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        said = chain.run(**frame, camera=CAMERA, before=None, after=None)
        chain.run(**frame, camera=CAMERA, before=planes_of(0), after=planes_of(2))
        postchain.Chain(FXAA).run(frame["color"])
    assert (said == expected).all()


def test_no_gpu_is_said_once():
    process = python("""
import warnings
warnings.simplefilter("always")
import numpy, postchain
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    postchain.scene("wheels", __import__("tempfile").mkdtemp(), size=(32, 18))
    postchain.Device().close()
    postchain.Chain({"postchain": 1, "passes": ["fxaa"]}).run(numpy.zeros((4, 4, 3), "f4"))
print(len([one for one in said if "GPU" in str(one.message)]), len(said))
""")
    out, error = process.communicate(timeout=300)
    assert process.returncode == 0, error
    assert out.split()[0] in "01" and out.split()[0] == out.split()[1], out


def test_names_are_those_of_the_package():
    for name in postchain.__all__:
        value = getattr(postchain, name)
        if isinstance(value, type):
            assert (value.__module__, value.__qualname__) == ("postchain", name)
