#include "config/describe.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "chain/base/json.h"
#include "config/chain_file.h"
#include "config/markdown.h"

namespace postchain {
namespace {

std::string default_of(const Parameter& row) {
    if (row.default_value != ParameterValue()) return text_of(row.default_value);
    return row.unset_means.empty() ? "unset" : "unset: " + row.unset_means;
}

std::string state_of(const ElisionRule& rule) {
    return rule.on_by_default ? "on" : "only when asked for";
}

void add_table_text(std::string& text, const ParameterTable& table) {
    size_t width = 0;
    for (const auto& row : table.rows()) width = std::max(width, row.key.size());
    for (const auto& row : table.rows()) {
        text += "  " + row.key + std::string(width - row.key.size() + 2, ' ') + row.domain();
        if (!row.unit.empty()) text += " (" + row.unit + ")";
        text += "; default " + default_of(row) + "\n";
        if (!row.help.empty()) text += std::string(width + 4, ' ') + row.full_help() + "\n";
        if (!row.excludes.empty())
            text += std::string(width + 4, ' ') + "not together with " + row.excludes + "\n";
    }
}

JsonArray table_json(const ParameterTable& table) {
    JsonArray rows;
    for (const auto& row : table.rows()) {
        JsonObject json = {
            {"key", row.key},         {"type", name_of(row.type)}, {"default", row.default_value},
            {"domain", row.domain()}, {"unit", row.unit},          {"help", row.help}};
        if (std::isfinite(row.min)) json.push_back({"min", row.min});
        if (row.min_excluded) json.push_back({"min_excluded", true});
        if (std::isfinite(row.max)) json.push_back({"max", row.max});
        if (row.odd) json.push_back({"odd", true});
        if (!row.choices.empty()) json.push_back({"choices", row.choices});
        if (!row.allowed.empty())
            json.push_back({"allowed", JsonArray(row.allowed.begin(), row.allowed.end())});
        json.push_back({"optional", row.optional});
        if (!row.unset_means.empty()) json.push_back({"unset_means", row.unset_means});
        if (!row.excludes.empty()) json.push_back({"excludes", row.excludes});
        if (!row.read_if.empty()) json.push_back({"read_if", text_of(row.read_if)});
        rows.push_back(std::move(json));
    }
    return rows;
}

void add_rules_text(std::string& text, const std::vector<ElisionRule>& rules) {
    for (const auto& rule : rules)
        text += "  " + rule.name + " (" + state_of(rule) + ") leaves out " + rule.help + "\n";
}

JsonArray rules_json(const std::vector<ElisionRule>& rules) {
    JsonArray array;
    for (const auto& rule : rules)
        array.push_back(JsonObject{
            {"name", rule.name}, {"on_by_default", rule.on_by_default}, {"help", rule.help}});
    return array;
}

// The values and their unit: "0..10 frames".
std::string value_cell(const Parameter& row) {
    std::string value = row.domain();
    for (const std::string lead : {"a number in ", "a number ", "one of ", "an ", "a "})
        if (value.starts_with(lead)) value.erase(0, lead.size());
    return markdown_cell(row.unit.empty() ? value : value + " " + row.unit);
}

// Row of a table -> name of the pass that shows it.
using ShownRows = std::map<std::string, std::string>;

// A row that another pass shows in the same words is only named, below the table.
void add_table_markdown(std::string& text, const ParameterTable& table,
                        const std::string& pass = {}, ShownRows* shown = nullptr) {
    std::map<std::string, std::string> keys_of;  // by that pass
    text += "| parameter | value | default | effect |\n|---|---|---|---|\n";
    for (const auto& row : table.rows()) {
        std::string help = row.full_help();
        if (!row.excludes.empty()) help += " (not together with `" + row.excludes + "`)";
        const std::string line = "| `" + row.key + "` | " + value_cell(row) + " | " +
                                 markdown_cell(default_of(row)) + " | " + markdown_cell(help) +
                                 " |\n";
        const std::string& owner = shown ? shown->emplace(line, pass).first->second : pass;
        if (owner == pass)
            text += line;
        else
            keys_of[owner] += (keys_of[owner].empty() ? "`" : ", `") + row.key + "`";
    }
    for (const auto& [other, keys] : keys_of) text += "\nAs in `" + other + "`: " + keys + ".\n";
}

void add_rules_markdown(std::string& text, const std::vector<ElisionRule>& rules) {
    text += "| rule | used | leaves out |\n|---|---|---|\n";
    for (const auto& rule : rules)
        text +=
            "| `" + rule.name + "` | " + state_of(rule) + " | " + markdown_cell(rule.help) + " |\n";
}

JsonObject pass_json(const PassType& type) {
    return {{"name", type.name},
            {"title", type.title},
            {"help", type.help},
            {"parameters", table_json(*type.parameters)},
            {"rules", rules_json(type.rules)}};
}

std::string pass_markdown(const PassType& type, ShownRows* shown) {
    std::string text = "### " + type.title + " (`" + type.name + "`)\n\n" + type.help + "\n\n";
    add_table_markdown(text, *type.parameters, type.name, shown);
    if (type.rules.empty()) return text;
    text += "\n";
    add_rules_markdown(text, type.rules);
    return text;
}

}  // namespace

std::string pass_as_text(const PassType& type) {
    std::string text = type.name + ": " + type.title + ". " + type.help + "\n";
    add_table_text(text, *type.parameters);
    add_rules_text(text, type.rules);
    return text;
}

std::string pass_as_json(const PassType& type) {
    return json_text(pass_json(type));
}

std::string pass_as_markdown(const PassType& type) {
    return pass_markdown(type, nullptr);
}

std::string passes_as_text(const PassRegistry& registry) {
    std::string text;
    for (const auto& type : registry.types()) text += pass_as_text(type) + "\n";
    text += "every pass also takes\n";
    add_table_text(text, link_parameters());
    text += "\ncamera: the lens, if neither the frames nor {camera} state it\n"_keyed;
    add_table_text(text, camera_parameters());
    text += "\nrules of every pass and plane ({no_elide}, {elide})\n"_keyed;
    add_rules_text(text, chain_rules());
    return text;
}

std::string passes_as_json(const PassRegistry& registry) {
    JsonArray passes;
    for (const auto& type : registry.types()) passes.push_back(pass_json(type));
    return json_text(JsonObject{{"passes", passes},
                                {"every_pass", table_json(link_parameters())},
                                {"camera", table_json(camera_parameters())},
                                {"rules", rules_json(chain_rules())}});
}

std::string passes_as_markdown(const PassRegistry& registry) {
    std::string text;
    ShownRows shown;
    for (const auto& type : registry.types()) text += pass_markdown(type, &shown) + "\n";
    text += "### Every pass\n\nBesides its own parameters, see [mattes](layers.md#mattes).\n\n";
    add_table_markdown(text, link_parameters());
    text +=
        "\n### Camera (`camera`)\n\nThe lens, if neither the frames nor `{camera}` state it.\n\n"_keyed;
    add_table_markdown(text, camera_parameters());
    text +=
        "\n### Rules of every pass and plane\n\nFor `{no_elide}` and `{elide}`, as those of the "
        "passes.\n\n"_keyed;
    add_rules_markdown(text, chain_rules());
    return text;
}

}  // namespace postchain
