#include "chain/base/json.h"

#include <cmath>

#include "chain/base/text.h"

namespace postchain {
namespace {

// `line`: line feed and indentation of the current level; empty = everything on one line.
void append(const JsonValue& json, const std::string& line, std::string& text) {
    const auto list = [&](char open, const auto& items, char close, const auto& append_item) {
        text += open;
        const std::string inner = line.empty() ? "" : line + "  ";
        for (const auto& item : items) {
            text += (&item == &items.front() ? "" : ",") + inner;
            append_item(item, inner);
        }
        if (!items.empty()) text += line;
        text += close;
    };
    if (const auto* array = std::get_if<JsonArray>(&json.value)) {
        list('[', *array, ']',
             [&](const JsonValue& item, const std::string& inner) { append(item, inner, text); });
    } else if (const auto* object = std::get_if<JsonObject>(&json.value)) {
        list('{', *object, '}', [&](const JsonMember& member, const std::string& inner) {
            text += quoted(member.key) + (inner.empty() ? ":" : ": ");
            append(member.value, inner, text);
        });
    } else {
        const auto& scalar = std::get<ParameterValue>(json.value);
        const auto* word = std::get_if<std::string>(&scalar);
        text += word ? quoted(*word) : scalar == ParameterValue() ? "null" : text_of(scalar);
    }
}

}  // namespace

JsonValue::JsonValue() = default;

JsonValue::JsonValue(bool flag) : value(ParameterValue(flag)) {}

JsonValue::JsonValue(double number)
    : value(std::isfinite(number) ? ParameterValue(number) : ParameterValue()) {}

JsonValue::JsonValue(const char* text) : value(ParameterValue(text)) {}

JsonValue::JsonValue(const std::string& text) : value(ParameterValue(text)) {}

JsonValue::JsonValue(const ParameterValue& scalar) : value(scalar) {}

JsonValue::JsonValue(const std::vector<std::string>& texts)
    : value(JsonArray(texts.begin(), texts.end())) {}

JsonValue::JsonValue(JsonArray array) : value(std::move(array)) {}

JsonValue::JsonValue(JsonObject object) : value(std::move(object)) {}

std::string json_text(const JsonValue& value, bool indented) {
    std::string text;
    append(value, indented ? "\n" : "", text);
    return as_keys(text);
}

}  // namespace postchain
