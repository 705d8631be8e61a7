// postchain info, schema, passes: print the device, and parameters.
#include "tools/apps/postchain/subcommands.h"

#include <OpenEXR/OpenEXRConfig.h>
#include <spdlog/version.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "config/describe.h"
#include "config/reporter.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/apps/common/log.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/image_file.h"

namespace postchain {
namespace {

Result<int> info_subcommand(const Options& options) {
    io::Json info;
    info["postchain"] = kVersion;
    info["libraries"] = {
        {"OpenEXR", OPENEXR_VERSION_STRING},
        {"CLI11", CLI11_VERSION},
        {"spdlog", concat(SPDLOG_VER_MAJOR, ".", SPDLOG_VER_MINOR, ".", SPDLOG_VER_PATCH)},
        {"nlohmann-json", concat(NLOHMANN_JSON_VERSION_MAJOR, ".", NLOHMANN_JSON_VERSION_MINOR, ".",
                                 NLOHMANN_JSON_VERSION_PATCH)}};
    const auto pictures = io::image_module(StatusCode::input);
    if (pictures.ok())
        info["libraries"]["OpenImageIO"] = (*pictures)->open_image_io;
    else
        log::warning(pictures.status().message());
    info["devices"] = io::Json::array();
    for (const auto& device : egl::list_devices())
        info["devices"].push_back(
            {{"device", device.index}, {"name", device.name}, {"software", device.software}});
    auto context = context_of(options);
    if (context.ok()) {
        const gl::Device& device = (*context)->device();
        const gl::Limits& limits = device.limits;
        info["gl"] = {{"vendor", device.vendor},
                      {"renderer", device.renderer},
                      {"version", device.version},
                      {"software", device.software},
                      {"limits",
                       {{"texture_px", limits.texture_px},
                        {"storage_block_bytes", limits.storage_block_bytes},
                        {"shared_memory_bytes", limits.shared_memory_bytes},
                        {"group_invocations", limits.group_invocations},
                        {"groups", limits.groups},
                        {"texture_units", limits.texture_units},
                        {"image_units", limits.image_units}}}};
    }
    if (options.json) {
        print_line(info);
    } else {
        std::printf("postchain %s\n", kVersion);
        for (const auto& [name, version] : info["libraries"].items())
            std::printf("%s %s\n", name.c_str(), version.get<std::string>().c_str());
        for (const auto& device : info["devices"])
            std::printf("EGL device %d: %s%s\n", device["device"].get<int>(),
                        device["name"].get<std::string>().c_str(),
                        device["software"].get<bool>() ? " (software)" : "");
        if (context.ok()) {
            std::printf("GL in use: %s, %s, %s%s\n", (*context)->device().vendor.c_str(),
                        (*context)->device().renderer.c_str(), (*context)->device().version.c_str(),
                        (*context)->device().software ? " (software)" : "");
            for (const auto& [name, value] : info["gl"]["limits"].items())
                std::printf("limit %s %s\n", name.c_str(), value.dump().c_str());
        }
    }
    RETURN_IF_ERROR(context.status());
    return kExitOk;
}

struct PassesOptions {
    std::string pass;  // empty: all
    std::string format = "text";
};

Result<int> passes_subcommand(const PassesOptions& options) {
    const PassRegistry& passes = builtin_passes();
    const auto in_format = [&](const auto& shown, auto as_text, auto as_json, auto as_markdown) {
        return options.format == "json"       ? as_json(shown) + "\n"
               : options.format == "markdown" ? as_markdown(shown)
                                              : as_text(shown);
    };
    std::string text;
    if (options.pass.empty()) {
        text = in_format(passes, passes_as_text, passes_as_json, passes_as_markdown);
    } else if (const PassType* type = passes.find(options.pass)) {
        text = in_format(*type, pass_as_text, pass_as_json, pass_as_markdown);
    } else {
        std::vector<std::string> names;
        for (const auto& known : passes.types()) names.push_back(known.name);
        return Status(StatusCode::usage, unknown_word("pass", options.pass, names));
    }
    print_text(text);
    return kExitOk;
}

}  // namespace

RunSubcommand add_info(CLI::App& subcommand, Options& options) {
    add_device(subcommand, options);
    subcommand.add_flag("--json", options.json, "one JSON object");
    return [&options] { return info_subcommand(options); };
}

RunSubcommand add_schema(CLI::App&, Options&) {
    return [] {
        std::fputs((chain_schema(builtin_passes()) + "\n").c_str(), stdout);
        return kExitOk;
    };
}

RunSubcommand add_passes(CLI::App& subcommand, Options&) {
    const auto options = std::make_shared<PassesOptions>();
    subcommand.add_option("PASS", options->pass, "only this pass, without camera and rules");
    auto* json = subcommand.add_flag_callback(
        "--json", [options] { options->format = "json"; }, "JSON");
    subcommand
        .add_flag_callback(
            "--markdown", [options] { options->format = "markdown"; }, "Markdown tables")
        ->excludes(json);
    return [options] { return passes_subcommand(*options); };
}

}  // namespace postchain
