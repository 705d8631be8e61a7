"""Builds the Python module as a wheel, for pip (PEP 517, PEP 427). Needs what docs/python.md lists, and
no other package of Python.

    pip wheel --no-deps .                                  in a build tree of its own
    pip wheel --no-deps . --config-settings build=build    in this one, which is configured
    ... --config-settings libraries=yes                    with the libraries that the module loads, for machines
                                                           without their packages; needs patchelf and dpkg
"""
import base64
import hashlib
import pathlib
import platform
import re
import shutil
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


# Every system for which manylinux wheels are has these, in later versions (PEP 600).
SYSTEM = re.compile(r"lib(c|m|dl|rt|pthread|stdc\+\+|gcc_s|z)\.so\.|ld-linux|linux-vdso")


def output(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout


def with_libraries(files, info, folder):
    """The files, with the libraries that the module loads in postchain.libs and their licenses. The names of the
    libraries have a hash, so that other versions in the process are not taken for them. The library for formats
    other than EXR stays with the system's OpenImageIO, which has 240 further libraries."""
    module = next(name for name in files if pathlib.Path(name).name.startswith("_postchain."))
    folder.mkdir()
    copies = {module: folder / "module.so"}
    copies[module].write_bytes(files[module])
    found = dict(re.findall(r"(\S+) => (/\S+)", output("ldd", copies[module])))
    renamed = {}
    for name, path in sorted(found.items()):
        if SYSTEM.match(name):
            continue
        path = pathlib.Path(path).resolve()
        stem, rest = name.split(".so", 1)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        renamed[name] = f"{stem}-{digest}.so{rest}"
        copies[f"postchain.libs/{renamed[name]}"] = folder / renamed[name]
        shutil.copyfile(path, folder / renamed[name])
        package = output("dpkg-query", "-S", path).split(":")[0]
        files[f"{info}/licenses/{package}"] = pathlib.Path(f"/usr/share/doc/{package}/copyright").read_bytes()
    for name, path in copies.items():
        if name != module:
            run("patchelf", "--set-soname", path.name, path)
        for old, new in renamed.items():
            run("patchelf", "--replace-needed", old, new, path)
        run("patchelf", "--set-rpath", "$ORIGIN:$ORIGIN/../postchain.libs" if name == module else "$ORIGIN", path)
        files[name] = path.read_bytes()
    left = [name for name in re.findall(r"NEEDED.*\[(.+)\]", output("readelf", "-d", *copies.values()))
            if name not in renamed.values() and not SYSTEM.match(name)]
    assert not left, f"libraries of the system that are not in the wheel: {left}"
    return files


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    settings = config_settings or {}
    of_system = sysconfig.get_platform()
    if settings.get("libraries"):
        of_system = f"manylinux_{platform.libc_ver()[1]}_{platform.machine()}"
    tag = "cp{0}{1}-cp{0}{1}-".format(*sys.version_info) + re.sub("[-.]", "_", of_system)
    info = f"postchain-{version()}.dist-info"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        given = settings.get("build")
        build = (ROOT / given) if given else built_in(folder / "build")
        files = files_of(build, folder / "stage")
        if settings.get("libraries"):
            files = with_libraries(files, info, folder / "libraries")
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
            mode = 0o755 if ".so" in name else 0o644
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return wheel
