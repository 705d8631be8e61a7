// report.json of a report: docs/report.md lists its keys, which are a contract. Parts of it are
// also kept in DIR/results and read when bench continues.
#pragma once

#include <cmath>
#include <optional>

#include "tools/measure/report/report.h"
#include "tools/sequence/files/json.h"

// No value is null, as are NaN and Inf.
template <class T>
struct nlohmann::adl_serializer<std::optional<T>> {
    template <class J>
    static void to_json(J& json, const std::optional<T>& value) {
        bool none = !value;
        if constexpr (std::is_floating_point_v<T>) none = none || !std::isfinite(*value);
        if (none)
            json = nullptr;
        else
            json = *value;
    }
    template <class J>
    static void from_json(const J& json, std::optional<T>& value) {
        value = json.is_null() ? std::nullopt : std::optional<T>(json.template get<T>());
    }
};

namespace postchain::report {

using io::Json;

Json report_json(const Report& report);

// For nlohmann-json, which throws if JSON has another form.
void to_json(Json& json, const Interval& interval);
void to_json(Json& json, const Timing& timing);
void to_json(Json& json, const ErrorSplit& split);
void from_json(const Json& json, Timing& timing);
void from_json(const Json& json, ErrorSplit& split);

// As elision_json(), without the keys of the work list, which belong to one frame's plan.
Json json_of(const Elision& elision, const std::string& what = {});
Elision elision_from(const Json& json);  // throws as from_json()

}  // namespace postchain::report
