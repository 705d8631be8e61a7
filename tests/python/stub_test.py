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


def signature(function):
    """The names of a compiled function's arguments, from its docstring."""
    line = function.__doc__.splitlines()[0]
    names = re.findall(r"[(,] (\w+):", line.replace("(", "( "))
    return [name for name in names if name not in ("self", "arg0")], "**kwargs" in line


def expect_arguments(function, stub, keys):
    own, takes_settings = signature(function)
    assert takes_settings == bool(keys), stub.name
    expected = own + list(keys)
    assert sorted(arguments(stub)) == sorted(expected), stub.name


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
    for name, keys in [("run_sequence", run), ("read", read), ("diff", file),
                       ("tune", tune | set(TABLES["tune"])), ("plan_sequence", planned),
                       ("scene", set()), ("inspect", inspected), ("schema", set()),
                       ("ab", experiment | set(TABLES["ab"])), ("study", set()), ("check", set()),
                       ("bench", experiment | set(TABLES["bench"])),
                       ("sheet", set(TABLES["sheet_keys"])), ("write", set(TABLES["write_keys"])),
                       ("set_threads", set())]:
        expect_arguments(getattr(postchain, name), stubbed[name], keys)
    chain = members(stubbed["Chain"])
    for name, keys in (("run", array | plan), ("filter", array | layer | plan),
                       ("plan", array | layer | plan)):
        expect_arguments(getattr(postchain.Chain, name), chain[name], keys)
    expect_arguments(postchain.Frame.__init__, members(stubbed["Frame"])["__init__"],
                     array | layer)
    expect_arguments(postchain.Chain.__init__, members(stubbed["Chain"])["__init__"], set())


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
        assert words - {"", "tde"} == set(TABLES[key]), name


def test_docstrings_have_the_help_of_every_row():
    for function, keys in [(postchain.run_sequence, TABLES["run_keys"]),
                           (postchain.plan_sequence, TABLES["plan_sequence_keys"]),
                           (postchain.inspect, TABLES["inspect_keys"]),
                           (postchain.read, TABLES["read_keys"]),
                           (postchain.ab, TABLES["experiment_input_keys"] + list(TABLES["ab"])),
                           (postchain.bench, TABLES["experiment_input_keys"] + list(TABLES["bench"])),
                           (postchain.sheet, TABLES["sheet_keys"]),
                           (postchain.write, TABLES["write_keys"]),
                           (postchain.Chain.filter, TABLES["aov_keys"]),
                           (postchain.tune, TABLES["tune_input_keys"] + list(TABLES["tune"])),
                           (postchain.Chain.run, TABLES["array_keys"] + TABLES["plan_keys"])]:
        for key in keys:
            assert f"\n  {key}: " in function.__doc__, key
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
