#include "config/schema.h"

#include <cmath>

#include "chain/json_writer.h"
#include "config/chain_file.h"

namespace postchain {
namespace {

std::string description_of(const Parameter& row) {
    std::string text = row.help;
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

}  // namespace

void write_row_schema(JsonWriter& json, const Parameter& row) {
    json.begin_object();
    json.field("description", description_of(row));
    json.key("type");
    if (row.optional)
        json.value(std::vector<std::string>{json_type(row.type), "null"});
    else
        json.value(json_type(row.type));
    if (row.type == ParameterType::choice || !row.allowed.empty()) {
        json.key("enum").begin_array();
        for (const auto& word : row.choices) json.value(word);
        for (int64_t number : row.allowed) json.value(number);
        if (row.optional) json.value(ParameterValue());
        json.end_array();
    }
    if (row.type == ParameterType::point) {
        json.field("minItems", 2).field("maxItems", 2);
        json.key("items").begin_object();
        json.field("type", "number");
    }
    if (std::isfinite(row.min))
        json.key(row.min_excluded ? "exclusiveMinimum" : "minimum").value(ParameterValue(row.min));
    if (std::isfinite(row.max)) json.field("maximum", ParameterValue(row.max));
    if (row.type == ParameterType::point) json.end_object();
    if (row.odd) {
        json.key("not").begin_object();
        json.field("multipleOf", 2);
        json.end_object();
    }
    if (row.default_value != ParameterValue()) json.field("default", row.default_value);
    if (!row.group.empty()) json.field("x-group", row.group);
    json.end_object();
}

namespace {

// Both given, neither null.
void write_exclusion(JsonWriter& json, const Parameter& row, const Parameter& other) {
    json.begin_object();
    json.key("not").begin_object();
    json.field("type", "object");
    json.field("required", std::vector<std::string>{row.key, other.key});
    json.key("properties").begin_object();
    for (const Parameter* one : {&row, &other}) {
        json.key(one->key).begin_object();
        json.field("type", json_type(one->type));
        json.end_object();
    }
    json.end_object();
    json.end_object();
    json.end_object();
}

// The map of a table's values. A pass's map may be left out behind its name (null), and has what
// its link has besides, `of_links`.
void write_table(JsonWriter& json, const ParameterTable& table, const std::string& description,
                 const ParameterTable* of_links) {
    json.begin_object();
    json.field("description", description);
    json.key("type");
    if (of_links)
        json.value(std::vector<std::string>{"object", "null"});
    else
        json.value("object");
    json.field("additionalProperties", false);
    json.key("properties").begin_object();
    for (const ParameterTable* rows : {&table, of_links}) {
        if (rows == nullptr) continue;
        for (const auto& row : rows->rows()) {
            json.key(row.key);
            write_row_schema(json, row);
        }
    }
    json.end_object();
    bool any = false;
    for (const auto& row : table.rows()) {
        const Parameter* other = row.excludes.empty() ? nullptr : table.find(row.excludes);
        if (!other || (other->excludes == row.key && other < &row)) continue;  // said already
        if (!any) json.key("allOf").begin_array();
        any = true;
        write_exclusion(json, row, *other);
    }
    if (any) json.end_array();
    json.end_object();
}

void write_reference(JsonWriter& json, const std::string& name) {
    json.begin_object();
    json.field("$ref", "#/$defs/" + name);
    json.end_object();
}

}  // namespace

std::string chain_schema(const PassRegistry& registry) {
    std::vector<std::string> names;
    for (const auto& type : registry.types()) names.push_back(type.name);

    JsonWriter json(true);
    json.begin_object();
    json.field("$schema", "https://json-schema.org/draft/2020-12/schema");
    json.field("title", "postchain chain file");
    json.field("description",
               "Passes in the order in which they run. The program itself is stricter in one "
               "point: a number with a decimal point (25.0) is no integer.");
    json.field("type", "object");
    json.field("required", std::vector<std::string>{"postchain", "passes"});
    json.field("additionalProperties", false);
    json.key("properties").begin_object();
    json.key("postchain").begin_object();
    json.field("description", "version of the format");
    json.field("const", kChainFileVersion);
    json.end_object();
    json.key("camera");
    write_reference(json, "camera");
    json.key("passes").begin_object();
    json.field("type", "array");
    json.key("items").begin_object();
    json.key("oneOf").begin_array();
    json.begin_object();
    json.field("description", "a pass with default parameters");
    json.field("enum", names);
    json.end_object();
    json.begin_object();
    json.field("type", "object");
    json.field("minProperties", 1);
    json.field("maxProperties", 1);
    json.field("additionalProperties", false);
    json.key("properties").begin_object();
    for (const auto& name : names) {
        json.key(name);
        write_reference(json, "pass." + name);
    }
    json.end_object();
    json.end_object();
    json.end_array();
    json.end_object();
    json.end_object();
    json.end_object();
    json.key("$defs").begin_object();
    json.key("camera");
    write_table(json, camera_parameters(), "the lens, if neither the frames nor --camera state it",
                nullptr);
    for (const auto& type : registry.types()) {
        json.key("pass." + type.name);
        write_table(json, *type.parameters, type.title + ": " + type.help, &link_parameters());
    }
    json.end_object();
    json.end_object();
    return json.text() + "\n";
}

}  // namespace postchain
