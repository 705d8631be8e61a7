#include "config/schema.h"

#include <charconv>
#include <cmath>
#include <map>

#include "config/chain_file.h"

namespace postchain {
namespace {

std::string description_of(const Parameter& row) {
    std::string text = row.full_help();
    if (!row.unit.empty()) text += " (" + row.unit + ")";
    text += text.empty() ? row.domain() : "; " + row.domain();
    if (!row.unset_means.empty()) text += "; when left out: " + row.unset_means;
    return text;
}

const char* json_type(ParameterType type) {
    if (type == ParameterType::point) return "array";
    const bool text = type == ParameterType::choice || type == ParameterType::text;
    return text ? "string" : name_of(type);
}

// A schema that refuses both keys given at once, unless one is null.
JsonObject exclusion(const Parameter& row, const Parameter& other) {
    JsonObject properties;
    for (const Parameter* one : {&row, &other})
        properties.push_back({one->key, JsonObject{{"type", json_type(one->type)}}});
    return {{"not", JsonObject{{"type", "object"},
                               {"required", std::vector<std::string>{row.key, other.key}},
                               {"properties", properties}}}};
}

JsonValue json_value(const Parameter& row, const std::string& text) {
    if (text == text_of(ParameterValue())) return {};
    if (row.type == ParameterType::boolean) return text == "true";
    if (row.type == ParameterType::choice || row.type == ParameterType::text) return text;
    double number = 0;
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
}

// A schema that accepts a map in which the condition holds, also by the row's default.
JsonObject condition(const ParameterTable& table, const RowValue& value) {
    const Parameter& row = *table.find(value.key);
    JsonArray words;
    bool by_default = value.none_of;
    for (const auto& text : value.values) {
        words.push_back(json_value(row, text));
        if (text == text_of(row.default_value)) by_default = !value.none_of;
    }
    const JsonObject among = {{"enum", words}};
    JsonObject json = {
        {"properties", JsonObject{{row.key, value.none_of ? JsonObject{{"not", among}} : among}}}};
    if (!by_default) json.push_back({"required", std::vector<std::string>{row.key}});
    return json;
}

// A schema that refuses these keys, unless they are null, if no alternative of read_if holds.
JsonObject effect(const ParameterTable& table, const ReadIf& read_if,
                  const std::vector<std::string>& keys) {
    JsonArray alternatives;
    for (const auto& all : read_if) {
        JsonArray conditions;
        for (const RowValue& value : all) conditions.push_back(condition(table, value));
        alternatives.push_back(conditions.size() == 1 ? conditions[0]
                                                      : JsonObject{{"allOf", conditions}});
    }
    JsonObject none;
    for (const auto& key : keys) none.push_back({key, JsonObject{{"type", "null"}}});
    alternatives.push_back(JsonObject{{"properties", none}});
    return {{"anyOf", alternatives}};
}

// The map of a table's values. A pass may leave its map out (null); it also takes the rows of
// `link`.
JsonObject table_schema(const ParameterTable& table, const std::string& description,
                        const ParameterTable* link) {
    JsonObject properties;
    for (const ParameterTable* rows : {&table, link})
        if (rows)
            for (const auto& row : rows->rows()) properties.push_back({row.key, row_schema(row)});
    JsonArray exclusions;
    for (const auto& row : table.rows()) {
        const Parameter* other = row.excludes.empty() ? nullptr : table.find(row.excludes);
        // A pair that excludes each other is written once.
        if (other && (other->excludes != row.key || other > &row))
            exclusions.push_back(exclusion(row, *other));
    }
    std::map<std::string, std::vector<std::string>> keys;  // by the text of their condition
    for (const auto& row : table.rows()) keys[text_of(row.read_if)].push_back(row.key);
    for (const auto& row : table.rows())
        if (const auto& same = keys[text_of(row.read_if)];
            !row.read_if.empty() && row.key == same.front())
            exclusions.push_back(effect(table, row.read_if, same));
    JsonObject json = {
        {"description", description},
        {"type", link ? JsonValue(std::vector<std::string>{"object", "null"}) : "object"},
        {"additionalProperties", false},
        {"properties", properties}};
    if (!exclusions.empty()) json.push_back({"allOf", exclusions});
    return json;
}

JsonObject reference(const std::string& name) {
    return {{"$ref", "#/$defs/" + name}};
}

}  // namespace

JsonObject row_schema(const Parameter& row) {
    JsonObject json = {{"description", description_of(row)}};
    const JsonValue type = json_type(row.type);
    json.push_back({"type", row.optional ? JsonArray{type, "null"} : type});
    if (row.type == ParameterType::choice || !row.allowed.empty()) {
        JsonArray words(row.choices.begin(), row.choices.end());
        words.insert(words.end(), row.allowed.begin(), row.allowed.end());
        if (row.optional) words.push_back({});
        json.push_back({"enum", words});
    }
    JsonObject range;
    if (std::isfinite(row.min))
        range.push_back({row.min_excluded ? "exclusiveMinimum" : "minimum", row.min});
    if (std::isfinite(row.max)) range.push_back({"maximum", row.max});
    if (row.type == ParameterType::point) {
        range.insert(range.begin(), {"type", "number"});
        json.insert(json.end(), {{"minItems", 2}, {"maxItems", 2}, {"items", range}});
    } else {
        json.insert(json.end(), range.begin(), range.end());
    }
    if (row.odd) json.push_back({"not", JsonObject{{"multipleOf", 2}}});
    if (row.default_value != ParameterValue()) json.push_back({"default", row.default_value});
    if (!row.group.empty()) json.push_back({"x-group", row.group});
    return json;
}

std::string chain_schema(const PassRegistry& registry) {
    std::vector<std::string> names;
    JsonObject references;
    JsonObject definitions = {
        {"camera", table_schema(camera_parameters(),
                                "the lens, unless frames or a camera file state it", nullptr)}};
    for (const auto& type : registry.types()) {
        names.push_back(type.name);
        references.push_back({type.name, reference("pass." + type.name)});
        definitions.push_back(
            {"pass." + type.name,
             table_schema(*type.parameters, type.title + ": " + type.help, &link_parameters())});
    }
    const JsonObject bare = {{"description", "a pass with default parameters"}, {"enum", names}};
    const JsonObject with_parameters = {{"type", "object"},
                                        {"minProperties", 1},
                                        {"maxProperties", 1},
                                        {"additionalProperties", false},
                                        {"properties", references}};
    const JsonObject passes = {{"type", "array"},
                               {"maxItems", kMaxPasses},
                               {"items", JsonObject{{"oneOf", JsonArray{bare, with_parameters}}}}};
    const JsonObject version = {{"description", "version of the format"},
                                {"const", kChainFileVersion}};
    const JsonObject schema = {
        {"$schema", "https://json-schema.org/draft/2020-12/schema"},
        {"title", "postchain chain file"},
        {"description",
         "Passes in the order in which they run. The program itself is stricter in one point: a "
         "number with a decimal point (25.0) is no integer."},
        {"type", "object"},
        {"required", std::vector<std::string>{"postchain", "passes"}},
        {"additionalProperties", false},
        {"properties",
         JsonObject{{"postchain", version}, {"camera", reference("camera")}, {"passes", passes}}},
        {"$defs", definitions}};
    return json_text(schema, true) + "\n";
}

}  // namespace postchain
