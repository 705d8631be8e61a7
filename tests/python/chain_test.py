"""postchain.Chain: its sources, errors and values."""
import pickle

import numpy
import postchain
import pytest
from conftest import BLUR, FXAA


def test_sources_agree(tmp_path):
    chain = postchain.Chain(BLUR)
    path = tmp_path / "blur.yaml"
    path.write_text("postchain: 1\npasses:\n  - motion_blur: {mode: inverse_warp, samples: 9}\n")
    by_file = postchain.Chain(path)
    assert chain == by_file == postchain.Chain.from_text(path.read_text())
    assert chain == postchain.Chain(chain.dict()) == postchain.Chain.from_text(chain.text)
    assert chain == pickle.loads(pickle.dumps(chain))
    assert hash(chain) == hash(by_file) and chain.hash == by_file.hash
    assert chain != postchain.Chain(FXAA) and chain != 5
    assert by_file.name == str(path) and chain.passes == ["motion_blur"]
    assert chain.dict()["passes"][0]["motion_blur"]["samples"] == 9
    assert "motion_blur" in repr(chain)


def test_every_shipped_chain_survives_its_dict():
    assert "balanced" in postchain.shipped_chains()
    for name in postchain.shipped_chains():
        chain = postchain.Chain(name)
        assert postchain.Chain(chain.dict()).hash == chain.hash, name


def test_set():
    chain = postchain.Chain(BLUR, set={"motion_blur.samples": numpy.int64(17),
                                       "camera.f_stop": numpy.float32(2)})
    assert chain == postchain.Chain(BLUR, set=["motion_blur.samples=17", "camera.f_stop=2"])
    assert chain == postchain.Chain(postchain.Chain(BLUR),
                                    set={"motion_blur.samples": 17, "camera.f_stop": 2})
    assert chain.dict()["camera"] == {"f_stop": 2}
    assert postchain.Chain(chain, set={"camera.f_stop": None}).dict()["camera"] == {}
    blur = {"mode": "inverse_warp", "samples": numpy.int32(9)}
    assert postchain.Chain({"postchain": 1, "passes": [{"motion_blur": blur}]}) == postchain.Chain(BLUR)
    with pytest.raises(postchain.UsageError, match="samples"):
        postchain.Chain(BLUR, set={"motion_blur.samples": "many"})


def test_an_error_in_a_file(tmp_path):
    path = tmp_path / "look.yaml"
    path.write_text("postchain: 1\npasses:\n"
                    "  - motion_blur: {mode: guertin, samples: 24}\n  - fxxa: {}\n")
    with pytest.raises(postchain.ChainError) as caught:
        postchain.Chain(path)
    error = caught.value
    assert isinstance(error, ValueError) and error.code == "chain"
    even, unknown = error.diagnostics
    assert even.file == str(path) and (even.line, even.column) == (3, 43)
    assert even.key == "passes[0].samples" and "24 is even" in even.message
    assert unknown.line == 4 and "did you mean 'fxaa'" in unknown.message
    assert error.place == f"{path}:3:43: passes[0].samples"
    assert error.remedy == "samples is an odd integer in 1..1023 (taps)"
    assert str(error).count("\n") == 1  # every error of the file, one line each
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.place, again.diagnostics) == (str(error), error.place,
                                                            error.diagnostics)


def test_an_error_in_a_dict_names_the_key():
    with pytest.raises(postchain.ChainError) as caught:
        postchain.Chain({"postchain": 1, "passes": [{"fxaa": {"subpix": 2}}]})
    assert caught.value.place == "chain: passes[0].subpix"
    assert caught.value.diagnostics[0].line == 0
    assert "JSON" not in str(caught.value) and "subpix" in caught.value.remedy


@pytest.mark.parametrize("source, kind, words", [
    ("no_such", postchain.ChainError, "shipped"),
    ("missing.yaml", postchain.ChainError, "missing.yaml"),
    (5, postchain.UsageError, "give a string or a path"),
    ({"passes": []}, postchain.ChainError, "postchain"),
    ({"postchain": 1, "passes": [{"fxaa": {"subpix": float("nan")}}]}, postchain.ChainError,
     "subpix"),
    ({"postchain": 1, "passes": [object()]}, postchain.UsageError, "a object has no place"),
])
def test_wrong_sources(source, kind, words):
    with pytest.raises(kind, match=words):
        postchain.Chain(source)


def test_schema():
    schema = postchain.schema()
    assert schema["$schema"].startswith("https://json-schema.org/")
    assert schema["$defs"]["pass.fxaa"]["properties"]["subpix"]["maximum"] == 1
