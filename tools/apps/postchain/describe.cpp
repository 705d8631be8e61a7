#include "tools/apps/postchain/describe.h"

#include <OpenEXR/OpenEXRConfig.h>
#include <spdlog/version.h>

#include <CLI/Version.hpp>
#include <cstdio>

#include "chain/plan_print.h"
#include "chain/printable.h"
#include "config/describe.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/plan_summary.h"
#include "tools/apps/postchain/print_line.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/image_module.h"
#include "tools/sequence/record/layers_json.h"
#include "tools/sequence/run/estimate.h"
#include "tools/sequence/run/plan_sequence.h"

namespace postchain {

int plan_subcommand(const Options& options, const std::string& format,
                    const std::string& calibration_path) {
    auto chain = load_chain_of(options);
    if (!chain.ok()) return fail(chain.status());
    auto settings = run_settings_of(options);
    if (!settings.ok()) return fail(settings.status());
    std::optional<sequence::Calibration> calibration;
    if (!calibration_path.empty()) {
        auto read = sequence::read_calibration(calibration_path);
        if (!read.ok()) return fail(read.status().at("--calibration"));
        calibration = std::move(*read);
    }
    io::set_exr_threads(threads_of(options));
    Status first_failure;
    size_t good = 0;
    PlanSummaries summaries;
    std::string said;  // of the previous frame, without its path
    const auto show = [&](const sequence::PlannedFrame& planned) {
        for (const auto& warning : planned.warnings) log::warning(warning);
        if (planned.plan.ok()) {
            ++good;
            const Plan& plan = *planned.plan;
            const auto seconds =
                calibration ? sequence::seconds_of(plan, *calibration) : std::nullopt;
            if (calibration && !seconds)
                log::warning(
                    concat("--calibration ", calibration->path, ": frame ", planned.frame,
                           " runs a pass that the calibration did not; cannot estimate its time"));
            const std::string text =
                format == "json"  ? io::json_text(sequence::planned_json(planned, seconds)) + "\n"
                : format == "dot" ? plan_as_dot(plan)
                : options.verbose
                    ? plan_as_text(plan) + sequence::resolved_text(*planned.resolved) +
                          sequence::layers_text(planned.layers) +
                          (planned.layer_cost ? sequence::layer_cost_text(*planned.layer_cost)
                                              : std::string()) +
                          sequence::estimate_text(planned.memory, seconds)
                    : summaries.add(plan.frame_number,
                                    plan_summary(chain->chain, planned, seconds));
            // JSON is already escaped.
            std::fputs(format == "json" ? text.c_str() : printable(text, Lines::keep).c_str(),
                       stdout);
            return true;
        }
        // An error repeated for the next frame applies to every frame.
        const Status status = planned.plan.status();
        const size_t words = status.message().find(": ");
        const std::string what =
            words == std::string::npos ? status.message() : status.message().substr(words);
        if (status.code() == StatusCode::chain && what == said) return false;
        said = what;
        log::error(status.message());
        if (first_failure.ok()) first_failure = status;
        return true;
    };
    if (Status status = sequence::plan_sequence(chain->chain, *settings, show); !status.ok())
        return fail(status);
    return exit_code(first_failure, good);
}

int info_subcommand(const Options& options) {
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
    return context.ok() ? kExitOk : fail(context.status());
}

int schema_subcommand() {
    std::fputs((chain_schema(builtin_passes()) + "\n").c_str(), stdout);
    return kExitOk;
}

int passes_subcommand(const std::string& format) {
    const std::string text = format == "json"       ? passes_as_json(builtin_passes()) + "\n"
                             : format == "markdown" ? passes_as_markdown(builtin_passes())
                                                    : passes_as_text(builtin_passes());
    std::fputs(text.c_str(), stdout);
    return kExitOk;
}

}  // namespace postchain
