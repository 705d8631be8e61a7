// Jobs, frames, events and diagnostics as JSON. JSON and schema are made from one table per type.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/diagnostic.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job.h"

namespace postchain::service {

template <class T>
struct Field {
    std::string name;
    io::Json schema;  // JSON Schema of the value, with its description
    std::function<io::Json(const T&)> value;
};

const std::vector<Field<Diagnostic>>& diagnostic_fields();
const std::vector<Field<Job>>& listed_job_fields();         // in lists
const std::vector<Field<Job>>& job_fields();                // the same with the request
const std::vector<Field<JobFrame>>& frame_fields();         // in lists
const std::vector<Field<JobFrame>>& frame_detail_fields();  // the same with the sidecar

template <class T>
io::Json json_of(const T& item, const std::vector<Field<T>>& fields) {
    io::Json json = io::Json::object();
    for (const auto& field : fields) json[field.name] = field.value(item);
    return json;
}
template <class T>
io::Json schema_of(const std::vector<Field<T>>& fields) {
    io::Json properties = io::Json::object(), required = io::Json::array();
    for (const auto& field : fields) {
        properties[field.name] = field.schema;
        required.push_back(field.name);
    }
    return {{"type", "object"}, {"properties", properties}, {"required", required}};
}

// Diagnostics as an array.
io::Json json_of(const Diagnostics& diagnostics);

// A server-sent event:
//   id: 12
//   data: {"type": "frame", "job": ID, "time": "...", "data": {...}}
std::string text_of(const Event& event);

// "2026-01-31T12:00:00.000Z"; null for 0.
io::Json time_of(int64_t ms);

}  // namespace postchain::service
