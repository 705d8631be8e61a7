// postchain run: the runner with messages, progress and signals.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>

#include "chain/base/text.h"
#include "config/camera_file.h"
#include "tools/apps/common/checks.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/sequence/image/bokeh_kernel_file.h"
#include "tools/sequence/record/record.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/run_sequence.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain {
namespace {

std::string frame_line(const sequence::FrameReport& report) {
    char times[96];
    std::snprintf(times, sizeof(times), "read %.0f ms, filter %.0f ms, write %.0f ms",
                  report.findings.read_ms + report.findings.convert_ms, report.filter_ms,
                  report.write_ms);
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

void say(const sequence::FrameReport& report, const sequence::RunProgress& progress, bool json,
         FrameErrors& errors) {
    if (json) print_line(sequence::report_json(report, progress));
    for (const auto& warning : report.warnings) log::warning(warning);
    for (const auto& note : report.write.notes) log::warning(report.output + ": " + note);
    if (report.outcome == sequence::Outcome::failed)
        errors.add(report.frame, report.status);
    else if (!report.status.ok())  // a missing frame is named with its file
        log::error(report.status.message());
    else if (log::progress_is_shown())
        log::detail(frame_line(report));
    else
        log::info(frame_line(report));
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

// ------------------------------------------------------------------------------------ --like
// Takes chain, camera and settings from an output's record; options given override them.

bool is_given(const CLI::App& run, const std::string& key) {
    const std::string name = option_name(key);
    for (const std::string& one : {name, "--no-" + name.substr(2)})
        if (const CLI::Option* option = run.get_option_no_throw(one); option && option->count())
            return true;
    return false;
}

// Uses the camera file if it is unchanged, otherwise the values it gave for the recorded frame.
void apply_camera(const sequence::Record& record, Options& options) {
    if (record.camera_hash.empty()) return;
    const auto file = load_camera(options.job.camera);
    if (file.ok() && hex_of(file->text_hash) == record.camera_hash) return;
    log::warning(concat(options.like, ": the camera file ", options.job.camera,
                        file.ok() ? " has changed" : " no longer exists", ": its values of frame ",
                        record.frame, " are used for every frame, and its matrices are unknown"));
    options.job.camera.clear();
    options.recorded_camera = record.camera;
}

void compare_inputs(const sequence::Record& record, const std::string& like) {
    for (const auto& file : record.inputs) {
        std::error_code error;
        const auto bytes = std::filesystem::file_size(file.path, error);
        if (error)
            log::warning(concat(like, ": was made from ", file.path, ", which no longer exists"));
        else if (bytes != file.bytes)
            log::warning(concat(like, ": was made from ", file.path, " of ", file.bytes,
                                " bytes, which has ", bytes, " now"));
    }
}

// Adds --like to `run`; CHAIN and --input are then optional.
void add_like(CLI::App& run, Options& options) {
    run.add_option(
           "--like", options.like,
           "an output of `run`: repeats it with its chain, camera and settings; other options "
           "override them")
        ->type_name("OUT");
    CLI::Option* chain = run.get_option("CHAIN")->required(false);
    CLI::Option* input = run.get_option("--input")->required(false);
    run.final_callback([&options, chain, input] {
        if (!options.like.empty()) return;
        for (const CLI::Option* option : {chain, input})
            if (option->count() == 0) throw CLI::RequiredError(option->get_name());
    });
}

// Fills the missing options of `run` from the record of options.like and warns about parts that no
// longer hold. Does nothing without --like. Errors (input): those of read_record().
Result<std::optional<sequence::Record>> apply_like(const CLI::App& run, Options& options) {
    if (options.like.empty()) return std::optional<sequence::Record>();
    ASSIGN_OR_RETURN(auto record, sequence::read_record(options.like).at("--like"));
    if (record.version != kVersion)
        log::warning(concat(options.like, ": was made by postchain ", record.version, ", this is ",
                            kVersion, ": the result may differ"));
    if (options.chain.empty()) options.recorded_chain = record.chain;
    for (const auto& [key, value] : record.settings) {
        const Parameter* row = job_parameters().find(key);
        if (!row || !row->check(value).ok()) {
            log::warning(
                concat(options.like, ": its setting ", key, " is unknown in this version"));
            continue;
        }
        // The layer behind belongs to the recorded input.
        if (!is_given(run, key) && !(key == "behind" && is_given(run, "input")))
            row->set(&options.job, value);
    }
    if (!is_given(run, "input")) {
        compare_inputs(record, options.like);
        if (!is_given(run, "frames")) options.job.frames = concat(record.frame);
    }
    if (!is_given(run, "camera")) apply_camera(record, options);
    return std::optional(std::move(record));
}

// ---------------------------------------------------------------------------------------- run
void add_other_inputs(const Options& options, const Chain& chain, sequence::RunSettings& settings) {
    auto& files = settings.other_inputs;
    if (!options.chain.empty()) files.push_back({options.chain, "the chain file"});
    if (!options.like.empty()) files.push_back({options.like, "the output of --like"});
    for (auto& picture : io::inputs_of(chain.camera)) files.push_back(std::move(picture));
}

// What --check prints of a run without faults.
io::Json json_of(const sequence::RunCheck& found, const sequence::RunSettings& settings) {
    io::Json json = {{"frames", io::Json::array()},
                     {"writes", {whole_path(settings.output.text())}},
                     {"files", io::Json::array()}};
    for (const sequence::FrameTask& task : found.tasks) {
        io::Json frame = {{"frame", task.frame},
                          {"inputs", io::Json::object()},
                          {"output", whole_path(task.output)}};
        for (const auto& [role, path] : task.files)
            frame["inputs"][name_of(role)] = whole_path(path);
        if (task.files.empty())
            frame["missing"] = sequence::absent_frame(task.frame, settings).message();
        if (const auto refused = found.refused.find(task.frame); refused != found.refused.end())
            frame["refused"] = refused->second;
        json["frames"].push_back(std::move(frame));
    }
    if (!settings.dump_folder.empty()) json["writes"].push_back(whole_path(settings.dump_folder));
    for (const io::InputFile& file : settings.other_inputs)
        if (std::error_code error; std::filesystem::exists(file.path, error))
            json["files"].push_back({{"path", whole_path(file.path)}, {"what", file.what}});
    return json;
}

int check_subcommand(const Options& options) {
    Checks checks;
    const auto chain = checks.chain("chain", options);
    auto settings = checks.settings(options);
    if (!checks.ok()) return checks.print({});
    add_other_inputs(options, chain->chain, *settings);
    const sequence::RunCheck found = sequence::check_run(chain->chain, *settings);
    for (const auto& [key, status] : found.faults) checks.take(key, status);
    if (!options.confine_to.empty()) {
        checks.reads("input", settings->input);
        checks.writes("output", settings->output.folder());
        if (!settings->dump_folder.empty()) checks.writes("dump_stages", settings->dump_folder);
    }
    return checks.print(json_of(found, *settings));
}

// `like`: the record to repeat, if any.
Result<int> run_subcommand(const Options& options, const std::optional<sequence::Record>& like) {
    ASSIGN_OR_RETURN(auto chain, load_chain_of(options));
    ASSIGN_OR_RETURN(auto settings, run_settings_of(options));
    add_other_inputs(options, chain.chain, settings);
    std::set<int> cuts = settings.source.cuts;  // neither run yet nor on disk
    std::erase_if(cuts, [&](int frame) {
        std::error_code failed;
        const io::PathPattern& color = settings.input.color();
        return color.has_token() && std::filesystem::exists(color.format(frame), failed);
    });
    const StopOnSignal stop;
    ASSIGN_OR_RETURN(auto context, context_of(options));
    const std::string renderer = sequence::renderer_text(context->device());
    log::detail("renderer: " + renderer);
    Executor executor(context->device());
    FrameErrors errors;
    const auto finished = [&](const sequence::FrameReport& report,
                              const sequence::RunProgress& progress) {
        say(report, progress, options.json, errors);
        cuts.erase(report.frame);
        if (like && report.frame == like->frame && report.status.ok())
            log::info(concat(options.like, report.provenance == like->work
                                               ? ": repeated, the same chain, settings and "
                                                 "input files"
                                               : ": chain, settings or input files differ"));
    };
    const auto begins = [&](const sequence::FrameTask& task) {
        if (options.json) print_line({{"frame", task.frame}, {"begins", true}});
        return Status();
    };
    auto summary = sequence::run_sequence(
        chain.chain, settings, executor, renderer,
        {.finished = finished, .stop = &stop.flag(), .start = begins, .waits = WaitLines()});
    log::progress("");
    errors.finish();
    if (!summary.ok()) return summary.status();
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
        log::warning(
            concat(settings.input.color().text(), ": ", sequence::gaps_text(summary->gaps)));
    log::info(concat(text, " of ", summary->total,
                     summary->total == 1 ? " frame in " : " frames in ",
                     log::duration(summary->elapsed_s)));
    if (!stop.asked()) return exit_code(*summary);
    return stop.interrupted(concat(
        summary->total - summary->written - summary->skipped - summary->held - summary->missing,
        " frames are left; the same command with --on-existing skip goes on"));
}

}  // namespace

RunSubcommand add_run(CLI::App& subcommand, Options& options) {
    add_chain(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kOutputGroup,
                              sequence::kPlanGroup, sequence::kWatchGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    subcommand.add_flag("--json", options.json,
                        "two JSON objects per frame on stdout, when it begins and when it ends");
    add_progress(subcommand, options);
    add_device(subcommand, options);
    add_like(subcommand, options);
    add_confine(subcommand, options);
    add_checks(subcommand, options, {"chain", "input"});  // not so with --like
    return [&subcommand, &options]() -> Result<int> {
        ASSIGN_OR_RETURN(const auto like, apply_like(subcommand, options));
        if (options.check) return check_subcommand(options);
        return run_subcommand(options, like);
    };
}

}  // namespace postchain
