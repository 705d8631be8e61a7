// The module postchain._postchain. What Python sees of it is package/__init__.py.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "config/chain_file.h"
#include "config/chain_find.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/measure/metrics/compare.h"
#include "tools/measure/metrics/flip.h"
#include "tools/measure/scenes/scene.h"
#include "tools/python/chain_object.h"
#include "tools/python/documentation.h"
#include "tools/python/errors.h"
#include "tools/python/frame_object.h"
#include "tools/python/job.h"
#include "tools/python/measure_calls.h"
#include "tools/python/sequence_calls.h"
#include "tools/python/values.h"
#include "tools/sequence/files/parameter_json.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

std::shared_ptr<Device> device_of(const py::object& device) {
    if (device.is_none()) return default_device();
    if (!py::isinstance<Device>(device))
        raise(Status(StatusCode::usage, concat("device: is a ", type_of(device),
                                               "; give a Device(), as Device(\"gpu\")")));
    return device.cast<std::shared_ptr<Device>>();
}

// A frame that is given as one, or as arrays. `place`: "before".
FramePtr neighbor_of(const char* place, const py::object& value, int number,
                     const py::object& camera, const std::string& depth_encoding,
                     double pixel_aspect, const py::kwargs& settings) {
    if (value.is_none()) return nullptr;
    if (py::isinstance<Frame>(value)) return value.cast<std::shared_ptr<Frame>>();
    if (!py::isinstance<py::dict>(value))
        raise(Status(StatusCode::usage,
                     concat(place,
                            ": give a Frame, or a dict with color, depth, motion and "
                            "motion_back")));
    FrameArrays arrays{py::none(), py::none(), py::none(), py::none()};
    for (const auto& [name, array] : py::reinterpret_borrow<py::dict>(value)) {
        const std::string key = py::str(name);
        py::object* to = key == "color"         ? &arrays.color
                         : key == "depth"       ? &arrays.depth
                         : key == "motion"      ? &arrays.motion
                         : key == "motion_back" ? &arrays.motion_back
                                                : nullptr;
        if (!to)
            raise(Status(StatusCode::usage,
                         concat(place, ": unknown plane '", key,
                                "'; known are color, depth, motion, motion_back")));
        *to = py::reinterpret_borrow<py::object>(array);
    }
    return Frame::of_arrays(arrays, number, camera, depth_encoding, pixel_aspect, settings);
}

// The frames of a call of run() or plan().
FrameWithNeighbors frames_of(const py::object& color, const py::object& depth,
                             const py::object& motion, const py::object& motion_back,
                             const py::object& camera, const py::object& before,
                             const py::object& after, const py::object& number,
                             const std::optional<std::string>& depth_encoding,
                             const std::optional<double>& pixel_aspect,
                             const py::kwargs& settings) {
    FrameWithNeighbors frames;
    std::shared_ptr<Frame> frame;
    const std::string encoding = depth_encoding.value_or("linear");
    const double aspect = pixel_aspect.value_or(1);
    if (py::isinstance<Frame>(color)) {
        const bool more = !depth.is_none() || !motion.is_none() || !motion_back.is_none() ||
                          !camera.is_none() || !number.is_none() || depth_encoding ||
                          pixel_aspect || py::len(settings) > 0;
        if (more)
            raise(Status(StatusCode::usage,
                         "run: the planes, camera and settings of a Frame are its own; give them "
                         "to Frame()"));
        frame = color.cast<std::shared_ptr<Frame>>();
    } else {
        frame = Frame::of_arrays({color, depth, motion, motion_back},
                                 number.is_none() ? 0 : frame_number_of(number), camera, encoding,
                                 aspect, settings);
    }
    const auto neighbor = [&](const char* place, const py::object& value, int step) {
        return neighbor_of(place, value, frame->number() + step, camera, encoding, aspect,
                           settings);
    };
    frames.before = neighbor("before", before, -1);
    frames.after = neighbor("after", after, 1);
    frames.frame = std::move(frame);
    return frames;
}

// Planes of a frame as arrays, converted.
py::dict planes_of_frame(const Frame& frame) {
    auto source = in_background("reading a frame", [&](Call&) {
        return frame.read(
            RoleSet{Role::color, Role::inverse_depth, Role::motion, Role::motion_back});
    });
    if (!source.ok()) raise(source.status());
    warn((*source)->warnings);
    py::dict planes;
    for (Role role : kFileRoles) {
        const auto plane = (*source)->planes.find(role);
        planes[name_of(role)] =
            plane == (*source)->planes.end() ? py::object(py::none()) : array_of(plane->second);
    }
    return planes;
}

py::dict camera_of_frame(const Frame& frame) {
    py::dict camera;
    for (const Parameter& row : camera_parameters().rows())
        if (const ParameterValue value = row.get(&frame.header().camera); value != ParameterValue())
            camera[row.key.c_str()] = python_of(io::json_of(value));
    return camera;
}

void add_chain(py::module_& module) {
    const std::string text =
        "A chain of passes: motion blur, depth of field, joint blur, FXAA. It never changes.\n\n"
        "Chain(source, set=None): `source` is a shipped name (\"balanced\"), the path of a chain\n"
        "file, or a dict {\"camera\": {...}, \"passes\": [{\"fxaa\": {...}}, ...], \"postchain\": "
        "1}.\n`set` changes values: {\"motion_blur.samples\": 51, \"camera.f_stop\": 2}.\n\n"
        "Passes and their parameters:" +
        passes_text();
    py::class_<ChainObject, std::shared_ptr<ChainObject>> chain(module, "Chain", text.c_str());
    // pybind11's holder is not const; nothing here changes a chain.
    const auto held = [](ChainPtr made) { return std::const_pointer_cast<ChainObject>(made); };
    chain.def(py::init([held](const py::object& source, const py::object& set) {
                  return held(chain_of(source, set));
              }),
              py::arg("source"), py::arg("set") = py::none());
    chain.def_static(
        "from_text",
        [held](const std::string& yaml, const std::string& name, const py::object& set) {
            return held(chain_from_text(yaml, name, set));
        },
        py::arg("text"), py::arg("name") = "text", py::arg("set") = py::none(),
        "A chain from the text of a chain file (YAML or JSON). `name` stands for the file in "
        "messages.");
    const std::string settings =
        "\n\nFurther arguments:" + rows_text(&array_keys()) + rows_text(&plan_keys());
    const std::string run_text =
        "Filters one frame; returns its color as a float32 array of height x width x 3 or 4.\n\n"
        "color: float32 or float16, height x width x 3 or 4 (premultiplied alpha), linear light; "
        "or a\n  Frame, which has everything else too\n"
        "depth: height x width, distance along the view axis, scene units (depth_encoding for "
        "others)\n"
        "motion: height x width x 2, pixels to the next frame, x to the right, y down\n"
        "motion_back: likewise from the previous frame to this one\n"
        "camera: a dict or a file with the keys of a camera file\n"
        "before, after: neighboring frames, as Frame or dict(color=, depth=, motion=)\n"
        "frame: the frame's number, for seeds and the camera" +
        settings;
    chain.def(
        "run",
        [](const ChainObject& self, const py::object& color, const py::object& depth,
           const py::object& motion, const py::object& camera, const py::object& before,
           const py::object& after, const py::object& motion_back, const py::object& frame,
           const std::optional<std::string>& depth_encoding,
           const std::optional<double>& pixel_aspect, const py::object& device, py::kwargs values) {
            const PlanOptions options = plan_options_of(taken(values, plan_keys()));
            const auto frames = frames_of(color, depth, motion, motion_back, camera, before, after,
                                          frame, depth_encoding, pixel_aspect, values);
            return run_chain(self, frames, options, device_of(device));
        },
        py::arg("color"), py::arg("depth") = py::none(), py::arg("motion") = py::none(),
        py::arg("camera") = py::none(), py::arg("before") = py::none(),
        py::arg("after") = py::none(), py::kw_only(), py::arg("motion_back") = py::none(),
        py::arg("frame") = py::none(), py::arg("depth_encoding") = py::none(),
        py::arg("pixel_aspect") = py::none(), py::arg("device") = py::none(), run_text.c_str());
    chain.def(
        "plan",
        [](const ChainObject& self, const py::object& color, const py::object& depth,
           const py::object& motion, const py::object& camera, const py::object& before,
           const py::object& after, const py::object& motion_back, const py::object& frame,
           const std::optional<std::string>& depth_encoding,
           const std::optional<double>& pixel_aspect, py::kwargs values) {
            const PlanOptions options = plan_options_of(taken(values, plan_keys()));
            const auto frames = frames_of(color, depth, motion, motion_back, camera, before, after,
                                          frame, depth_encoding, pixel_aspect, values);
            return plan_chain(self, frames, options);
        },
        py::arg("color"), py::arg("depth") = py::none(), py::arg("motion") = py::none(),
        py::arg("camera") = py::none(), py::arg("before") = py::none(),
        py::arg("after") = py::none(), py::kw_only(), py::arg("motion_back") = py::none(),
        py::arg("frame") = py::none(), py::arg("depth_encoding") = py::none(),
        py::arg("pixel_aspect") = py::none(),
        "What run() would do with these arguments, as a dict; computes nothing.");
    chain.def(
        "dict", [](const ChainObject& self) { return dict_of(self); },
        "The chain as a dict with every value, from which Chain() makes the same chain.");
    chain.def_property_readonly(
        "text", [](const ChainObject& self) { return write_chain(self.chain); },
        "The chain as the text of a chain file.");
    chain.def_property_readonly(
        "name", [](const ChainObject& self) { return self.name; }, "Where it came from.");
    chain.def_property_readonly(
        "passes", [](const ChainObject& self) { return self.chain.types(); },
        "The names of its passes, in order.");
    chain.def_property_readonly(
        "hash", [](const ChainObject& self) { return hex_of(self.chain.hash()); },
        "16 digits that identify what the chain does.");
    chain.def("__eq__", [](const ChainObject& self, const py::object& other) {
        return py::isinstance<ChainObject>(other) &&
               self.chain.text() == other.cast<const ChainObject&>().chain.text();
    });
    chain.def("__hash__", [](const ChainObject& self) { return py::int_(self.chain.hash()); });
    chain.def("__repr__", [](const ChainObject& self) {
        std::string passes;
        for (const auto& type : self.chain.types()) passes += (passes.empty() ? "" : ", ") + type;
        return concat("<postchain.Chain ", self.name, ": ", passes, ">");
    });
    chain.def(py::pickle(
        [](const ChainObject& self) { return py::make_tuple(write_chain(self.chain), self.name); },
        [held](const py::tuple& state) {
            return held(chain_from_text(py::str(state[0]), py::str(state[1]), py::none()));
        }));
}

void add_frame(py::module_& module) {
    const std::string text =
        "One frame of arrays, for Chain.run(): as `color`, `before` or `after`. It keeps the "
        "arrays,\nwhich must not change, and converts them once. Arguments are those of "
        "Chain.run().";
    py::class_<Frame, std::shared_ptr<Frame>> frame(module, "Frame", text.c_str());
    frame.def(py::init([](const py::object& color, const py::object& depth,
                          const py::object& motion, const py::object& motion_back,
                          const py::object& camera, int number, const std::string& depth_encoding,
                          double pixel_aspect, const py::kwargs& settings) {
                  return Frame::of_arrays({color, depth, motion, motion_back}, number, camera,
                                          depth_encoding, pixel_aspect, settings);
              }),
              py::arg("color"), py::arg("depth") = py::none(), py::arg("motion") = py::none(),
              py::arg("motion_back") = py::none(), py::arg("camera") = py::none(), py::kw_only(),
              py::arg("frame") = 0, py::arg("depth_encoding") = "linear",
              py::arg("pixel_aspect") = 1.0);
    frame.def("planes", planes_of_frame,
              "Its planes in the canonical convention, read-only: color, inverse_depth, motion, "
              "motion_back; None = the frame has no such plane.");
    frame.def_property_readonly("camera", camera_of_frame, "The values of its camera.");
    frame.def_property_readonly("number", &Frame::number);
    frame.def_property_readonly("width",
                                [](const Frame& self) { return self.header().window.width(); });
    frame.def_property_readonly("height",
                                [](const Frame& self) { return self.header().window.height(); });
    frame.def("__repr__", [](const Frame& self) {
        const io::Window& window = self.header().window;
        return concat("<postchain.Frame ", self.number(), ": ", window.width(), "x",
                      window.height(), ", ", sequence::roles_in_files(self.header()).text(), ">");
    });
}

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
        rows_text(nullptr);
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
    module.def(
        "plan_sequence",
        [](const py::object& chain, const py::object& input, const py::object& camera,
           const py::kwargs& settings) {
            return plan_sequence(*chain_of(chain, py::none()), path_of(input, "input"), camera,
                                 settings);
        },
        py::arg("chain"), py::arg("input"), py::arg("camera") = py::none(),
        "What run_sequence() would do, a dict for each frame, as `postchain plan --json`.");
    module.def(
        "inspect",
        [](const py::object& input, const py::object& camera, const py::kwargs& settings) {
            return inspect(path_of(input, "input"), camera, settings);
        },
        py::arg("input"), py::arg("camera") = py::none(),
        "What a file, a sequence or a folder contains, as `postchain inspect --json`.");
    const std::string read_text =
        "A Frame from a file, or frame `frame` of a pattern \"A.####.exr\".\n\nFurther "
        "arguments:" +
        rows_text(&file_keys());
    module.def(
        "read",
        [](const py::object& input, const py::object& frame, const py::object& camera,
           const py::kwargs& settings) {
            return Frame::of_files(path_of(input, "input"), frame, camera, settings);
        },
        py::arg("input"), py::arg("frame") = py::none(), py::arg("camera") = py::none(),
        read_text.c_str());
}

void add_measurements(py::module_& module) {
    std::string metrics;
    for (const auto& row : metrics::metric_rows()) metrics += "\n  " + row.name + ": " + row.help;
    std::string maps;
    for (const auto& row : metrics::map_rows()) maps += "\n  " + row.name + ": " + row.help;
    const std::string diff_text =
        "Errors of `test` against `reference`: arrays, files, patterns \"A.####.exr\", or lists "
        "of\narrays and files. Of one pair a dict by metric; of sequences {\"frames\": [...], "
        "\"summary\":\n{...}}, with tde (mean |change of the error| from frame to frame). None: "
        "the metric is\nundefined (PSNR of equal images: infinite).\n\nmetrics (default: all):" +
        metrics + "\nmap: also return this error map as \"map\":" + maps +
        "\nover: composite both over this linear gray first\n"
        "pixels_per_degree: of visual angle, for FLIP";
    module.def(
        "diff",
        [](const py::object& reference, const py::object& test,
           const std::vector<std::string>& names, const std::string& map,
           const std::optional<double>& over, double pixels_per_degree,
           const std::string& tone_mapper, const py::kwargs& settings) {
            return diff(reference, test, {names, map, over, pixels_per_degree, tone_mapper},
                        settings);
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
        "\nframes: \"1-8\", or numbers\ncamera: a dict of values that replace the scene's\n"
        "progress: called with a dict; returns False to end";
    module.def(
        "scene",
        [](const std::string& name, const py::object& folder, std::pair<int, int> size,
           const py::object& frames, int truth_samples, const std::string& on_existing,
           const py::object& camera, const std::string& device, const py::object& progress,
           const py::object& stop) {
            write_scene(name, path_of(folder, "folder"), size, frames, truth_samples, on_existing,
                        camera, device, {progress, stop});
        },
        py::arg("name"), py::arg("folder"), py::kw_only(),
        py::arg("size") = std::pair<int, int>(640, 360), py::arg("frames") = "1",
        py::arg("truth_samples") = 0, py::arg("on_existing") = "fail",
        py::arg("camera") = py::none(), py::arg("device") = "auto",
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
    python::add_measurements(module);
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
