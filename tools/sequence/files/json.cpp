#include "tools/sequence/files/json.h"

#include <charconv>
#include <cmath>
#include <cstdio>

#include "config/scalar.h"

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
    return as_keys(out);
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

void append(Json& object, const std::string& key, Json value) {
    // The object's own functions look the key up first.
    static_cast<Json::object_t::Container&>(object.get_ref<Json::object_t&>())
        .emplace_back(key, std::move(value));
}

Json json_of(const TextNode& node) {
    if (node.is_map()) {
        Json object = Json::object();
        for (const TextEntry& entry : node.entries)
            append(object, entry.key.text, json_of(entry.value));
        return object;
    }
    if (node.is_list()) {
        Json list = Json::array();
        for (const TextNode& item : node.items) list.push_back(json_of(item));
        return list;
    }
    const auto value = value_of(node);
    if (!value.ok()) return node.text;
    const auto* integer = std::get_if<int64_t>(&*value);
    if (integer && *integer >= 0) return uint64_t(*integer);
    // Above 2^63 a number is exact as an unsigned one alone.
    uint64_t large = 0;
    const char* end = node.text.data() + node.text.size();
    const auto read = std::from_chars(node.text.data(), end, large);
    const bool whole = read.ec == std::errc() && read.ptr == end;
    if (whole && std::holds_alternative<double>(*value)) return large;
    return json_of(*value);
}

Result<Json> read_json(std::string_view text, const std::string& file_name,
                       const TextLimits& limits) {
    const TextTree tree = read_json_tree(text, file_name, StatusCode::input, limits);
    RETURN_IF_ERROR(status_of(tree.diagnostics));
    return json_of(tree.root);
}

Json json_from(const JsonValue& value) {
    if (const auto* array = std::get_if<JsonArray>(&value.value)) {
        Json json = Json::array();
        for (const JsonValue& item : *array) json.push_back(json_from(item));
        return json;
    }
    if (const auto* object = std::get_if<JsonObject>(&value.value)) {
        Json json = Json::object();
        for (const JsonMember& member : *object) append(json, member.key, json_from(member.value));
        return json;
    }
    const auto& scalar = std::get<ParameterValue>(value.value);
    if (const auto* number = std::get_if<double>(&scalar)) return number_from(*number);
    if (const auto* point = std::get_if<std::array<double, 2>>(&scalar))
        return {number_from((*point)[0]), number_from((*point)[1])};
    return json_of(scalar);
}

}  // namespace postchain::io
