#include "tools/sequence/files/json.h"

#include <cmath>
#include <cstdio>

namespace postchain::io {
namespace {

Json number_from(double number) {
    const bool whole = text_of(ParameterValue(number)).find_first_of(".e") == std::string::npos;
    return whole && std::abs(number) < 0x1p63 ? Json(int64_t(number)) : Json(number);
}

}  // namespace

std::string json_text(const Json& json, int indent) {
    const std::string text = json.dump(indent, ' ', false, Json::error_handler_t::replace);
    std::string out;
    out.reserve(text.size());
    for (size_t at = 0; at < text.size();) {
        const CodePoint c = code_point(text, at);
        // Line feeds between values come from the indent.
        if (c.value != '\n' && acts_on_a_terminal(c.value)) {
            char escaped[8];
            std::snprintf(escaped, sizeof(escaped), "\\u%04x", unsigned(c.value));
            out += escaped;
        } else {
            out += text.substr(at, c.bytes);
        }
        at += c.bytes;  // dump() returns valid UTF-8
    }
    return out;
}

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

Json json_from(const JsonValue& value) {
    if (const auto* array = std::get_if<JsonArray>(&value.value)) {
        Json json = Json::array();
        for (const JsonValue& item : *array) json.push_back(json_from(item));
        return json;
    }
    if (const auto* object = std::get_if<JsonObject>(&value.value)) {
        Json json = Json::object();
        for (const JsonMember& member : *object) json[member.key] = json_from(member.value);
        return json;
    }
    const auto& scalar = std::get<ParameterValue>(value.value);
    if (const auto* number = std::get_if<double>(&scalar)) return number_from(*number);
    if (const auto* point = std::get_if<std::array<double, 2>>(&scalar))
        return {number_from((*point)[0]), number_from((*point)[1])};
    return json_of(scalar);
}

}  // namespace postchain::io
