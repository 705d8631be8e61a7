"""The stub and the docstrings name what the module has and what the parameter tables say."""
import ast
import inspect
import pathlib
import re

import postchain
import pytest
from postchain._postchain import _tables

FOLDER = pathlib.Path(postchain.__file__).parent
STUB = ast.parse((FOLDER / "__init__.pyi").read_text())
TABLES = _tables()


def members(tree):
    return {one.name: one for one in tree.body
            if isinstance(one, (ast.FunctionDef, ast.ClassDef))}


def arguments(function):
    names = [one.arg for one in function.args.args + function.args.kwonlyargs]
    return [name for name in names if name != "self"]


def expect_arguments(function, stub, keys, explained=None):
    """The stub has the arguments of a compiled function, which its docstring names, and the keys of the
    tables; the docstring has the help of those that are explained: by default all."""
    line = function.__doc__.splitlines()[0]
    own = [name for name in re.findall(r"[(,] (\w+):", line.replace("(", "( ")) if name not in ("self", "arg0")]
    assert ("**kwargs" in line) == bool(keys), stub.name
    assert sorted(arguments(stub)) == sorted(own + list(keys)), stub.name
    for key in keys if explained is None else explained:
        assert f"\n  {key}: " in function.__doc__, (stub.name, key)


def test_the_stub_has_every_name():
    assert (FOLDER / "py.typed").exists()
    stubbed = members(STUB)
    for name in postchain.__all__:
        assert name in stubbed or name == "__version__", name
    for name in ("Chain", "Device", "Frame"):
        public = {key for key, value in vars(getattr(postchain, name)).items()
                  if not key.startswith("_")}
        assert public == {key for key in members(stubbed[name]) if not key.startswith("_")}, name


def test_the_stub_has_every_argument():
    stubbed = members(STUB)
    (array, file, plan, layer, read, tune, run, planned, inspected, experiment) = (
        set(TABLES[key]) for key in (
            "array_keys", "file_keys", "plan_keys", "aov_keys", "read_keys", "tune_input_keys",
            "run_keys", "plan_sequence_keys", "inspect_keys", "experiment_input_keys"))
    for name, keys in [("run_sequence", run), ("read", read),
                       ("tune", tune | set(TABLES["tune"])), ("plan_sequence", planned),
                       ("scene", set()), ("inspect", inspected), ("schema", set()),
                       ("ab", experiment | set(TABLES["ab"])), ("study", set()), ("check", set()),
                       ("bench", experiment | set(TABLES["bench"])),
                       ("sheet", set(TABLES["sheet_keys"])), ("write", set(TABLES["write_keys"])),
                       ("set_threads", set())]:
        expect_arguments(getattr(postchain, name), stubbed[name], keys)
    expect_arguments(postchain.diff, stubbed["diff"], file, explained=())
    for kind, name, keys, explained in [
            ("Chain", "run", array | plan, array | plan), ("Chain", "filter", array | layer | plan, layer),
            ("Chain", "plan", array | layer | plan, ()), ("Chain", "__init__", set(), ()),
            ("Frame", "__init__", array | layer, ())]:
        expect_arguments(getattr(getattr(postchain, kind), name), members(stubbed[kind])[name], keys, explained)


def test_the_defaults_and_choices_are_those_of_the_tables():
    function = members(STUB)["run_sequence"]
    found = {name.arg: (ast.unparse(name.annotation), ast.literal_eval(default))
             for name, default in zip(function.args.kwonlyargs, function.args.kw_defaults)}
    for key in TABLES["run_keys"]:
        row = TABLES["settings"][key]
        kind, default = found[key]
        assert default == row.get("default"), key
        for word in row.get("enum", []):
            assert word is None or repr(word) in kind, key


def test_passes_and_camera_are_those_of_the_tables():
    stubbed = members(STUB)
    rows = {"CameraValues": TABLES["camera"]}
    for one in TABLES["passes"]:
        name = "".join(word.capitalize() for word in one["name"].split("_"))
        rows[name] = one["parameters"] + TABLES["every_pass"]
    for name, table in rows.items():
        fields = [one.target.id for one in stubbed[name].body if isinstance(one, ast.AnnAssign)]
        assert fields == [row["key"] for row in table], name
    for name, key in [("Metric", "metrics"), ("ErrorMap", "maps"), ("SceneName", "scenes"),
                      ("DepthEncoding", "depth_encodings"), ("ToneMapper", "tone_mappers")]:
        value, = [one.value for one in STUB.body if isinstance(one, ast.Assign)
                  and one.targets[0].id == name]
        words = {one.value for one in ast.walk(value) if isinstance(one, ast.Constant)}
        assert words - {""} == set(TABLES[key]), name


def test_docstrings_have_the_help_of_passes_and_metrics():
    for one in TABLES["passes"]:
        for row in one["parameters"]:
            assert f"\n  {row['key']}: " in postchain.Chain.__doc__, row["key"]
    for name in TABLES["metrics"]:
        assert f"\n  {name}: " in postchain.diff.__doc__
    assert "--" not in postchain.run_sequence.__doc__.replace("---", "")


@pytest.mark.parametrize("name", postchain.__all__)
def test_everything_has_a_docstring(name):
    value = getattr(postchain, name)
    assert name == "__version__" or inspect.getdoc(value)
