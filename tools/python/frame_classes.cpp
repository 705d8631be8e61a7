#include "tools/python/frame_classes.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "chain/base/text.h"
#include "config/chain_file.h"
#include "passes/registry.h"
#include "tools/python/documentation.h"
#include "tools/python/errors.h"
#include "tools/python/frame_object.h"
#include "tools/python/job.h"
#include "tools/python/values.h"
#include "tools/sequence/files/json.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// The arguments of run(), filter() and plan() that describe frames.
struct FrameArguments {
    std::string method;  // for messages
    py::object color;    // an array, or a Frame
    FrameArrays arrays;
    py::object camera, before, after, number, behind;
    std::optional<std::string> depth_encoding;
    std::optional<double> pixel_aspect;
};

std::string encoding_of(const py::object& value) {
    return argument_of<std::string>(value, "depth_encoding", "a name");
}

double aspect_of(const py::object& value) {
    return argument_of<double>(value, "pixel_aspect", "a number");
}

bool has_any(const FrameArrays& arrays) {
    for (const auto* one : {&arrays.depth, &arrays.motion, &arrays.motion_back, &arrays.aovs,
                            &arrays.mattes, &arrays.cryptomattes})
        if (!one->is_none()) return true;
    return false;
}

FrameArrays no_arrays() {
    return {py::none(), py::none(), py::none(), py::none(), py::none(), py::none(), py::none()};
}

// Another frame of the argument `place`, given as a Frame or as a dict of arrays; null for None.
std::shared_ptr<Frame> frame_of(const std::string& place, const py::object& value, int number,
                                const FrameArguments& given, const py::kwargs& settings) {
    if (value.is_none() || value.is(py::ellipsis())) return nullptr;
    if (py::isinstance<Frame>(value)) return value.cast<std::shared_ptr<Frame>>();
    FrameArrays arrays = no_arrays();
    const std::pair<const char*, py::object*> planes[] = {{"color", &arrays.color},
                                                          {"depth", &arrays.depth},
                                                          {"motion", &arrays.motion},
                                                          {"motion_back", &arrays.motion_back},
                                                          {"aovs", &arrays.aovs},
                                                          {"mattes", &arrays.mattes},
                                                          {"cryptomattes", &arrays.cryptomattes}};
    std::vector<std::string> known;
    for (const auto& plane : planes) known.push_back(plane.first);
    if (!py::isinstance<py::dict>(value))
        raise_usage(place, ": give a Frame, or a dict with ", joined(known));
    for (const auto& [name, array] : py::reinterpret_borrow<py::dict>(value)) {
        const std::string key = py::str(name);
        const auto plane = std::find_if(std::begin(planes), std::end(planes),
                                        [&](const auto& one) { return one.first == key; });
        if (plane == std::end(planes))
            raise_usage(place, ": unknown plane '", key, "'; known are ", joined(known));
        *plane->second = py::reinterpret_borrow<py::object>(array);
    }
    return Frame::of_arrays(given.method, arrays, py::int_(number), given.camera,
                            given.depth_encoding.value_or("linear"), given.pixel_aspect.value_or(1),
                            nullptr, settings);
}

// The frame before or after `frame`.
FramePtr neighbor_of(Neighbor which, const py::object& value, const Frame& frame,
                     const FrameArguments& given, const py::kwargs& settings) {
    const std::string place = name_of(which);
    const int number = frame.number() + (which == Neighbor::before ? -1 : 1);
    auto neighbor = frame_of(place, value, number, given, settings);
    if (neighbor && frame.has_number() && neighbor->has_number() && neighbor->number() != number)
        raise_usage(place, ": is frame ", neighbor->number(), ", but the one ", place, " frame ",
                    frame.number(), " is frame ", number);
    return neighbor;
}

// The frame of arrays of the caller.
std::shared_ptr<Frame> frame_of_arrays(const FrameArguments& given, const py::object& behind,
                                       const py::kwargs& settings) {
    FrameArrays arrays = given.arrays;
    arrays.color = given.color;
    const int number = given.number.is_none() ? 0 : frame_number_of(given.number);
    auto layer = frame_of("behind", behind, number, given, settings);
    return Frame::of_arrays(given.method, arrays, given.number, given.camera,
                            given.depth_encoding.value_or("linear"), given.pixel_aspect.value_or(1),
                            std::move(layer), settings);
}

FrameWithNeighbors frames_of(const FrameArguments& given, const py::kwargs& settings) {
    FrameWithNeighbors frames;
    std::shared_ptr<Frame> frame;
    if (py::isinstance<Frame>(given.color)) {
        const bool more = has_any(given.arrays) || !given.camera.is_none() ||
                          !given.number.is_none() || !given.behind.is_none() ||
                          given.depth_encoding || given.pixel_aspect || py::len(settings) > 0;
        if (more)
            raise_usage(
                "color: the planes, camera and settings of a Frame are its own; give them "
                "to Frame()");
        frame = given.color.cast<std::shared_ptr<Frame>>();
    } else {
        frame = frame_of_arrays(given, given.behind, settings);
    }
    frames.before = neighbor_of(Neighbor::before, given.before, *frame, given, settings);
    frames.after = neighbor_of(Neighbor::after, given.after, *frame, given, settings);
    frames.unsaid = given.before.is(py::ellipsis()) || given.after.is(py::ellipsis());
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

using ChainClass = py::class_<ChainObject, std::shared_ptr<ChainObject>>;

// pybind11's holder is not const; nothing here changes a chain.
std::shared_ptr<ChainObject> held(const ChainPtr& made) {
    return std::const_pointer_cast<ChainObject>(made);
}

constexpr const char* kArrayArguments =
    "color: float32 or float16, height x width x 3 or 4 (premultiplied alpha), linear light; "
    "or a\n  Frame, which has everything else too\n"
    "depth: height x width, distance along the view axis, scene units (depth_encoding for "
    "others)\n"
    "motion: height x width x 2, pixels to the next frame, x to the right, y down\n"
    "motion_back: likewise from the previous frame to this one\n"
    "camera: a dict or a file with the keys of a camera file\n"
    "before, after: neighboring frames, as Frame or dict(color=, depth=, motion=); None: there is\n"
    "  none. Left out although the chain reads them: a Warning. A Frame whose number is another's\n"
    "  is refused\n"
    "mattes: a dict of height x width, 0 to 1, by the names that passes have as `matte`\n"
    "cryptomattes: a dict by name of float32, height x width x 4, 8, ... (id, coverage of each\n"
    "  rank), or of (array, manifest); for the mattes \"cryptomatte:NAME\" of passes\n"
    "behind: the layer behind, a second render without the front objects, as before";
constexpr const char* kFrameArgument = "\nframe: the frame's number, for seeds and the camera";
constexpr const char* kAovsArgument =
    "\naovs: a dict by name of height x width x 3 or 4, filtered with color's weights";

template <class>
using Object = py::object;

// A method that takes the arrays of a frame, then `more` by name, and calls act(chain, arguments,
// values, options, more...).
template <class Act, class... More>
void add_action(ChainClass& chain, const char* name, const std::string& text, const Act& act,
                const More&... more) {
    chain.def(
        name,
        [act, name](const ChainObject& self, const py::object& color, const py::object& depth,
                    const py::object& motion, const py::object& camera, const py::object& before,
                    const py::object& after, const py::object& motion_back,
                    const py::object& mattes, const py::object& cryptomattes,
                    const py::object& behind, const py::object& frame,
                    const py::object& depth_encoding, const py::object& pixel_aspect,
                    const Object<More>&... others, py::kwargs values) {
            const PlanOptions options = plan_options_of(taken(values, plan_keys()));
            FrameArrays arrays{py::none(), depth,  motion,      motion_back,
                               py::none(), mattes, cryptomattes};
            FrameArguments given{name, color, arrays, camera, before, after, frame, behind, {}, {}};
            if (!depth_encoding.is_none()) given.depth_encoding = encoding_of(depth_encoding);
            if (!pixel_aspect.is_none()) given.pixel_aspect = aspect_of(pixel_aspect);
            return act(self, given, values, options, others...);
        },
        py::arg("color"), py::arg("depth") = py::none(), py::arg("motion") = py::none(),
        py::arg("camera") = py::none(), py::arg("before") = py::ellipsis(),
        py::arg("after") = py::ellipsis(), py::kw_only(), py::arg("motion_back") = py::none(),
        py::arg("mattes") = py::none(), py::arg("cryptomattes") = py::none(),
        py::arg("behind") = py::none(), py::arg("frame") = py::none(),
        py::arg("depth_encoding") = py::none(), py::arg("pixel_aspect") = py::none(), more...,
        text.c_str());
}

// The stages of filter(): True, or some names.
FilterRequest request_of(const py::object& fill_mask, const py::object& stages) {
    FilterRequest request;
    request.fill_mask = argument_of<bool>(fill_mask, "fill_mask", "True or False");
    if (py::isinstance<py::bool_>(stages))
        request.all_stages = stages.cast<bool>();
    else if (!stages.is_none())
        request.stages =
            argument_of<std::vector<std::string>>(stages, "stages", "True, or a list of names");
    return request;
}

void add_actions(ChainClass& chain) {
    const py::arg_v aovs = py::arg("aovs") = py::none(), device = py::arg("device") = py::none();
    const std::string settings =
        "\n\nFurther arguments:" + rows_text(job_parameters(), array_keys()) +
        rows_text(job_parameters(), plan_keys());
    add_action(
        chain, "run",
        concat("Filters one frame; returns its color as a float32 array of height x width x 3 or 4."
               "\n\n",
               kArrayArguments, kFrameArgument, settings),
        [](const ChainObject& self, const FrameArguments& given, const py::kwargs& values,
           const PlanOptions& options, const py::object& on) {
            if (values.contains("aovs"))
                raise_usage("aovs: run() returns the color; call filter()");
            return run_chain(self, frames_of(given, values), options, device_of(on));
        },
        device);
    add_action(
        chain, "filter",
        concat("Filters one frame, and returns all that files can give, as a Filtered: color, with "
               "the bits of\nrun(), AOVs and cryptomattes, fill mask, stages, and the time of each "
               "pass.\n\n",
               kArrayArguments, kAovsArgument,
               "\nfill_mask: also return which share of each pixel came from its frame, a "
               "neighbor, an estimate\nstages: also return textures of the plan: True for all, or "
               "names such as\n  \"0.motion_blur.starts\" (Chain.plan()[\"textures\"])",
               kFrameArgument, settings, rows_text(job_parameters(), aov_keys())),
        [](const ChainObject& self, FrameArguments given, const py::kwargs& values,
           const PlanOptions& options, const py::object& planes, const py::object& fill_mask,
           const py::object& stages, const py::object& on) {
            given.arrays.aovs = planes;
            return filter_chain(self, frames_of(given, values), options,
                                request_of(fill_mask, stages), device_of(on));
        },
        aovs, py::arg("fill_mask") = false, py::arg("stages") = py::none(), device);
    add_action(
        chain, "plan",
        concat("What run() or filter() would do with these arguments, as a dict; computes nothing."
               "\n\n",
               kArrayArguments, kAovsArgument, kFrameArgument, settings,
               rows_text(job_parameters(), aov_keys())),
        [](const ChainObject& self, FrameArguments given, const py::kwargs& values,
           const PlanOptions& options, const py::object& planes) {
            given.arrays.aovs = planes;
            return plan_chain(self, frames_of(given, values), options);
        },
        aovs);
}

}  // namespace

void add_chain(py::module_& module) {
    const std::string text =
        "A chain of passes: motion blur, depth of field, joint blur, FXAA. It never changes.\n\n"
        "Chain(source, set=None): `source` is a shipped name (\"balanced\"), the path of a chain\n"
        "file, or a dict {\"camera\": {...}, \"passes\": [{\"fxaa\": {...}}, ...], \"postchain\": "
        "1}.\n`set` changes values: {\"motion_blur.samples\": 51, \"camera.f_stop\": 2}.\n\n"
        "Passes and their parameters:" +
        passes_text();
    ChainClass chain(module, "Chain", text.c_str());
    chain.def(py::init([](const py::object& source, const py::object& set) {
                  return held(chain_of(source, set));
              }),
              py::arg("source"), py::arg("set") = py::none());
    chain.def_static(
        "from_text",
        [](const py::object& yaml, const py::object& name, const py::object& set) {
            return held(chain_from_text(argument_of<std::string>(yaml, "text", "a string"),
                                        argument_of<std::string>(name, "name", "a string"), set));
        },
        py::arg("text"), py::arg("name") = "text", py::arg("set") = py::none(),
        "A chain from the text of a chain file (YAML or JSON). `name` stands for the file in "
        "messages.");
    add_actions(chain);
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
        [](const py::tuple& state) {
            return held(chain_from_text(py::str(state[0]), py::str(state[1]), py::none()));
        }));
}

void add_frame(py::module_& module) {
    const std::string text =
        "One frame of arrays, for Chain.run() and filter(): as `color`, `before`, `after` or "
        "`behind`. It\nkeeps the arrays, which must not change, and converts them once. read() "
        "makes "
        "one of files.\n\n" +
        std::string(kArrayArguments) + kAovsArgument + kFrameArgument +
        "\n\nFurther arguments:" + rows_text(job_parameters(), frame_keys());
    py::class_<Frame, std::shared_ptr<Frame>> frame(module, "Frame", text.c_str());
    frame.def(
        py::init([](const py::object& color, const py::object& depth, const py::object& motion,
                    const py::object& motion_back, const py::object& camera, const py::object& aovs,
                    const py::object& mattes, const py::object& cryptomattes,
                    const py::object& behind, const py::object& number,
                    const py::object& depth_encoding, const py::object& pixel_aspect,
                    const py::kwargs& settings) {
            const FrameArrays arrays{py::none(), depth,  motion,      motion_back,
                                     aovs,       mattes, cryptomattes};
            const FrameArguments given{"Frame",
                                       color,
                                       arrays,
                                       camera,
                                       py::none(),
                                       py::none(),
                                       number,
                                       behind,
                                       encoding_of(depth_encoding),
                                       aspect_of(pixel_aspect)};
            return frame_of_arrays(given, behind, settings);
        }),
        py::arg("color"), py::arg("depth") = py::none(), py::arg("motion") = py::none(),
        py::arg("motion_back") = py::none(), py::arg("camera") = py::none(), py::kw_only(),
        py::arg("aovs") = py::none(), py::arg("mattes") = py::none(),
        py::arg("cryptomattes") = py::none(), py::arg("behind") = py::none(),
        py::arg("frame") = py::none(), py::arg("depth_encoding") = "linear",
        py::arg("pixel_aspect") = 1.0);
    frame.def(
        "aovs", aovs_of,
        "The AOVs to filter (`aovs` of Frame() or read()), by name: float32, height x width x "
        "3 or 4.");
    frame.def(
        "mattes",
        [](const Frame& self, const py::args& names) {
            return mattes_of(self, argument_of<std::vector<std::string>>(names, "mattes", "names"));
        },
        "Mattes by the names that passes have as `matte`, a channel or \"cryptomatte:hero\": "
        "float32,\nheight x width, 0 to 1.");
    frame.def("cryptomattes", cryptomattes_of,
              "The cryptomattes to filter (cryptomatte=\"filter\"), by name: float32, height x "
              "width x (id,\ncoverage of each rank).");
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

}  // namespace postchain::python
