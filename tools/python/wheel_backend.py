"""Builds the Python module as a wheel, for pip (PEP 517, PEP 427). Needs what docs/python.md lists, and
no other package of Python.

    pip wheel --no-deps .                                  in a build tree of its own
    pip wheel --no-deps . --config-settings build=build    in this one, which is configured
"""
import base64
import hashlib
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"project\(postchain VERSION ([0-9.]+)", text)[1]


def metadata():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version()}",
             f"Summary: {project['description']}", f"Requires-Python: {project['requires-python']}",
             "License: Apache-2.0", "Description-Content-Type: text/markdown"]
    lines += [f"Classifier: {one}" for one in project["classifiers"]]
    lines += [f"Requires-Dist: {one}" for one in project["dependencies"]]
    return "\n".join(lines) + "\n\n" + (ROOT / project["readme"]).read_text(encoding="utf-8")


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=sys.stderr)


def built_in(folder):
    """A configured and built tree of the module alone."""
    run("cmake", "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF",
        f"-DPython_EXECUTABLE={sys.executable}")
    return folder


def files_of(build, stage):
    """The files of the wheel, by name: the package, and beside it the library that reads and writes
    other formats than EXR."""
    run("cmake", "--build", build, "--target", "postchain_python_stub", "--parallel")
    run("cmake", "--install", build, "--component", "python", "--prefix", stage)
    found = list(stage.rglob("postchain/__init__.py"))
    if not found:
        raise SystemExit("the module was not built: install what docs/python.md lists")
    package = found[0].parent
    files = {f"postchain/{path.name}": path.read_bytes() for path in sorted(package.iterdir())}
    images = build / "modules" / "libpostchain_images.so"
    files[f"postchain/{images.name}"] = images.read_bytes()
    return files


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    tag = "cp{0}{1}-cp{0}{1}-".format(*sys.version_info) + re.sub(
        "[-.]", "_", sysconfig.get_platform())
    info = f"postchain-{version()}.dist-info"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        given = (config_settings or {}).get("build")
        build = (ROOT / given) if given else built_in(folder / "build")
        files = files_of(build, folder / "stage")
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: postchain {version()}\n"
                              f"Root-Is-Purelib: false\nTag: {tag}\n").encode()
    files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    record = ""
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    wheel = f"postchain-{version()}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            mode = 0o755 if name.endswith(".so") else 0o644
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return wheel
