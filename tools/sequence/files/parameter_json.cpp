#include "tools/sequence/files/parameter_json.h"

namespace postchain::io {

Json json_of(const ParameterValue& value) {
    if (const auto* flag = std::get_if<bool>(&value)) return *flag;
    if (const auto* integer = std::get_if<int64_t>(&value)) return *integer;
    if (const auto* number = std::get_if<double>(&value)) return *number;
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    if (const auto* point = std::get_if<std::array<double, 2>>(&value)) return *point;
    return nullptr;
}

std::optional<ParameterValue> value_of(const Json& json) {
    if (json.is_null()) return ParameterValue();
    if (json.is_boolean()) return ParameterValue(json.get<bool>());
    if (json.is_number_unsigned() && json.get<uint64_t>() > uint64_t(INT64_MAX))
        return std::nullopt;
    if (json.is_number_integer()) return ParameterValue(json.get<int64_t>());
    if (json.is_number()) return ParameterValue(json.get<double>());
    if (json.is_string()) return ParameterValue(json.get<std::string>());
    if (json.is_array() && json.size() == 2 && json[0].is_number() && json[1].is_number())
        return ParameterValue(json.get<std::array<double, 2>>());
    return std::nullopt;
}

}  // namespace postchain::io
