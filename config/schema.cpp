#include "config/schema.h"

#include <cmath>

#include "config/chain_file.h"
#include "config/json_writer.h"

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
    return type == ParameterType::choice ? "string" : name_of(type);
}

void write_row(JsonWriter& json, const Parameter& row) {
    json.begin_object();
    json.key("description").value(ParameterValue(description_of(row)));
    json.key("type");
    if (row.optional)
        json.value(std::vector<std::string>{json_type(row.type), "null"});
    else
        json.value(json_type(row.type));
    if (row.type == ParameterType::choice || !row.allowed.empty()) {
        json.key("enum").begin_array();
        for (const auto& word : row.choices) json.value(ParameterValue(word));
        for (int64_t number : row.allowed) json.value(ParameterValue(number));
        if (row.optional) json.value(ParameterValue());
        json.end_array();
    }
    if (std::isfinite(row.min))
        json.key(row.min_excluded ? "exclusiveMinimum" : "minimum").value(ParameterValue(row.min));
    if (std::isfinite(row.max)) json.key("maximum").value(ParameterValue(row.max));
    if (row.odd) {
        json.key("not").begin_object();
        json.key("multipleOf").value(ParameterValue(int64_t(2)));
        json.end_object();
    }
    if (row.default_value != ParameterValue()) json.key("default").value(row.default_value);
    json.end_object();
}

// Both given, neither null.
void write_exclusion(JsonWriter& json, const Parameter& row, const Parameter& other) {
    json.begin_object();
    json.key("not").begin_object();
    json.key("type").value("object");
    json.key("required").value(std::vector<std::string>{row.key, other.key});
    json.key("properties").begin_object();
    for (const Parameter* one : {&row, &other}) {
        json.key(one->key).begin_object();
        json.key("type").value(json_type(one->type));
        json.end_object();
    }
    json.end_object();
    json.end_object();
    json.end_object();
}

// The map of a table's values. A pass's map may be left out behind its name (null).
void write_table(JsonWriter& json, const ParameterTable& table, const std::string& description,
                 bool nullable) {
    json.begin_object();
    json.key("description").value(ParameterValue(description));
    json.key("type");
    if (nullable)
        json.value(std::vector<std::string>{"object", "null"});
    else
        json.value("object");
    json.key("additionalProperties").value(ParameterValue(false));
    json.key("properties").begin_object();
    for (const auto& row : table.rows()) {
        json.key(row.key);
        write_row(json, row);
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
    json.key("$ref").value(ParameterValue("#/$defs/" + name));
    json.end_object();
}

}  // namespace

std::string chain_schema(const PassRegistry& registry) {
    std::vector<std::string> names;
    for (const auto& type : registry.types()) names.push_back(type.name);

    JsonWriter json(true);
    json.begin_object();
    json.key("$schema").value("https://json-schema.org/draft/2020-12/schema");
    json.key("title").value("postchain chain file");
    json.key("description")
        .value(
            "Passes in the order in which they run. The program itself is stricter in one "
            "point: a number with a decimal point (25.0) is no integer.");
    json.key("type").value("object");
    json.key("required").value(std::vector<std::string>{"postchain", "passes"});
    json.key("additionalProperties").value(ParameterValue(false));
    json.key("properties").begin_object();
    json.key("postchain").begin_object();
    json.key("description").value("version of the format");
    json.key("const").value(ParameterValue(int64_t(kChainFileVersion)));
    json.end_object();
    json.key("camera");
    write_reference(json, "camera");
    json.key("passes").begin_object();
    json.key("type").value("array");
    json.key("items").begin_object();
    json.key("oneOf").begin_array();
    json.begin_object();
    json.key("description").value("a pass with default parameters");
    json.key("enum").value(names);
    json.end_object();
    json.begin_object();
    json.key("type").value("object");
    json.key("minProperties").value(ParameterValue(int64_t(1)));
    json.key("maxProperties").value(ParameterValue(int64_t(1)));
    json.key("additionalProperties").value(ParameterValue(false));
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
                false);
    for (const auto& type : registry.types()) {
        json.key("pass." + type.name);
        write_table(json, *type.parameters, type.title + ": " + type.help, true);
    }
    json.end_object();
    json.end_object();
    return json.text() + "\n";
}

}  // namespace postchain
