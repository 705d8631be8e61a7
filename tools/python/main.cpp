// The module postchain._postchain. Python imports it through package/__init__.py.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <tuple>
#include <utility>

#include "config/chain_find.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/flip.h"
#include "tools/metrics/temporal.h"
#include "tools/python/chain_object.h"
#include "tools/python/documentation.h"
#include "tools/python/errors.h"
#include "tools/python/frame_classes.h"
#include "tools/python/frame_object.h"
#include "tools/python/job.h"
#include "tools/python/lab_calls.h"
#include "tools/python/measure_calls.h"
#include "tools/python/sequence_calls.h"
#include "tools/python/values.h"
#include "tools/python/write_call.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/image/image_file.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

void add_device(py::module_& module) {
    py::class_<Device, std::shared_ptr<Device>> device(
        module, "Device",
        "A GL context on a thread of its own, for `device=`: \"auto\" (a GPU if there is one), "
        "\"gpu\",\n\"software\" or a number of `postchain info`. Calls on one device run one after "
        "the other,\ncalls on several side by side. Any thread may use it.");
    device.def(py::init([](const py::object& name) { return Device::create(py::str(name)); }),
               py::arg("name") = "auto");
    device.def_property_readonly("renderer", &Device::renderer);
    device.def("close", &Device::close, "Frees the context; `with` does so at its end.");
    device.def("__enter__", [](const std::shared_ptr<Device>& self) { return self; });
    device.def("__exit__", [](Device& self, const py::args&) { self.close(); });
    module.def("set_threads", set_threads, py::arg("threads"),
               "CPU threads for EXR files and software rendering; call it before the first run.");
}

void add_sequences(py::module_& module) {
    const std::string run_text =
        "Filters a sequence as `postchain run` does; returns a dict with the numbers of frames\n"
        "(total, written, skipped, held, missing, failed, left), elapsed_s, gaps, warnings and\n"
        "canceled.\n\n"
        "chain: a Chain, or what Chain() takes\n"
        "input: \"A.####.exr\", or \"color=A.####.exr,depth=B.####.exr,motion=C.####.exr\"\n"
        "output: \"out.####.exr\"\n"
        "camera: a dict or a file with the keys of a camera file\n"
        "progress: called with a dict after each frame; returns False to end the run\n"
        "stop: a threading.Event that ends the run within a frame\n"
        "device: a Device\n\nFurther arguments:" +
        rows_text(job_parameters(), run_keys());
    module.def(
        "run_sequence",
        [](const py::object& chain, const py::object& input, const py::object& output,
           const py::object& camera, const py::object& progress, const py::object& stop,
           const py::object& device, const py::kwargs& settings) {
            const ChainPtr made = chain_of(chain, py::none());
            return run_sequence(*made, path_of(input, "input"), path_of(output, "output"), camera,
                                {progress, stop}, device_of(device), settings);
        },
        py::arg("chain"), py::arg("input"), py::arg("output"), py::arg("camera") = py::none(),
        py::kw_only(), py::arg("progress") = py::none(), py::arg("stop") = py::none(),
        py::arg("device") = py::none(), run_text.c_str());
    const std::string plan_text =
        "What run_sequence() would do, a dict for each frame, as `postchain plan --json`. Computes "
        "nothing.\n\nFurther arguments:" +
        rows_text(job_parameters(), plan_sequence_keys());
    module.def(
        "plan_sequence",
        [](const py::object& chain, const py::object& input, const py::object& camera,
           const py::kwargs& settings) {
            return plan_sequence(*chain_of(chain, py::none()), path_of(input, "input"), camera,
                                 settings);
        },
        py::arg("chain"), py::arg("input"), py::arg("camera") = py::none(), plan_text.c_str());
    const std::string inspect_text =
        "What a file, a sequence or a folder contains, as `postchain inspect --json`.\n\n"
        "Further arguments:" +
        rows_text(job_parameters(), inspect_keys());
    module.def(
        "inspect",
        [](const py::object& input, const py::object& camera, const py::kwargs& settings) {
            return inspect(path_of(input, "input"), camera, settings);
        },
        py::arg("input"), py::arg("camera") = py::none(), inspect_text.c_str());
    const std::string read_text =
        "A Frame from a file, or frame `frame` of a pattern \"A.####.exr\".\n\nFurther "
        "arguments:" +
        rows_text(job_parameters(), read_keys());
    module.def(
        "read",
        [](const py::object& input, const py::object& frame, const py::object& camera,
           const py::kwargs& settings) {
            return Frame::of_files(path_of(input, "input"), frame, camera, settings);
        },
        py::arg("input"), py::arg("frame") = py::none(), py::arg("camera") = py::none(),
        read_text.c_str());
}

void add_files(py::module_& module) {
    const std::string write_text =
        "Writes an image: an array of height x width x 3 or 4, linear light, or what "
        "Chain.filter() "
        "returned.\n\npath: .exr, or " +
        io::image_extensions() +
        "\nimage: the array, or the Filtered, whose AOVs, cryptomattes and fill mask an EXR holds\n"
        "frame: the Frame of read() that it was made of: its file is written with the new color, "
        "all other\n  channels and attributes as they are. Without it a new file, with AOVs as "
        "NAME.R ...\n\nFurther arguments:" +
        rows_text(job_parameters(), write_keys());
    module.def(
        "write",
        [](const py::object& path, const py::object& image, const py::object& frame,
           const py::kwargs& settings) {
            write_image(path_of(path, "path"), image, frame, settings);
        },
        py::arg("path"), py::arg("image"), py::arg("frame") = py::none(), write_text.c_str());
    module.def(
        "check",
        [](const py::object& outputs, const py::object& frames, const py::object& like) {
            std::vector<std::string> patterns;
            if (py::isinstance<py::list>(outputs) || py::isinstance<py::tuple>(outputs))
                for (const py::handle one : outputs) patterns.push_back(path_of(one, "outputs"));
            else
                patterns.push_back(path_of(outputs, "outputs"));
            return check(patterns, frames, like.is_none() ? "" : path_of(like, "like"));
        },
        py::arg("outputs"), py::arg("frames") = py::none(), py::arg("like") = py::none(),
        "Which outputs of run_sequence() are whole, missing, damaged or from other settings, as "
        "`postchain\ncheck --json`: {\"whole\": bool, \"sequences\": [{\"output\", \"counts\", "
        "\"frames\"}]}.\n\noutputs: a pattern \"out.####.exr\", or a list of them\n"
        "frames: frames that must exist, \"1-100\"; default: from the first to the last on disk\n"
        "like: an output whose settings all frames must have; default: those of most frames");
    const std::string sheet_text =
        "Writes a contact sheet, thumbnails of a sequence in one PNG, as `postchain sheet`. "
        "Returns "
        "a dict:\nframes on the sheet, of so many, and absent images.\n\n"
        "input: \"out.####.exr\"\noutput: \"sheet.png\"\n"
        "beside: a second sequence, shown to the right of each frame\n"
        "cells: frames on the sheet at most, evenly chosen\ncolumns: frames in a row; 0: about "
        "16:9\nwidth: of a thumbnail, pixels\non_existing: \"fail\" or \"overwrite\"\n"
        "progress, stop: as of run_sequence()\n\nFurther arguments:" +
        rows_text(job_parameters(), sheet_keys());
    module.def(
        "sheet",
        [](const py::object& input, const py::object& output, const py::object& beside,
           const py::object& cells, const py::object& columns, const py::object& width,
           const py::object& on_existing, const py::object& progress, const py::object& stop,
           const py::kwargs& settings) {
            const auto number = [](const py::object& value, const char* name) {
                return argument_of<int>(value, name, "an integer");
            };
            return sheet(path_of(input, "input"), path_of(output, "output"),
                         beside.is_none() ? "" : path_of(beside, "beside"), number(cells, "cells"),
                         number(columns, "columns"), number(width, "width"), on_existing,
                         {progress, stop}, settings);
        },
        py::arg("input"), py::arg("output"), py::kw_only(), py::arg("beside") = py::none(),
        py::arg("cells") = 60, py::arg("columns") = 0, py::arg("width") = 240,
        py::arg("on_existing") = "fail", py::arg("progress") = py::none(),
        py::arg("stop") = py::none(), sheet_text.c_str());
    module.def(
        "_frame_list",
        [](const py::object& input, const py::kwargs& settings) {
            return frame_list(path_of(input, "input"), settings);
        },
        py::arg("input"), "For frames().");
}

void add_measurements(py::module_& module) {
    std::string metrics;
    for (const auto* rows : {&metrics::metric_rows(), &metrics::temporal_rows()})
        for (const auto& row : *rows) metrics += "\n  " + row.name + ": " + row.help;
    std::string maps;
    for (const auto& row : metrics::map_rows()) maps += "\n  " + row.name + ": " + row.help;
    const std::string diff_text =
        "Errors of `test` against `reference`: arrays, files, patterns \"A.####.exr\", or lists "
        "of\narrays and files. Returns a dict by metric, for sequences {\"frames\": [...], "
        "\"summary\":\n{...}}. Only these have tde and temporal_error. None: the metric is "
        "undefined\n(PSNR of equal images: infinite).\n\nmetrics (default: all):" +
        metrics + "\nmap: also return this error map as \"map\":" + maps +
        "\nover: composite both over this linear gray first\n"
        "pixels_per_degree: of visual angle, for FLIP";
    module.def(
        "diff",
        [](const py::object& reference, const py::object& test, const py::object& names,
           const py::object& map, const py::object& over, const py::object& pixels_per_degree,
           const py::object& tone_mapper, const py::kwargs& settings) {
            using Words = std::vector<std::string>;
            const DiffRequest request{
                argument_of<Words>(names, "metrics", "a list of names"),
                argument_of<std::string>(map, "map", "a name"),
                argument_of<std::optional<double>>(over, "over", "a number"),
                argument_of<double>(pixels_per_degree, "pixels_per_degree", "a number"),
                argument_of<std::string>(tone_mapper, "tone_mapper", "a name")};
            return diff(reference, test, request, settings);
        },
        py::arg("reference"), py::arg("test"), py::kw_only(),
        py::arg("metrics") = std::vector<std::string>(), py::arg("map") = "",
        py::arg("over") = py::none(), py::arg("pixels_per_degree") = metrics::kPixelsPerDegree,
        py::arg("tone_mapper") = "aces", diff_text.c_str());
    std::string names;
    for (const auto& scene : scenes::scenes()) names += "\n  " + scene.name + ": " + scene.help;
    const std::string scene_text =
        "Writes a generated scene into a folder: EXR frames with depth and motion vectors, "
        "camera.json,\nand with `truth_samples` ground truth (mb, dof, both).\n\nname:" +
        names +
        "\nframes: \"1-8\", or numbers\nbehind: also writes the layer behind, for "
        "run_sequence(behind=)"
        "\ndeep: also writes deep files with the frame and the layer behind\ncamera: a dict of "
        "values that replace the scene's\n"
        "progress: called with a dict; returns False to end";
    module.def(
        "scene",
        [](const py::object& name, const py::object& folder, const py::object& size,
           const py::object& frames, const py::object& truth_samples, const py::object& behind,
           const py::object& deep, const py::object& on_existing, const py::object& camera,
           const py::object& device, const py::object& progress, const py::object& stop) {
            scenes::SceneRequest request;
            request.name = argument_of<std::string>(name, "name", "a name");
            request.folder = path_of(folder, "folder");
            std::tie(request.width, request.height) =
                argument_of<std::pair<int, int>>(size, "size", "width and height");
            request.truth_samples = argument_of<int>(truth_samples, "truth_samples", "an integer");
            request.behind = argument_of<bool>(behind, "behind", "True or False");
            request.deep = argument_of<bool>(deep, "deep", "True or False");
            write_scene(std::move(request), frames,
                        argument_of<std::string>(on_existing, "on_existing", "fail or overwrite"),
                        camera, py::str(device), {progress, stop});
        },
        py::arg("name"), py::arg("folder"), py::kw_only(),
        py::arg("size") = std::pair<int, int>(640, 360), py::arg("frames") = "1",
        py::arg("truth_samples") = 0, py::arg("behind") = false, py::arg("deep") = false,
        py::arg("on_existing") = "fail", py::arg("camera") = py::none(), py::arg("device") = "auto",
        py::arg("progress") = py::none(), py::arg("stop") = py::none(), scene_text.c_str());
}

}  // namespace
}  // namespace postchain::python

PYBIND11_MODULE(_postchain, module) {
    namespace python = postchain::python;
    module.attr("__version__") = POSTCHAIN_VERSION;
    python::add_device(module);
    python::add_frame(module);
    python::add_chain(module);
    python::add_sequences(module);
    python::add_files(module);
    python::add_measurements(module);
    python::add_lab(module);
    module.def(
        "schema",
        [] { return python::python_of(postchain::chain_schema(postchain::builtin_passes())); },
        "The JSON Schema of chain files and of dicts for Chain(), as a dict.");
    module.def("shipped_chains", postchain::shipped_chains, "Names for Chain().");
    module.def("_tables", python::tables);
    // Before the interpreter's modules go, end what runs, and free GL.
    py::module_::import("atexit").attr("register")(py::cpp_function([] {
        python::stop_all_calls();
        python::close_all_devices();
    }));
}
