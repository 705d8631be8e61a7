#include "tools/apps/common/options.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <map>

#include "config/chain_find.h"
#include "config/scalar.h"
#include "passes/registry.h"
#include "tools/apps/common/checks.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/state.h"
#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/run/device.h"

namespace postchain {
namespace {

namespace fs = std::filesystem;

std::string option_names(const std::string& key) {
    static const std::map<std::string, std::string> letters = {
        {"input", "-i"}, {"output", "-o"}, {"truth", "-r"}};
    const auto letter = letters.find(key);
    return (letter == letters.end() ? "" : letter->second + ",") + option_name(key);
}

}  // namespace

void refuse_empty_words(CLI::App& subcommand) {
    const CLI::Validator not_empty(
        [](const std::string& text) { return std::string(text.empty() ? "is empty" : ""); }, "");
    for (CLI::Option* option : subcommand.get_options())
        if (option->get_items_expected_max() > 0 || option->get_expected_max() > 0)
            option->check(not_empty);
}

CLI::Validator number_within(const CLI::Validator& range) {
    return CLI::Validator(
        [range](std::string& text) {
            // CLI::Range accepts NaN, and 010 as 8.
            const auto value = value_of_plain_text(text);
            if (!value.ok()) return value.status().message();
            if (std::holds_alternative<std::string>(*value))
                return postchain::quoted(text) + " is not a number";
            return range(text);
        },
        range.get_description());
}

void add_logging(CLI::App& subcommand, Options& o) {
    subcommand.add_flag("-v,--verbose", o.verbose, "more messages");
    subcommand.add_flag("-q,--quiet", o.quiet, "errors only");
    subcommand.add_option("--log-format", o.log_format, "form of the messages on stderr")
        ->check(CLI::IsMember({"text", "json"}))
        ->capture_default_str();
}

void add_progress(CLI::App& subcommand, Options& o) {
    CLI::Option* option =
        subcommand
            .add_option(
                "--progress", o.progress,
                "terminal: a line on stderr if it is a terminal; openjd: lines for Open Job "
                "Description on stdout")
            ->check(CLI::IsMember({"terminal", "openjd"}))
            ->capture_default_str();
    // Both would write to stdout.
    option->excludes(subcommand.get_option("--json"));
}

void add_confine(CLI::App& subcommand, Options& o) {
    // No words but these: a word after them may be an argument.
    const auto paths = [&](const char* name, const char* type, std::vector<std::string>& words,
                           const char* help) {
        CLI::Option* option = subcommand.add_option(name, words, help);
        return option->type_name(type)->expected(1)->take_all()->allow_extra_args(false);
    };
    CLI::Option* folders = paths("--confine-to", "DIR", o.confine_to,
                                 "open no files but those in this folder and the system's, and no "
                                 "network; may be repeated");
    paths("--also-read", "PATH", o.also_read,
          "with --confine-to: read this file, or those in this folder, too; may be repeated")
        ->needs(folders);
}

void add_chain_file(CLI::App& subcommand, const std::string& word, const std::string& key,
                    std::string& chain) {
    const char* help = "chain file, or the name of a shipped chain";
    subcommand.add_option(word, chain, help)->required();
    add_property(subcommand, key,
                 {{"description", help}, {"type", "string"}, {"x-path", "profile"}});
}

void add_chain(CLI::App& subcommand, Options& o) {
    add_chain_file(subcommand, "CHAIN", "chain", o.chain);
    add_list(subcommand, "--set", "KEY=VALUE", o.sets,
             "change a value: passes[0].samples=51, motion_blur.samples=51, camera.f_stop=2");
    add_relative_to(subcommand, o);
}

void add_relative_to(CLI::App& subcommand, Options& o) {
    subcommand
        .add_option("--relative-to", o.relative_to,
                    "folder at which paths in the file of a chain or study start (default: the "
                    "file's)")
        ->type_name("DIR");
}

const ParameterTable& job_parameters() {
    static const ParameterTable table = sequence::job_parameters(builtin_passes());
    return table;
}

void add_setting(CLI::App& subcommand, const Parameter& row, ParameterRef settings) {
    add_property(subcommand, row);
    const std::string name = option_names(row.key);
    const std::string help = as_options(row.help);
    // The row outlives the subcommand, like its table.
    const auto set = [&row, settings](const ParameterValue& value) { row.set(settings, value); };
    CLI::Option* option = nullptr;
    switch (row.type) {
        case ParameterType::boolean:
            if (row.default_value == ParameterValue(true))
                subcommand.add_flag_callback(
                    "--no-" + name.substr(2), [set] { set(false); }, "do not " + help);
            else
                subcommand.add_flag_callback(
                    name, [set] { set(true); }, help);
            return;
        case ParameterType::integer:
            option = subcommand.add_option_function<int>(
                name, [set](int value) { set(int64_t(value)); }, help);
            option->check(number_within(CLI::Range(int(row.min), int(row.max))));
            break;
        case ParameterType::number:
            option = subcommand.add_option_function<double>(
                name, [set](double value) { set(value); }, help);
            option->check(number_within(CLI::Range(row.min, row.max)));
            break;
        case ParameterType::point:
            option = subcommand.add_option_function<std::array<double, 2>>(
                name, [set](const std::array<double, 2>& point) { set(point); }, help);
            option->check(number_within(CLI::Range(row.min, row.max)));
            break;
        case ParameterType::choice:
            option = subcommand.add_option_function<std::string>(
                name, [set](const std::string& word) { set(word); }, help);
            option->check(CLI::IsMember(row.choices));
            break;
        case ParameterType::text:
            if (row.implied.empty())
                option = subcommand.add_option_function<std::string>(
                    name, [set](const std::string& word) { set(word); }, help);
            else  // a flag: takes a value only after '=', because the next word may be an argument
                option = subcommand.add_flag(name + "{" + row.implied + "}", help)
                             ->each([set](const std::string& word) { set(word); });
            option->required(!row.optional);
            if (row.implied.empty()) option->type_name(row.unit);
            break;
    }
    if (row.default_value != ParameterValue()) option->default_str(text_of(row.default_value));
}

void add_settings(CLI::App& subcommand, const ParameterTable& table, const std::string& group,
                  ParameterRef settings) {
    for (const Parameter& row : table.rows())
        if (row.group == group) add_setting(subcommand, row, settings);
}

void add_on_existing(CLI::App& subcommand, const std::string& help, io::OnExisting& on_existing) {
    static const std::map<std::string, io::OnExisting> kWords = {
        {"fail", io::OnExisting::fail}, {"overwrite", io::OnExisting::overwrite}};
    subcommand
        .add_option_function<std::string>(
            "--on-existing",
            [&on_existing](const std::string& word) { on_existing = kWords.at(word); }, help)
        ->check(CLI::IsMember({"fail", "overwrite"}))
        ->default_str("fail");
}

void add_list(CLI::App& subcommand, const std::string& name, const std::string& type,
              std::vector<std::string>& words, const std::string& help) {
    add_property(
        subcommand, key_of(name),
        {{"description", type + ": " + help}, {"type", "array"}, {"items", {{"type", "string"}}}});
    subcommand.add_option(name, words, help)->type_name(type)->expected(1)->take_all();
}

void add_displayed(CLI::App& subcommand, Options& o) {
    for (const char* key :
         {"frames", "profile", "view_layer", "view", "max_memory", "input_transfer", "ocio",
          "ocio_display", "ocio_view", "ocio_colorspace"})
        add_setting(subcommand, *job_parameters().find(key), &o.job);
    add_threads(subcommand, o);
}

Result<std::array<int, 2>> parse_size(const std::string& text) {
    std::array<int, 2> size = {0, 0};
    const char* end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size[0]);
    if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
        const auto height = std::from_chars(width.ptr + 1, end, size[1]);
        if (height.ec == std::errc() && height.ptr == end && size[0] > 0 && size[1] > 0 &&
            size[0] <= io::kMaxSide && size[1] <= io::kMaxSide)
            return size;
    }
    return Status(
        StatusCode::usage,
        concat("--size: '", text, "' is not WIDTHxHEIGHT with sides of 1..", io::kMaxSide));
}

void add_threads(CLI::App& subcommand, Options& o) {
    subcommand.add_option("--threads", o.threads, "CPU threads (default: all cores)")
        ->check(number_within(CLI::Range(1, 1024)));
}

void add_device(CLI::App& subcommand, Options& o) {
    subcommand
        .add_option("--device", o.device,
                    "GL device: auto, gpu (or fail), software, or a number listed by `postchain "
                    "info`")
        ->type_name("N|gpu|software")
        ->capture_default_str();
    add_threads(subcommand, o);
}

Result<ChainText> find_chain_of(const Options& options) {
    auto chain = find_chain(options.chain);
    if (chain.ok() && !options.relative_to.empty() && !chain->shipped)
        chain->file_name =
            (fs::path(options.relative_to) / fs::path(chain->file_name).filename()).string();
    return chain;
}

Result<ChainFile> read_chain_of(const Options& options) {
    ChainText text{"the record of " + options.like, options.recorded_chain};
    if (options.recorded_chain.empty()) {
        ASSIGN_OR_RETURN(text, find_chain_of(options));
    }
    return parse_chain(text, builtin_passes(), options.sets);
}

Result<ChainFile> load_chain_of(const Options& options) {
    ASSIGN_OR_RETURN(ChainFile file, read_chain_of(options));
    RETURN_IF_ERROR(log::write(file.diagnostics, log::Level::info));
    io::ApertureFiles pictures;
    RETURN_IF_ERROR(pictures.read(file.chain.camera).at("camera.aperture_image"));
    return file;
}

Result<sequence::RunSettings> read_settings(const Options& options, Diagnostics& notes) {
    auto settings = sequence::parse_job(options.job, builtin_passes(), notes);
    if (settings.ok()) settings->version = kVersion;
    if (settings.ok() && !options.recorded_camera.empty())
        settings->source.camera =
            parse_camera(options.recorded_camera, "the record of " + options.like);
    return settings;
}

Result<sequence::RunSettings> run_settings_of(const Options& options) {
    Diagnostics notes;
    auto settings = read_settings(options, notes);
    RETURN_IF_ERROR(log::write(notes, log::Level::detail));
    return settings;
}

Result<egl::ContextOptions> choose_device(const Options& options) {
    const auto warn = [](const std::string& text) {
        first_today("computing_on_the_cpu") ? log::warning(text) : log::detail(text);
    };
    auto context = sequence::choose_device(options.device, options.threads, warn);
    if (!context.ok()) return context;
    context->debug = options.verbose;
    context->log = [](const std::string& text) { log::detail(text); };
    return context;
}

Result<std::unique_ptr<egl::Context>> context_of(const Options& options) {
    ASSIGN_OR_RETURN(auto context, choose_device(options));
    return egl::Context::create(context);
}

}  // namespace postchain
