#include "tools/apps/common/checks.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <string_view>

#include "chain/base/readable_file.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/settings/color_settings.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;
using io::Json;

struct Schema {
    Json properties = Json::object();
    std::optional<std::vector<std::string>> required;  // none: the subcommand has no --schema
};
Schema& schema_at(const CLI::App& subcommand) {
    static std::map<const CLI::App*, Schema> schemas;
    return schemas[&subcommand];
}

// Groups of rows that are for a person.
constexpr std::string_view kOfTheCommand[] = {sequence::kWatchGroup, "split"};

// How a setting names files: "input" (a pattern, or one for each plane), "pattern", "output" (a
// pattern), "file", "folder", "profile" (a file, or a shipped name). Empty: it does not.
std::string path_of(const Parameter& row) {
    if (row.key == "profile") return row.key;
    if (row.key == "input") return row.key;
    if (row.unit == "IN" || row.unit == "TRUTH") return "pattern";
    if (row.unit == "OUT") return "output";
    if (row.unit == "FILE") return "file";
    return row.unit == "DIR" ? "folder" : "";
}

}  // namespace

std::string key_of(std::string option) {
    option.erase(0, option.find_first_not_of('-'));
    std::ranges::replace(option, '-', '_');
    return option;
}

void add_schema(CLI::App& subcommand, const std::vector<std::string>& required) {
    subcommand.add_flag_callback(
        "--schema", [] {}, "print the JSON Schema of the settings, and do nothing else");
    auto& all = schema_at(subcommand).required.emplace(required);
    for (const CLI::Option* option : subcommand.get_options())
        if (option->get_required() && !option->get_lnames().empty())
            all.push_back(key_of(option->get_lnames().front()));
}

void add_checks(CLI::App& subcommand, Options& options, const std::vector<std::string>& required) {
    subcommand.add_flag("--check", options.check,
                        "print what would be done, or every fault, as JSON, and do nothing else");
    add_schema(subcommand, required);
}

void add_property(const CLI::App& subcommand, const std::string& key, Json schema) {
    schema_at(subcommand).properties[key] = std::move(schema);
}

void add_property(const CLI::App& subcommand, const Parameter& row) {
    if (std::ranges::count(kOfTheCommand, row.group)) return;
    Json schema = io::json_from(row_schema(row));
    if (const std::string path = path_of(row); !path.empty()) schema["x-path"] = path;
    add_property(subcommand, row.key, std::move(schema));
}

std::optional<Json> schema_of(const CLI::App& subcommand) {
    const Schema& schema = schema_at(subcommand);
    if (!schema.required) return std::nullopt;
    return Json{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                {"title", subcommand.get_name()},
                {"type", "object"},
                {"additionalProperties", false},
                {"required", *schema.required},
                {"properties", schema.properties}};
}

bool Checks::take(const std::string& key, const Status& status) {
    if (status.ok()) return true;
    auto [named, text] = split_key(status.message());
    // The parser of the command line names the option itself.
    if (const size_t end = text.find_first_of(": "); text.starts_with("--") && end != text.npos) {
        named = key_of(text.substr(0, end));
        text.erase(0, text.find_first_not_of(": ", end));
    }
    faults_.push_back({{"key", named.empty() ? key : named}, {"message", text}});
    if (exit_code_ == 0) exit_code_ = exit_code(status);
    return false;
}

bool Checks::take(const std::string& key, const Diagnostics& diagnostics) {
    for (const Diagnostic& one : diagnostics) {
        if (one.severity == Severity::warning) warnings_.push_back(one.text());
        if (one.severity != Severity::error) continue;
        faults_.push_back({{"key", as_keys(one.file).starts_with("set ") ? "set" : key},
                           {"message", one.message},
                           {"file", one.file},
                           {"line", one.line},
                           {"column", one.column},
                           {"path", one.path}});
    }
    const Status status = status_of(diagnostics);
    if (!status.ok() && exit_code_ == 0) exit_code_ = exit_code(status);
    return status.ok();
}

std::optional<ChainFile> Checks::chain(const std::string& key, const Options& options) {
    auto file = take(key, read_chain_of(options));
    if (!file || !take(key, file->diagnostics)) return std::nullopt;
    io::ApertureFiles pictures;
    if (!take(key, pictures.read(file->chain.camera).at("camera.aperture_image")))
        return std::nullopt;
    return file;
}

std::optional<sequence::RunSettings> Checks::settings(const Options& options) {
    const size_t before = faults_.size();
    // Each text alone, so that every fault is found. A view has a meaning with its display only.
    for (const Parameter& row : job_parameters().rows()) {
        const ParameterValue value = row.get(&options.job);
        if (row.type != ParameterType::text || value == row.default_value ||
            row.key.starts_with("ocio"))
            continue;
        sequence::JobSettings alone;
        alone.input = "a.exr";
        row.set(&alone, value);
        if (sequence::needs_ocio(alone)) alone.ocio = options.job.ocio;
        Diagnostics notes;
        const Status status = sequence::parse_job(alone, builtin_passes(), notes).status();
        if (has_errors(notes))
            take(row.key, notes);
        else
            take(row.key, status);
    }
    if (faults_.size() > before) return std::nullopt;
    Diagnostics notes;
    auto settings = take("", read_settings(options, notes));
    take("camera", notes);
    return settings;
}

void Checks::reads(const std::string& key, const io::InputSpec& input) {
    const auto refuse = [&](const std::string& path) {
        return take(key, Status(StatusCode::input, concat(path, ": ", reason_of_open(EXDEV))));
    };
    for (const auto& [role, pattern] : input.patterns) {
        if (OpenFolder(pattern.folder()).error() == EXDEV) {
            refuse(pattern.folder());
            return;
        }
        for (const auto& [frame, path] : pattern.discover()) {
            std::error_code error;
            if (!fs::is_symlink(path, error) || ReadableFile(path).error() != EXDEV) continue;
            refuse(path);
            return;
        }
    }
}

void Checks::writes(const std::string& key, const std::string& folder) {
    std::error_code error;
    fs::path existing = whole_path(folder);
    while (!fs::exists(existing, error) && existing.has_relative_path())
        existing = existing.parent_path();
    if (const OpenFolder in(existing.string()); in.error() != 0)
        take(key, Status(StatusCode::output, concat(folder, ": ", reason_of_open(in.error()))));
}

int Checks::print(Json found) const {
    if (ok())
        found["warnings"] = warnings_;
    else
        found = {{"faults", faults_}, {"exit_code", exit_code_}};
    print_line(found);
    return exit_code_;
}

std::string whole_path(const std::string& path) {
    std::error_code error;
    return fs::absolute(path, error).lexically_normal().string();
}

}  // namespace postchain
