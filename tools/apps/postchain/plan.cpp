#include "tools/apps/postchain/plan.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <optional>

#include "chain/plan_print.h"
#include "chain/printable.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/plan_summary.h"
#include "tools/apps/postchain/print_line.h"
#include "tools/sequence/record/layers_json.h"
#include "tools/sequence/run/plan_sequence.h"

namespace postchain {
namespace {

using Calibration = std::optional<sequence::Calibration>;

// None if the calibration does not tell.
std::optional<sequence::Seconds> seconds_of(const sequence::PlannedFrame& planned,
                                            const Calibration& calibration) {
    if (!calibration) return std::nullopt;
    const auto seconds = sequence::seconds_of(*planned.plan, *calibration);
    if (!seconds)
        log::warning(concat("--calibration ", calibration->path, ": frame ", planned.frame,
                            " runs a pass that the calibration did not; cannot estimate its time"));
    return seconds;
}

std::string verbose_text(const sequence::PlannedFrame& planned,
                         std::optional<sequence::Seconds> seconds) {
    std::string text = plan_as_text(*planned.plan) + sequence::resolved_text(*planned.resolved) +
                       sequence::layers_text(planned.layers);
    if (planned.layer_cost) text += sequence::layer_cost_text(*planned.layer_cost);
    return text + sequence::estimate_text(planned.memory, seconds);
}

}  // namespace

void add_plan(CLI::App& subcommand, Options& options, PlanSettings& plan) {
    add_chain(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kPlanGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    auto* text = subcommand.add_flag_callback(
        "--text", [&] { plan.format = "text"; },
        "readable text (default); -v adds dispatches and textures");
    auto* json = subcommand.add_flag_callback(
        "--json", [&] { plan.format = "json"; }, "one JSON object per frame");
    subcommand
        .add_flag_callback(
            "--dot", [&] { plan.format = "dot"; }, "graphviz")
        ->excludes(text)
        ->excludes(json);
    subcommand
        .add_option("--calibration", plan.calibration,
                    "sidecar of a frame filtered on a similar machine, to estimate times")
        ->type_name("FILE");
    subcommand.add_option("--pilot", plan.pilot)->group("");
}

int plan_subcommand(const Options& options, const PlanSettings& plan) {
    auto chain = load_chain_of(options);
    if (!chain.ok()) return fail(chain.status());
    auto settings = run_settings_of(options);
    if (!settings.ok()) return fail(settings.status());
    if (!plan.pilot.empty()) log::warning(former_name_text("--pilot", "--calibration"));
    const std::string& sidecar = plan.pilot.empty() ? plan.calibration : plan.pilot;
    Calibration calibration;
    if (!sidecar.empty()) {
        auto read = sequence::read_calibration(sidecar);
        if (!read.ok()) return fail(read.status().at("--calibration"));
        calibration = std::move(*read);
    }
    io::set_exr_threads(threads_of(options));
    Status first_failure;
    size_t good = 0;
    PlanSummaries summaries;
    const auto print = [&](const sequence::PlannedFrame& planned) {
        const auto seconds = seconds_of(planned, calibration);
        if (plan.format == "json") {
            print_line(sequence::planned_json(planned, seconds));
            return;
        }
        const std::string text = plan.format == "dot" ? plan_as_dot(*planned.plan)
                                 : options.verbose
                                     ? verbose_text(planned, seconds)
                                     : summaries.add(planned.plan->frame_number,
                                                     plan_summary(chain->chain, planned, seconds));
        std::fputs(printable(text, Lines::keep).c_str(), stdout);
    };
    std::string said;  // of the previous frame, without its path
    const auto show = [&](const sequence::PlannedFrame& planned) {
        for (const auto& warning : planned.warnings) log::warning(warning);
        if (planned.plan.ok()) {
            ++good;
            print(planned);
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

}  // namespace postchain
