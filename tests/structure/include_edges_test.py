"""Checks include edges (docs/architecture.md), found from the #include lines of every source file. The only rule is
the order of layers: includes go down, never up, and within a layer never in a cycle."""
import collections
import functools
import graphlib
import posixpath
import re
import typing

import files

INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]', re.A)
DIAGRAM = re.compile(r"([a-z_/]+)\s+->\s+([a-z_/ ]+)", re.A)

# From bottom to top; folders in one entry are independent of each other.
LAYERS = [
    ["shaders"],
    ["chain"],
    ["passes", "config"],
    ["tools/sequence"],
    ["tools/metrics", "tools/scenes", "tools/stress"],
    ["tools/page", "tools/apps/common"],
    ["tools/measure"],
    ["tools/service"],
    ["tools/apps", "tools/samples", "tools/python", "tools/openfx"],
]

# A part (files.py) knows no other but the pages, in these folders.
JOINTS = [("tools/python/lab", "tools/measure")]

# Headers of other projects by their name or first folder, with the folders and files that may use them. All others
# belong to the standard library and the system. OpenImageIO and OpenColorIO are in the module alone, so that programs
# need not load them at start-up.
ALLOWED_LIBRARIES = {
    "epoxy/egl.h": ["chain/egl"],
    "epoxy": ["chain/gl", "chain/egl", "chain/guest", "tools/scenes", "tools/apps/view", "tools/samples"],
    "glm": ["shaders", "chain/guest", "tools/scenes"],
    "OpenEXR": ["tools/sequence/exr", "tools/apps"],
    "Imath": ["tools/sequence/exr"],
    "OpenImageIO": ["tools/sequence/image/ocio_config.cpp", "tools/sequence/image/ocio_config.h",
                    "tools/sequence/image/image_calls.cpp", "tools/sequence/image/image_codec.cpp"],
    "OpenColorIO": ["tools/sequence/image/ocio_config.cpp", "tools/sequence/image/ocio_config.h"],
    "yaml.h": ["config/text_tree.cpp"],
    "vulkan": ["chain/vk", "tools/samples/vulkan", "tools/samples/own_device"],
    "glslang": ["chain/vk"],
    "spirv_cross_c.h": ["tools/apps/programs"],
    "nlohmann": ["config/text_tree.cpp", "tools"],
    "zlib.h": ["tools/page", "tools/sequence/exr", "tools/sequence/image", "tools/service/http"],
    "libdeflate.h": ["tools/sequence/exr"],
    "CLI": ["tools/apps", "tools/measure/program", "tools/service/program", "tools/service/preview"],
    "pybind11": ["tools/python"],
    "spdlog": ["tools/apps"],
    "seccomp.h": ["tools/apps/common"],
    "GLFW": ["tools/apps/view"],
    "boost": ["tools/measure/experiment", "tools/service/http"],
    "SQLiteCpp": ["tools/service/store"],
    "sqlite3.h": ["tools/service/store"],
    "prometheus": ["tools/service/work", "tools/service/http"],
    "imgui.h": ["tools/apps/view"],
    "imgui_stdlib.h": ["tools/apps/view"],
    "backends": ["tools/apps/view"],
    "fontconfig": ["tools/apps/view/fonts.cpp"],
    "gtest": [],
    "gmock": [],
}

# Each room includes only those before it: planning is independent of GL, running plans makes no context and knows no
# pass, and chain/vk has no GL.
ROOMS = ["chain/base", "chain/frame", "chain/plan", "chain/pass", "chain/gl", "chain/egl", "chain/guest", "chain/vk"]
# The server computes no pixel and reads no frame: these belong to its preview/ alone.
FRAMES = ["chain/gl", "chain/egl", "tools/sequence"]
BUT = ["tools/sequence/files", "tools/sequence/settings", "tools/sequence/record", "tools/sequence/source/memory.h",
       "tools/sequence/source/memory_limit.h"]
STRANGERS = [("chain/gl", "chain/pass"), ("chain/egl", "chain/pass"), ("chain/vk", "chain/gl")]


def is_in(path, folder):
    return f"{path}/".startswith(f"{folder}/")


def layer_of(path):
    """The layer folder of a path and its index from the bottom; "" and -1 if none."""
    return next(((folder, i) for i, layer in enumerate(LAYERS) for folder in layer if is_in(path, folder)), ("", -1))


def is_another_pass(start, end):
    """Passes are independent of each other; shared code is in passes/common."""
    return (is_in(start, "passes") and is_in(end, "passes") and start not in (end, "passes")
            and end not in ("passes", "passes/common", "passes/inverse_warp"))


class Include(typing.NamedTuple):
    file: str  # relative to the root of the source
    place: str
    target: str  # quoted: relative to the root as well
    quoted: bool

    @property
    def start(self):
        return posixpath.dirname(self.file)

    @property
    def end(self):
        return posixpath.dirname(self.target)


@functools.cache
def exists(name):
    return (files.ROOT / name).exists()


def target_of(start, target):
    """What a quoted include in the folder `start` names, relative to the root."""
    # GLSL and the shared headers name files relative to shaders/.
    if not exists(target) and exists(f"shaders/{target}"):
        target = f"shaders/{target}"
    # Samples are also built outside this tree and name neighboring files without a path.
    if is_in(start, "tools/samples") and exists(f"{start}/{target}"):
        target = f"{start}/{target}"
    return target


@functools.cache
def all_includes():
    found = []
    for file in files.files_below(["chain", "passes", "shaders", "config", "tools"], {".h", ".cpp", ".comp", ".glsl"}):
        for number, line in enumerate(file.lines, 1):
            if match := INCLUDE.match(line):
                quoted = match[1] == '"'
                target = target_of(posixpath.dirname(file.name), match[2]) if quoted else match[2]
                found.append(Include(file.name, f"{file.name}:{number}: ", target, quoted))
    return found


def fault_of(include):
    """The fault of an include; empty = none."""
    file, _, target, quoted = include
    layer, height = layer_of(include.start)
    if height < 0:
        return "lies in no layer"
    if not quoted:
        library = target if target in ALLOWED_LIBRARIES else target.split("/")[0]
        users = ALLOWED_LIBRARIES.get(library)
        if users is None or any(is_in(file, user) for user in users):
            return ""
        return f"{file} may not use <{target}>"
    other, depth = layer_of(include.end)
    if depth < 0:
        return f'includes "{target}", which lies in no layer'
    part, of = files.part_of(include.start), files.part_of(include.end)
    if of not in ("", "tools/page", part) and not any(is_in(include.start, joint) and of == other for joint, other in JOINTS):
        return f"{include.start} may not know the part {of}: {target}"
    if depth > height:
        return f"{layer} may not include what is above it: {target}"
    if depth == height and layer != other:
        return f"{layer} and {other} may not know each other"
    if layer == "tools/samples" and include.start != include.end:
        return f"a sample builds alone, with what is installed: {target}"
    if is_another_pass(include.start, include.end):
        return f"{include.start} may not know another pass: {target}"
    if (is_in(include.start, "tools/service") and include.start != "tools/service/preview"
            and any(is_in(target, folder) for folder in FRAMES) and not any(is_in(target, folder) for folder in BUT)):
        return f"only tools/service/preview reads frames: {target}"
    # So that metrics work on any pixels.
    if (include.start == "tools/metrics" != include.end
            and target not in ("chain/base/image.h", "chain/base/status.h")):
        return f"metrics know only the images of the chain, not {target}"
    return ""


def room_fault_of(include):
    """The fault of an include in chain/; empty = none."""
    if not is_in(include.start, "chain"):
        return ""
    if include.start not in ROOMS:
        return "in none of the eight"
    if not include.quoted or not is_in(include.end, "chain"):
        return ""
    before = ROOMS[:ROOMS.index(include.start) + 1]
    strange = any(is_in(include.start, start) and is_in(include.end, end) for start, end in STRANGERS)
    return f"{include.start} may not include {include.target}" if include.end not in before or strange else ""


def found_edges():
    """Folder -> other folders that it includes."""
    edges = collections.defaultdict(set)
    for include in all_includes():
        if include.quoted and include.start != include.end:
            edges[include.start].add(include.end)
    return edges


class IncludeEdges(files.Case):
    def test_none_runs_up(self):
        self.expect_none(include.place + fault for include in all_includes() if (fault := fault_of(include)))
        self.assertGreater(len(all_includes()), 500, "the search found too few includes")

    def test_none_goes_in_a_circle(self):
        graphlib.TopologicalSorter(found_edges()).prepare()  # raises CycleError, which names the folders

    def test_chain_has_eight_rooms(self):
        self.expect_none(include.place + fault for include in all_includes() if (fault := room_fault_of(include)))

    def test_diagram_of_the_documentation_is_complete(self):
        """The diagram of docs/architecture.md, lines "folder -> folders", matches the includes: edges of each layer,
        and of the folders of chain/ and tools/ within it."""
        expected, written = set(), set()
        for folder, targets in found_edges().items():
            layer = layer_of(folder)[0]
            for target in targets:
                if layer != layer_of(target)[0]:
                    expected.add((layer, layer_of(target)[0]))
                elif is_in(folder, "tools") or is_in(folder, "chain"):
                    expected.add((folder, target))
        for line in files.file_of("docs/architecture.md").lines:
            if match := DIAGRAM.fullmatch(line):
                written |= {(match[1], target) for target in match[2].split()}
        if not files.all_are_here():
            written &= expected
        self.expect_none([f"docs/architecture.md lacks {start} -> {end}" for start, end in sorted(expected - written)]
                         + [f"docs/architecture.md has {start} -> {end}, and no include"
                            for start, end in sorted(written - expected)])

    def test_faults_are_seen(self):
        for file, target, quoted, fault in (
                ("passes/fxaa/fxaa.cpp", "passes/motion_blur/motion_blur.h", True, True),
                ("passes/fxaa/fxaa.cpp", "config/profile.h", True, True),
                ("chain/plan/plan.cpp", "passes/registry.h", True, True),
                ("chain/plan/plan.cpp", "epoxy/gl.h", False, True),
                ("chain/gl/a.cpp", "epoxy/egl.h", False, True),
                ("tools/sequence/exr/a.cpp", "tools/metrics/flip.h", True, True),
                ("tools/sequence/image/a.h", "OpenImageIO/imageio.h", False, True),
                ("tools/metrics/flip.cpp", "chain/plan/plan.h", True, True),
                ("tools/nowhere/a.cpp", "chain/plan/plan.h", True, True),
                ("tools/service/work/a.cpp", "tools/measure/study/study.h", True, True),
                ("tools/service/work/a.cpp", "tools/sequence/source/frame_source.h", True, True),
                ("tools/service/work/a.cpp", "tools/sequence/record/sidecar.h", True, False),
                ("tools/service/http/a.cpp", "chain/egl/context.h", True, True),
                ("tools/service/preview/a.cpp", "chain/egl/context.h", True, False),
                ("tools/service/preview/a.cpp", "tools/measure/study/study.h", True, True),
                ("tools/python/lab/a.cpp", "tools/measure/study/study.h", True, False),
                ("tools/python/lab/a.cpp", "tools/apps/view/session.h", True, True),
                ("tools/apps/postchain/a.cpp", "tools/measure/study/study.h", True, True),
                ("tools/apps/view/a.cpp", "tools/metrics/compare.h", True, False),
                ("tools/samples/ogre/a.cpp", "chain/guest/postchain.h", True, True),
                ("tools/samples/ogre/a.cpp", "tools/samples/glfw/a.h", True, True),
                ("tools/samples/ogre/a.cpp", "tools/samples/ogre/a.h", True, False),
                ("passes/fxaa/fxaa.cpp", "passes/common/warp.h", True, False),
                ("tools/apps/postchain/run.cpp", "tools/sequence/files/sequence.h", True, False)):
            self.assertEqual(fault_of(Include(file, "", target, quoted)) != "", fault, f"{file} {target}")
        for file, target, fault in (("chain/plan/a.cpp", "chain/pass/a.h", True),
                                    ("chain/gl/a.cpp", "chain/pass/a.h", True),
                                    ("chain/hall/a.cpp", "chain/base/a.h", True),
                                    ("chain/gl/a.cpp", "chain/plan/a.h", False)):
            self.assertEqual(room_fault_of(Include(file, "", target, True)) != "", fault, f"{file} {target}")
