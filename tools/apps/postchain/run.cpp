#include "tools/apps/postchain/run.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <set>

#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/like.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_sequence.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain {
namespace {

std::string frame_line(const sequence::FrameReport& report) {
    char times[96];
    std::snprintf(times, sizeof(times), "read %.0f ms, filter %.0f ms, write %.0f ms",
                  report.read_ms + report.convert_ms, report.filter_ms, report.write_ms);
    std::string text = concat("frame ", report.frame, " ", sequence::name_of(report.outcome));
    if (report.outcome == sequence::Outcome::held) text += concat(" from frame ", report.held_from);
    text += ": " + report.output;
    if (report.plan) {
        text += std::string(" (") + times + ")";
        for (const auto& elision : report.plan->elisions)
            if (elision.kind == ElisionKind::pass)
                text +=
                    "; left out " + item_text(elision, *report.plan) + ": " + text_of(elision.fact);
    }
    return text;
}

void say(const sequence::FrameReport& report, const sequence::RunProgress& progress, bool json) {
    if (json) {
        std::printf("%s\n", sequence::report_line(report, progress).c_str());
        std::fflush(stdout);
    }
    for (const auto& warning : report.warnings) log::warning(warning);
    for (const auto& note : report.write.notes) log::warning(report.output + ": " + note);
    if (!report.status.ok()) {
        log::error(report.status.message());
    } else if (log::progress_is_shown()) {
        log::detail(frame_line(report));
    } else {
        log::info(frame_line(report));
    }
    log::progress(
        double(progress.done) / double(progress.total),
        concat(progress.done, "/", progress.total, " frames, ", log::duration(progress.elapsed_s),
               " elapsed, ", log::duration(progress.remaining_s), " to go"));
}

// Shows the awaited frames: in the progress line on a terminal, otherwise a line each minute.
class WaitLines {
  public:
    void operator()(const std::string& text, const sequence::RunProgress& progress) {
        const std::string line =
            concat(progress.done, "/", progress.total, " frames; waiting for frames: ", text);
        log::progress(line);
        const auto now = std::chrono::steady_clock::now();
        if (log::progress_is_shown() || text == last_ || (said_at_ && now - *said_at_ < kBetween))
            return;
        log::info(line);
        last_ = text;
        said_at_ = now;
    }

  private:
    static constexpr auto kBetween = std::chrono::minutes(1);
    std::string last_;
    std::optional<std::chrono::steady_clock::time_point> said_at_;
};

}  // namespace

void add_run(CLI::App& subcommand, Options& options) {
    add_chain(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kOutputGroup,
                              sequence::kPlanGroup, sequence::kWatchGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    subcommand.add_flag("--json", options.json, "one JSON object per frame on stdout");
    add_progress(subcommand, options);
    add_device(subcommand, options);
    add_like(subcommand, options);
}

int run_subcommand(const Options& options, const std::optional<sequence::Record>& like) {
    auto chain = load_chain_of(options);
    if (!chain.ok()) return fail(chain.status());
    auto settings = run_settings_of(options);
    if (!settings.ok()) return fail(settings.status());
    if (!options.chain.empty()) settings->other_inputs.push_back({options.chain, "the chain file"});
    if (like) settings->other_inputs.push_back({options.like, "the output of --like"});
    for (auto& picture : io::inputs_of(chain->chain.camera))
        settings->other_inputs.push_back(std::move(picture));
    std::set<int> cuts = settings->source.cuts;  // neither run yet nor on disk
    std::erase_if(cuts, [&](int frame) {
        std::error_code failed;
        const io::PathPattern& color = settings->input.color();
        return color.has_token() && std::filesystem::exists(color.format(frame), failed);
    });
    const StopOnSignal stop;
    auto context = context_of(options);
    if (!context.ok()) return fail(context.status());
    const std::string renderer = sequence::renderer_text((*context)->device());
    log::detail("renderer: " + renderer);
    Executor executor((*context)->device());
    auto summary = sequence::run_sequence(
        chain->chain, *settings, executor, renderer,
        [&](const sequence::FrameReport& report, const sequence::RunProgress& progress) {
            say(report, progress, options.json);
            cuts.erase(report.frame);
            if (like && report.frame == like->frame && report.status.ok())
                log::info(concat(options.like, report.provenance == like->work
                                                   ? ": repeated, the same chain, settings and "
                                                     "input files"
                                                   : ": chain, settings or input files differ"));
        },
        &stop.flag(), {}, WaitLines());
    log::progress("");
    if (!summary.ok()) return fail(summary.status());
    std::string text = concat(summary->written, " written");
    const auto count = [&](size_t frames, const char* what) {
        if (frames) text += concat(", ", frames, " ", what);
    };
    count(summary->skipped, "skipped");
    count(summary->held, "held");
    count(summary->missing, "missing");
    count(summary->failed, "failed");
    if (!cuts.empty() && !stop.asked())
        log::warning("--cuts: frames not in the sequence: " +
                     sequence::frames_text({cuts.begin(), cuts.end()}));
    if (!summary->gaps.empty())
        log::warning(concat(settings->input.color().text(), ": frames missing in the sequence, ",
                            summary->gaps.size(),
                            summary->gaps.size() == 1 ? " frame: " : " frames: ",
                            sequence::frames_text(summary->gaps)));
    log::info(concat(text, " of ", summary->total,
                     summary->total == 1 ? " frame in " : " frames in ",
                     log::duration(summary->elapsed_s)));
    if (!stop.asked()) return exit_code(*summary);
    return stop.interrupted(concat(
        summary->total - summary->written - summary->skipped - summary->held - summary->missing,
        " frames are left; the same command with --on-existing skip goes on"));
}

}  // namespace postchain
