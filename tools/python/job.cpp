#include "tools/python/job.h"

#include "passes/registry.h"
#include "tools/python/errors.h"
#include "tools/python/values.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace py = pybind11;

namespace postchain::python {

const ParameterTable& job_parameters() {
    static const ParameterTable table = sequence::job_parameters(builtin_passes());
    return table;
}

const std::set<std::string>& array_keys() {
    static const std::set<std::string> keys = {"nonfinite", "camera_motion", "cuts"};
    return keys;
}

const std::set<std::string>& file_keys() {
    static const std::set<std::string> keys = {
        "nonfinite",   "camera_motion", "cuts",           "profile", "view_layer",     "view",
        "data_window", "max_memory",    "input_transfer", "ocio",    "ocio_colorspace"};
    return keys;
}

const std::set<std::string>& aov_keys() {
    static const std::set<std::string> keys = {"cryptomatte"};
    return keys;
}

const std::set<std::string>& frame_keys() {
    static const std::set<std::string> keys = [] {
        std::set<std::string> all = array_keys();
        all.insert(aov_keys().begin(), aov_keys().end());
        return all;
    }();
    return keys;
}

const std::set<std::string>& read_keys() {
    static const std::set<std::string> keys = [] {
        std::set<std::string> all = file_keys();
        all.insert({"aovs", "cryptomatte", "behind"});
        return all;
    }();
    return keys;
}

namespace {

// The rows of some groups; input, output and camera are arguments of their own.
std::set<std::string> keys_of_groups(const std::set<std::string>& groups) {
    std::set<std::string> keys;
    for (const Parameter& row : job_parameters().rows())
        if (groups.contains(row.group)) keys.insert(row.key);
    for (const char* argument : {"input", "output", "camera"}) keys.erase(argument);
    return keys;
}

}  // namespace

const std::set<std::string>& inspect_keys() {
    static const std::set<std::string> keys = keys_of_groups({sequence::kInputGroup});
    return keys;
}

const std::set<std::string>& plan_sequence_keys() {
    static const std::set<std::string> keys =
        keys_of_groups({sequence::kInputGroup, sequence::kLayerGroup, sequence::kPlanGroup});
    return keys;
}

const std::set<std::string>& run_keys() {
    static const std::set<std::string> keys =
        keys_of_groups({sequence::kInputGroup, sequence::kLayerGroup, sequence::kPlanGroup,
                        sequence::kOutputGroup, sequence::kWatchGroup});
    return keys;
}

const std::set<std::string>& plan_keys() {
    static const std::set<std::string> keys = {"precision", "no_elide", "elide"};
    return keys;
}

sequence::RunSettings job_settings(const std::string& function, const std::string& input,
                                   const std::string& output, const py::object& camera,
                                   const py::kwargs& values, const std::set<std::string>& keys) {
    sequence::JobSettings job;
    check_keys(function, values, keys);
    set_rows(job_parameters(), &job, values, function);
    job.input = input;
    job.output = output;
    std::optional<CameraFile> file;
    if (py::isinstance<py::dict>(camera)) {
        if (py::len(camera) > 0) file = camera_of(camera);
    } else if (!camera.is_none())
        job.camera = path_of(camera, function + ": camera");
    Diagnostics notes;
    auto settings = sequence::parse_job(job, builtin_passes(), notes);
    if (!settings.ok()) raise(settings.status(), notes);
    warn(warnings_of(notes));
    if (file) {
        for (const auto& [number, frame] : file->frames)
            for (auto& picture : io::inputs_of(frame.camera))
                settings->other_inputs.push_back(std::move(picture));
        for (auto& picture : io::inputs_of(file->camera))
            settings->other_inputs.push_back(std::move(picture));
        settings->source.camera = std::move(file);
    }
    settings->version = POSTCHAIN_VERSION;
    return std::move(*settings);
}

void check_keys(const std::string& function, const py::kwargs& values,
                const std::set<std::string>& keys) {
    for (const auto& [name, value] : values)
        if (const std::string key = py::str(name); !keys.contains(key))
            raise_unexpected(function, key, {keys.begin(), keys.end()});
}

py::kwargs taken(py::kwargs& values, const std::set<std::string>& keys) {
    py::kwargs found;
    for (const std::string& key : keys)
        if (values.contains(key)) found[key.c_str()] = values.attr("pop")(key);
    return found;
}

}  // namespace postchain::python
