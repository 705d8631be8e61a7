"""Tests the files that `cmake --install` installs, by programs that use them. Each check is a test of
ctest; `tree` installs the built tree for the others, and `packages` makes the Debian packages.

    install_test.py CHECK --build BUILD --prefix PREFIX --version VERSION [--core] [--vulkan]
"""
import argparse
import os
import pathlib
import platform
import re
import shutil
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]


def call(*command, code=0, **options):
    """stdout and stderr of a command that must end with this exit code."""
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, **options)
    text = " ".join(str(word) for word in command)
    assert done.returncode == code, f"{text}\nexit code {done.returncode}\n{done.stdout}"
    return done.stdout


def expect_equal(found, expected, what):
    assert found == expected, (f"{what}\ntoo much: {sorted(found - expected)}\n"
                               f"missing: {sorted(expected - found)}")


def one(pattern, prefix):
    found = sorted(prefix.glob(pattern))
    assert len(found) == 1, f"{pattern}: {found}"
    return found[0]


def libraries(options):
    """Library name -> headers that declare its symbols."""
    parts = {"postchain": ["postchain.h"], "postchain_plan": ["postchain.h", "postchain_plan.h"]}
    if not options.core:
        parts["postchain_config"] = ["chain_from_text.h"]
    if options.vulkan:
        parts["postchain_vk"] = ["postchain_vk.h"]
    return parts


def soversion(options):
    """Before 1.0 each minor version may change the interface."""
    parts = options.version.split(".")
    return ".".join(parts[:2]) if parts[0] == "0" else parts[0]


def compilers():
    """(C, C++) of every compiler family that is installed, the user's first."""
    pairs = [(os.environ.get("CC", "cc"), os.environ.get("CXX", "c++")), ("clang", "clang++")]
    return [pair for pair in pairs if shutil.which(pair[0]) and shutil.which(pair[1])]


def tree(options):
    shutil.rmtree(options.prefix, ignore_errors=True)
    components = ["plan", "library", "dev"] + ([] if options.core else ["config", "command"])
    components += ["vulkan"] if options.vulkan else []
    for component in components + options.parts:
        call("cmake", "--install", options.build, "--prefix", options.prefix, "--component", component)


def headers(options):
    """Each compiles alone, without a warning."""
    folder = options.prefix / "include"
    files = sorted(folder.glob("postchain/*"))
    names = {"postchain.hpp"}.union(*libraries(options).values())
    expect_equal({file.name for file in files}, names, "headers")
    flags = ["-fsyntax-only", *WARNINGS, "-Wconversion", "-Wshadow", "-I", folder]
    with tempfile.TemporaryDirectory() as name:
        for file in files:
            source = pathlib.Path(name) / "alone"
            source.write_text(f"#include <postchain/{file.name}>\n")
            for c, cpp in compilers():
                if file.suffix == ".h":
                    call(c, "-std=c11", *flags, "-x", "c", source)
                call(cpp, "-std=c++20", *flags, "-x", "c++", source)


def symbols(options):
    """The shared libraries export the functions that their headers declare and their maps list,
    under the version of their soname. A function is in one library."""
    exported, declared = [], {}
    for name, of_library in libraries(options).items():
        library = one(f"lib/**/lib{name}.so", options.prefix)
        map_text = (ROOT / f"tools/packaging/{name}.map.in").read_text()
        listed = set(re.findall(r"^\s+(pc_\w+);$", map_text, flags=re.M))
        private = set(re.findall(r'^\s+"(.+)";$', map_text, flags=re.M))
        shown, shown_private = set(), set()
        for line in call("nm", "-DC", "--defined-only", library).splitlines():
            kind, symbol = line.split(" ", 2)[1:]
            symbol, _, version = symbol.partition("@@")
            if kind == "A":
                continue  # the name of a version
            assert version in (f"POSTCHAIN_{soversion(options)}",
                               f"POSTCHAIN_PRIVATE_{options.version}"), line
            (shown_private if "PRIVATE" in version else shown).add(symbol)
        expect_equal(shown, listed, f"symbols of {library.name} against its map")
        expect_equal(shown_private, private, f"private symbols of {library.name}")
        exported += shown
        for header in of_library:
            text = (options.prefix / "include/postchain" / header).read_text()
            text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
            declared[header] = set(re.findall(r"PC_API[^;#]*?\b(pc_\w+)\(", text))
        expect_equal(shown - set().union(*(declared[header] for header in of_library)), set(),
                     f"symbols of {library.name} that its headers do not declare")
    expect_equal(set(exported), set().union(*declared.values()), "exported symbols against the headers")
    assert len(exported) == len(set(exported)), "two libraries export one function"


def needed(options):
    """libpostchain needs only libepoxy and the compiler's libraries; no other needs GL, also not by what it needs."""
    system = {"libstdc++.so.6", "libm.so.6", "libgcc_s.so.1", "libc.so.6",
              "ld-linux-x86-64.so.2"}
    plan = f"libpostchain_plan.so.{soversion(options)}"
    may = {"postchain": {plan, "libepoxy.so.0"}, "postchain_plan": set(),
           "postchain_config": {plan, "libyaml-0.so.2"}, "postchain_vk": {plan}}
    for name in libraries(options):
        library = one(f"lib/**/lib{name}.so", options.prefix)
        text = call("readelf", "-d", library)
        assert f"soname: [lib{name}.so.{soversion(options)}]" in text, text
        found = set(re.findall(r"NEEDED.*\[(.+)\]", text))
        expect_equal(found - system, may[name], f"libraries that {library.name} needs")
        places = set(re.findall(r"(?:RPATH|RUNPATH).*\[(.+)\]", text))
        assert places <= {"$ORIGIN"}, places
        loaded = call("ldd", library)
        assert bool(re.search(r"lib(epoxy|E?GL)", loaded)) == (name == "postchain"), f"{name}: {loaded}"


def plugin(options):
    """The OpenFX bundle exports what the standard names, and brings all but libepoxy and the C library."""
    library = one("**/postchain.ofx", options.prefix)
    assert str(library).endswith("/OFX/Plugins/postchain.ofx.bundle/Contents/Linux-x86-64/postchain.ofx"), library
    shown = {line.split()[-1] for line in call("nm", "-D", "--defined-only", library).splitlines()}
    expect_equal(shown, {"OfxGetNumberOfPlugins", "OfxGetPlugin", "OfxSetHost"}, "symbols of the plugin")
    text = call("readelf", "-d", library)
    found = set(re.findall(r"NEEDED.*\[(.+)\]", text))
    expect_equal(found - {"ld-linux-x86-64.so.2"}, {"libc.so.6", "libm.so.6", "libepoxy.so.0"}, "its libraries")
    assert "NODELETE" in text and "RUNPATH" not in text and "RPATH" not in text, text


def flags_of(module, library_folder):
    """By pkg-config."""
    environment = dict(os.environ, PKG_CONFIG_PATH=str(library_folder / "pkgconfig"))
    flags = call("pkg-config", "--cflags", "--libs", module, env=environment).split()
    return [*flags, f"-Wl,-rpath,{library_folder}"]


def expect_runs(program):
    text = call(program)
    assert "blurred" in text or text.startswith("1 "), f"{program}: {text}"


def examples(options):
    """Programs against the installed tree, by find_package and by pkg-config, shared and static."""
    folder = options.prefix / "programs"
    components = "core" if options.core else "core;config"
    call("cmake", "-S", HERE / "program", "-B", folder, f"-DCMAKE_PREFIX_PATH={options.prefix}",
         f"-DCOMPONENTS={components}", f"-DVERSION={options.version}", "-DCMAKE_BUILD_TYPE=Debug",
         *(f"-DCMAKE_{language}_FLAGS={' '.join(WARNINGS)}" for language in ("C", "CXX")))
    call("cmake", "--build", folder, "-j", "2")
    # The interface in C++ is a header, so its programs are linked as those in C.
    names = ["c", "c_static", "cpp"] + ([] if options.core else ["text", "text_static"])
    programs = [folder / name for name in names]
    unknown = call("cmake", "-S", HERE / "program", "-B", folder, "-DCOMPONENTS=core;windows", code=1)
    assert "windows" in unknown, unknown

    library_folder = one("lib/**/libpostchain.so", options.prefix).parent
    c, cpp = compilers()[0]
    sources = {"c": ([c, "-std=c11"], "host.c", "postchain"), "cpp": ([cpp, "-std=c++20"], "host.cpp", "postchain"),
               "text": ([c, "-std=c11"], "text.c", "postchain-config")}
    for name in names:
        compiler, source, module = sources[name.removesuffix("_static")]
        programs.append(folder / f"{name}_by_flags")
        call(*compiler, *WARNINGS, HERE / "program" / source, "-o", programs[-1],
             *flags_of(module + ("-static" if "static" in name else ""), library_folder))
    if not options.core:
        shipped = folder / "shipped"
        call(c, "-std=c11", *WARNINGS, "-DSHIPPED", HERE / "program/hashes.c", "-o", shipped,
             *flags_of("postchain", library_folder), *flags_of("postchain-config", library_folder))
        assert call(folder / "hashes") == call(shipped), "hashes.c has other chains than those that are shipped"
    for program in programs:
        expect_runs(program)
        shared = "libpostchain_plan.so" in call("ldd", program)
        assert shared == ("static" not in program.name), f"{program}: shared is {shared}"


def samples(options):
    """The samples build on their own, against the installed tree. OGRE's finds it: tests/ogre compiles its
    sources, which takes long."""
    for name in ("glfw", "ogre") + (("vulkan", "own_device") if options.vulkan else ()):
        folder = options.prefix / "samples" / name
        call("cmake", "-S", ROOT / "tools" / "samples" / name, "-B", folder,
             f"-DCMAKE_PREFIX_PATH={options.prefix}")
        if name != "ogre":
            call("cmake", "--build", folder, "-j", "2")
            assert "libpostchain_plan.so" in call("ldd", folder / f"{name}_host"), name


USE_MODULE = """
import pathlib, tempfile
import numpy, postchain
print(postchain.__version__, pathlib.Path(postchain.__file__).parent)
chain = postchain.Chain({"postchain": 1, "passes": ["fxaa"]})
print(chain.run(numpy.zeros((4, 4, 3), "f4")).shape)
with tempfile.TemporaryDirectory() as folder:
    postchain.scene("still", folder, size=(16, 9), on_existing="overwrite")
    postchain.run_sequence(chain, f"{folder}/sharp.0001.exr", f"{folder}/out.exr", png=True)
    print(len(list(pathlib.Path(folder).glob("out.png"))))
"""
FAKE_MODULE = """
struct calls { const char* version; };
const struct calls* postchain_image_calls(void) {
    static const struct calls calls = {"9.9.9"};
    return &calls;
}
"""


def command(options):
    """The installed command in a moved tree: with its module, without it, and with the module of
    another version."""
    with tempfile.TemporaryDirectory() as name:
        moved = pathlib.Path(name) / "moved"
        shutil.copytree(options.prefix, moved, symlinks=True,
                        # Other tests build in these folders meanwhile.
                        ignore=shutil.ignore_patterns("programs", "samples"))
        postchain = moved / "bin/postchain"
        assert "OpenImageIO" not in call("ldd", postchain)
        assert str(options.build) not in call("readelf", "-d", postchain)
        call(postchain, "scene", "wheels", "-o", moved, "--size", "64x36", "--frames", "1", "-q")
        frame = ["-i", moved / "sharp.####.exr", "--camera", moved / "camera.json"]

        def run(out, *more, code=0, chain="paper", format="exr"):
            return call(postchain, "run", chain, *frame, "-o", moved / f"{out}.####.{format}", *more,
                        code=code)
        run("a", "--png")
        assert (moved / "a.0001.png").read_bytes().startswith(b"\x89PNG\r\n")
        assert "OpenImageIO 2" in call(postchain, "info")

        aperture = moved / "aperture.yaml"
        aperture.write_text("postchain: 1\ncamera: {aperture_image: a.0001.png, f_stop: 1}\n"
                            "passes:\n  - depth_of_field: {}\n")
        module = one("lib/**/libpostchain_images.so", moved)
        module.unlink()

        def expect_refused(why):
            for text in (run("b", format="jpg", code=5), run("b", code=4, chain=aperture)):
                for word in ("libpostchain_images.so", why, "install"):
                    assert word in text, text
            assert not list(moved.glob("b.*")), "something was written"
            text = call(postchain, "info")
            assert why in text and "OpenImageIO 2" not in text, text
        expect_refused("cannot open shared object file")
        run("c", "--png")  # the rest works
        source = moved / "fake.c"
        source.write_text(FAKE_MODULE)
        call("cc", "-shared", "-fPIC", source, "-o", module)
        expect_refused("is of version 9.9.9")


FILES_OF_PARTS = {"blender": "postchain/postchain_blender.zip",
                  "openfx": "usr/OFX/Plugins/postchain.ofx.bundle/Contents/Linux-x86-64/postchain.ofx"}
OF_SERVICE = ("libsqlite3", "libsodium", "prometheus")  # libraries that the service alone needs


def packages(options):
    """The Debian packages hold the installed tree, each file once, and name their dependencies. Each
    has a license. The examples in C build against the unpacked packages and run."""
    folder = options.prefix.parent / "packages"
    shutil.rmtree(folder, ignore_errors=True)
    call("cpack", "-G", "DEB", "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none", "--config",
         options.build / "CPackConfig.cmake", "-B", folder)
    held = {}
    system = platform.freedesktop_os_release()
    version = options.version
    if "VERSION_ID" in system:  # not in Debian's testing
        version += f"+{system['ID'].replace('debian', 'deb')}{system['VERSION_ID']}"
    for deb in folder.glob("*.deb"):
        package = call("dpkg-deb", "-f", deb, "Package").strip()
        fields = call("dpkg-deb", "-f", deb, "Version", "Source")
        assert fields.splitlines() == [f"Version: {version}", f"Source: postchain ({options.version})"], fields
        held[package] = (call("dpkg-deb", "-c", deb), call("dpkg-deb", "-f", deb, "Depends"))
    so = soversion(options)
    has = {f"libpostchain{so}": f"libpostchain.so.{options.version}",
           f"libpostchain-plan{so}": f"libpostchain_plan.so.{options.version}",
           "libpostchain-dev": "postchain.h"}
    if not options.core:
        if options.python:
            has["python3-postchain"] = "dist-packages/postchain/__init__.pyi"
        has.update({"postchain": "bin/postchain", f"libpostchain-config{so}": f"libpostchain_config.so.{options.version}"})
    if options.vulkan:
        has[f"libpostchain-vk{so}"] = f"libpostchain_vk.so.{options.version}"
    for part in options.parts:
        has[f"postchain-{part}"] = FILES_OF_PARTS.get(part, f"bin/postchain-{part}")
    if "serve" in options.parts:
        has["postchain-service"] = "system/postchain.service"
    expect_equal(set(held), set(has), "packages")
    for package, file in has.items():
        for other, (files, _) in held.items():
            assert (f"/{file}\n" in files) == (package == other), f"{file} in {other}"
    if "serve" in options.parts:
        assert "/bin/postchain-preview\n" in held["postchain-serve"][0], "postchain-preview"
    library, plan = f"libpostchain{so}", rf"libpostchain-plan{so} \(= {re.escape(version)}\)"
    for package, needs, needs_not in ((library, [plan, "libepoxy0"], ["yaml", "openimageio", "openexr"]),
                                      (f"libpostchain-plan{so}", [], ["libepoxy0", "libgl", "libegl"]),
                                      ("libpostchain-dev", [plan, rf"{library} \(= "], []),
                                      (f"libpostchain-config{so}", [plan], ["libepoxy0"]),
                                      (f"libpostchain-vk{so}", [plan], ["libepoxy0", "libgl", rf"{library} "]),
                                      ("postchain", ["libopenimageio"], ["libglfw3", *OF_SERVICE]),
                                      ("postchain-lab", [r"postchain \(= "], ["libglfw3", *OF_SERVICE]),
                                      ("postchain-serve", [r"postchain \(= ", *OF_SERVICE], ["libglfw3"]),
                                      ("postchain-service", [r"postchain-serve \(= "], ["libglfw3"]),
                                      ("postchain-blender", [r"postchain \(= "], ["libc6"]),
                                      ("postchain-view", [r"postchain \(= ", "libglfw3"], []),
                                      ("postchain-openfx", ["libepoxy0", "libegl1, libopengl0"],
                                       ["yaml", "openexr", "openimageio", "libstdc"]),
                                      ("python3-postchain", [r"python3\.\d+, python3-numpy", "libegl1, libopengl0"], [])):
        depends = held[package][1].lower() if package in held else ""
        for word in needs if package in held else []:
            assert re.search(word, depends), f"{package} without {word}: {depends}"
        for word in needs_not:
            assert word not in depends, f"{package}: {depends}"
    for deb in folder.glob("*.deb"):
        keeps_policy(deb)
    use_unpacked(options, folder, set(has))
    source_package(options, folder / "source")


def notices(options):
    """The copyright file has the holders of every archive of the system that a library or program contains."""
    ours = (ROOT / "tools/packaging/debian/copyright").read_text().replace(",", "")
    linked = re.findall(r"^build (?:lib|tools)/[^\n]*_LINKER__.*?^\n", (options.build / "build.ninja").read_text(),
                        re.S | re.M)
    archives = {archive for one in linked for archive in re.findall(r"/usr/lib/\S+\.a\b", one)}
    if options.vulkan:
        assert archives, "no archive is linked"
    for package in set(re.findall(r"^([^:\s]+):", call("dpkg", "-S", *archives), re.M)) if archives else []:
        text = pathlib.Path(f"/usr/share/doc/{package}/copyright").read_text()
        for files, holders in re.findall(r"^Files: (.*?)^Copyright: (.*?)^License:", text, re.S | re.M):
            for holder in holders.splitlines() if not files.startswith("debian/") else []:
                assert holder.strip().replace(",", "") in ours, f"tools/packaging/debian/copyright lacks {holder.strip()} of {package}"


def keeps_policy(deb):
    """The errors that lintian reports; by lintian itself, if it is installed."""
    name = call("dpkg-deb", "-f", deb, "Package").strip()
    held = call("dpkg-deb", "-c", deb)
    assert f"/usr/share/doc/{name}/changelog.gz\n" in held, held
    assert not re.search(r"/man1/[a-z-]+\.1\n", held), held
    assert call("dpkg-deb", "-f", deb, "Description").count("\n ") >= 2, name
    assert re.fullmatch(r"[^<>]+ <[^<>@ ]+@[^<>@ ]+>\n", call("dpkg-deb", "-f", deb, "Maintainer"))
    if re.search(r"/lib\w+\.so\.", held):
        control = call("dpkg-deb", "-I", deb)
        assert " shlibs" in control and " triggers" in control, control
        library = re.sub(r"[0-9.]+$", "", name).replace("-", "_")
        so = re.search(r"[0-9.]+$", name).group()
        assert call("dpkg-deb", "-I", deb, "shlibs") == f"{library} {so} {name} (>= {so})\n", name
        assert call("dpkg-deb", "-I", deb, "triggers") == "activate-noawait ldconfig\n", name
    if shutil.which("lintian"):
        call("lintian", "--allow-root", "--fail-on", "error",
             "--suppress-tags", "uses-no-compression-for-data-tarball", deb)  # the test packs without, for time


def source_package(options, folder):
    """The source package is the commit with debian/. tools/release.sh builds it."""
    if not (ROOT / ".git").exists():
        return
    dsc = call(ROOT / "tools/packaging/source_package.sh", folder, "A B <a@b.c>", "-Zgzip", "-z1").strip()
    text = pathlib.Path(dsc).read_text()
    assert "\nMaintainer: A B <a@b.c>\n" in text and ", libepoxy-dev," in text, text
    (folder / "tree").mkdir()
    files = ("debian/rules", "debian/changelog", "debian/source/format", "debian/control", "CMakeLists.txt")
    call("tar", "-xzf", one("*.tar.gz", folder), "-C", folder / "tree", "--strip-components=1",
         *(f"postchain-{options.version}/{file}" for file in files))
    control = (folder / "tree/debian/control").read_text()
    assert re.findall(r"\nPackage: (\S+)", control) == [
        f"libpostchain-plan{soversion(options)}", f"libpostchain{soversion(options)}",
        f"libpostchain-config{soversion(options)}", "libpostchain-dev", "postchain", "postchain-lab",
        "postchain-serve", "postchain-service", f"libpostchain-vk{soversion(options)}", "postchain-view",
        "postchain-blender", "postchain-openfx", "python3-postchain"], control


def use_unpacked(options, folder, names):
    root = folder / "root"
    for deb in folder.glob("*.deb"):
        call("dpkg", "-x", deb, root)
    for name in names:
        text = (root / f"usr/share/doc/{name}/copyright").read_text()
        assert text == (ROOT / "tools/packaging/debian/copyright").read_text(), name
    libraries_at = one("usr/lib/**/libpostchain.so", root).parent
    programs = {"host": "postchain"} | ({} if options.core else {"text": "postchain-config"})
    for source, module in programs.items():
        program = folder / source
        call("cc", "-std=c11", HERE / f"program/{source}.c", "-o", program, *flags_of(module, libraries_at))
        assert str(root) in call("ldd", program)
        expect_runs(program)
    if not options.core:
        call(root / "usr/bin/postchain", "--version")
    for binary in [*libraries_at.glob("*.so.*"), *root.glob("usr/bin/*"),
                   *root.glob("usr/lib/**/libpostchain_images.so")]:
        assert "not stripped" not in call("file", "-L", binary), binary
    if options.python:
        place = one("usr/lib/python3*/dist-packages", root)
        # Without the warning of a machine that has no GPU.
        text = call(options.python, "-B", "-W", "ignore", "-c", USE_MODULE,
                    env=dict(os.environ, PYTHONPATH=str(place)))
        assert text == f"{options.version} {place}/postchain\n(4, 4, 3)\n1\n", text


def main():
    checks = {check.__name__: check for check in (tree, headers, symbols, needed, examples,
                                                  samples, command, plugin, packages, notices)}
    parser = argparse.ArgumentParser()
    parser.add_argument("check", choices=checks)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--prefix", type=pathlib.Path, required=True)
    parser.add_argument("--version", required=True)
    parser.add_argument("--core", action="store_true")
    parser.add_argument("--parts", nargs="*", default=[])
    parser.add_argument("--vulkan", action="store_true")
    parser.add_argument("--python", help="interpreter of the module")
    options = parser.parse_args()
    options.build, options.prefix = options.build.resolve(), options.prefix.resolve()
    checks[options.check](options)


if __name__ == "__main__":
    main()
