#include "tools/python/documentation.h"

#include <pybind11/stl.h>

#include "config/describe.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/temporal.h"
#include "tools/python/errors.h"
#include "tools/python/job.h"
#include "tools/python/lab_calls.h"
#include "tools/python/sequence_calls.h"
#include "tools/python/values.h"
#include "tools/python/write_call.h"
#include "tools/scenes/scene.h"
#include "tools/sequence/files/json.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// "frames: frames to process: 1-10 (RANGE)"
std::string documentation(const Parameter& row) {
    std::string text = row.key + ": " + in_python(row.full_help());
    if (!row.unit.empty()) text += " (" + row.unit + ")";
    if (row.type == ParameterType::choice) text += "; " + row.domain();
    if (row.default_value != ParameterValue()) text += "; default " + text_of(row.default_value);
    return text;
}

}  // namespace

std::string rows_text(const ParameterTable& table, const std::set<std::string>& keys) {
    std::string text;
    for (const Parameter& row : table.rows())
        if (keys.contains(row.key)) text += "\n  " + documentation(row);
    return text;
}

std::string passes_text() {
    std::string text;
    for (const PassType& type : builtin_passes().types()) {
        text += "\n" + type.name + ": " + type.title + ". " + type.help;
        for (const Parameter& row : type.parameters->rows()) text += "\n  " + documentation(row);
    }
    text += "\ncamera:";
    for (const Parameter& row : camera_parameters().rows()) text += "\n  " + documentation(row);
    return text;
}

py::object tables() {
    io::Json json = io::Json::parse(passes_as_json(builtin_passes()));
    for (const Parameter& row : job_parameters().rows())
        json["settings"][row.key] = io::json_from(row_schema(row));
    add_lab_tables(json);
    json["sheet_keys"] = sheet_keys();
    json["write_keys"] = write_keys();
    json["aov_keys"] = aov_keys();
    json["read_keys"] = read_keys();
    json["array_keys"] = array_keys();
    json["file_keys"] = file_keys();
    json["plan_keys"] = plan_keys();
    json["inspect_keys"] = inspect_keys();
    json["plan_sequence_keys"] = plan_sequence_keys();
    json["run_keys"] = run_keys();
    for (const auto* rows : {&metrics::metric_rows(), &metrics::temporal_rows()})
        for (const auto& row : *rows) json["metrics"].push_back(row.name);
    for (const auto& row : metrics::map_rows()) json["maps"].push_back(row.name);
    json["scenes"] = io::Json::array();
    for (const auto& scene : scenes::scenes()) json["scenes"].push_back(scene.name);
    json["depth_encodings"] = depth_encoding_names();
    json["tone_mappers"] = metrics::tone_mapper_names();
    return python_of(json);
}

}  // namespace postchain::python
