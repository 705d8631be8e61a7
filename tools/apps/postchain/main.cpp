// postchain: the command. Each subcommand has its own file.
#include <fcntl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <system_error>

#include "chain/printable.h"
#include "config/reporter.h"
#include "tools/apps/postchain/blind.h"
#include "tools/apps/postchain/check.h"
#include "tools/apps/postchain/completion.h"
#include "tools/apps/postchain/describe.h"
#include "tools/apps/postchain/diff.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/experiments.h"
#include "tools/apps/postchain/inspect.h"
#include "tools/apps/postchain/like.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/run.h"
#include "tools/apps/postchain/scene.h"
#include "tools/apps/postchain/selftest.h"
#include "tools/apps/postchain/serve.h"
#include "tools/apps/postchain/sheet.h"
#include "tools/apps/postchain/stress.h"
#include "tools/apps/postchain/study.h"
#include "tools/apps/postchain/tune.h"
#include "tools/apps/postchain/view.h"
#include "tools/apps/postchain/view_options.h"

namespace postchain {
namespace {

// Whether a command line that could not be parsed has the option: --log-format json, --progress
// openjd.
bool asks_for(const std::string& option, const std::string& choice, int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == option + "=" + choice) return true;
        if (word == option && i + 1 < argc && argv[i + 1] == choice) return true;
    }
    return false;
}

int usage_error(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    log::set_up(false, false, asks_for("--log-format", "json", argc, argv));
    if (asks_for("--progress", "openjd", argc, argv)) log::tell_openjd();
    const auto given = app.get_subcommands();
    std::string text = error.what();
    if (given.empty() && argc > 1 && argv[1][0] != '-') {
        std::vector<std::string> subcommands;
        for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; }))
            subcommands.push_back(subcommand->get_name());
        text = unknown_word("subcommand", argv[1], subcommands);
    }
    log::error(concat(text, "; see postchain ", given.empty() ? "" : given[0]->get_name() + " ",
                      "--help"));
    return kExitUsage;
}

int command(int argc, char** argv) {
    Options options;
    SceneOptions scene;
    BlindOptions blind;
    CheckOptions check;
    DiffOptions diff;
    SheetOptions sheet;
    ExperimentOptions experiment;
    StressOptions stress;
    ServeOptions serve;
    StudyOptions study;
    TuneOptions tune;
    ViewOptions view;
    std::string selftest_only, plan_format = "text", plan_calibration, passes_format = "text";
    const ParameterTable& job = job_parameters();

    CLI::App app("Motion blur, FXAA and depth of field over rendered frames, in any order.",
                 "postchain");
    app.set_version_flag("--version", std::string("postchain ") + kVersion);
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 ok, 1 some frames failed, 2 usage, 3 chain file invalid, 4 input missing "
        "or unreadable,\n5 output not writable, 6 no usable GL, 7 non-finite values under "
        "--strict or a failed check of stress or selftest, 8 threshold exceeded, 130/143 on "
        "signals.");

    CLI::App* run = app.add_subcommand("run", "filter a sequence");
    add_chain(*run, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kOutputGroup,
                              sequence::kPlanGroup, sequence::kWatchGroup})
        add_settings(*run, job, group, &options.job);
    run->add_flag("--json", options.json, "one JSON object per frame on stdout");
    add_progress(*run, options);
    add_device(*run, options);
    add_like(*run, options);

    CLI::App* plan = app.add_subcommand("plan", "show what would run, what is left out and why");
    add_chain(*plan, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kPlanGroup})
        add_settings(*plan, job, group, &options.job);
    auto* text = plan->add_flag_callback(
        "--text", [&] { plan_format = "text"; },
        "readable text (default); -v adds dispatches and textures");
    auto* json = plan->add_flag_callback(
        "--json", [&] { plan_format = "json"; }, "one JSON object per frame");
    plan->add_flag_callback(
            "--dot", [&] { plan_format = "dot"; }, "graphviz")
        ->excludes(text)
        ->excludes(json);

    auto* calibration =
        plan->add_option("--calibration", plan_calibration,
                         "sidecar of a frame filtered on a similar machine, to estimate times")
            ->type_name("FILE");
    auto* pilot =  // former name
        plan->add_option("--pilot", plan_calibration)->group("")->excludes(calibration);

    CLI::App* inspect =
        app.add_subcommand("inspect", "channels, profile, facts and sign self-check of a file");
    add_settings(*inspect, job, sequence::kInputGroup, &options.job);
    inspect->add_flag("--json", options.json, "one JSON object per frame");
    inspect->add_flag("--camera-metadata", options.camera_metadata,
                      "print only a Markdown table of the camera attributes that are read");
    inspect->get_option("--input")->required(false);
    inspect->add_option("IN", options.job.input,
                        "frame or pattern, as for --input, or a folder, to list its sequences");

    CLI::App* view_app = app.add_subcommand(
        "view", "show a sequence through a chain in a window, and edit the chain");
    add_view(*view_app, options, view);

    CLI::App* diff_app =
        app.add_subcommand("diff", "error metrics of an image or sequence against a reference");
    add_diff(*diff_app, options, diff);

    CLI::App* check_app = app.add_subcommand(
        "check", "which outputs of a sequence are whole, missing, or from other settings");
    add_check(*check_app, options, check);

    CLI::App* sheet_app = app.add_subcommand("sheet", "thumbnails of a sequence in one image");
    add_sheet(*sheet_app, options, sheet);

    CLI::App* scene_app =
        app.add_subcommand("scene", "render a generated sequence, optionally with ground truth");
    add_scene(*scene_app, options, scene);

    CLI::App* ab =
        app.add_subcommand("ab", "compare two chains on one sequence: report with verdict");
    add_ab(*ab, options, experiment);
    CLI::App* bench = app.add_subcommand("bench", "error against run time over swept parameters");
    add_bench(*bench, options, experiment);

    CLI::App* study_app =
        app.add_subcommand("study", "ab or bench over several scenes, in one table");
    add_study(*study_app, options, study);
    CLI::App* blind_app = app.add_subcommand(
        "blind", "a page for observers who compare outputs without knowing which is which");
    add_blind(*blind_app, options, blind);
    CLI::App* tune_app = app.add_subcommand(
        "tune",
        "find the chain with the least error in a given time, or the fastest within an error");
    add_tune(*tune_app, options, tune);

    CLI::App* stress_app = app.add_subcommand("stress", "the stability matrix");
    add_stress(*stress_app, options, stress);

    CLI::App* selftest =
        app.add_subcommand("selftest", "check that this device renders correct images");
    add_selftest(*selftest, options, selftest_only);

    CLI::App* serve_app = app.add_subcommand("serve", "accept jobs over HTTP");
    add_serve(*serve_app, options, serve);

    CLI::App* info = app.add_subcommand("info", "GL devices, limits and library versions");
    add_device(*info, options);
    info->add_flag("--json", options.json, "one JSON object");
    CLI::App* schema = app.add_subcommand("schema", "JSON Schema of a chain file");
    CLI::App* passes = app.add_subcommand("passes", "every pass and parameter");
    passes->add_flag_callback(
        "--json", [&] { passes_format = "json"; }, "JSON");
    passes->add_flag_callback(
        "--markdown", [&] { passes_format = "markdown"; }, "Markdown tables");
    CLI::App* man = app.add_subcommand("man", "the man page, as roff");
    CLI::App* completion = app.add_subcommand("completion", "completion script for bash");
    for (CLI::App* subcommand : app.get_subcommands([](CLI::App*) { return true; })) {
        add_logging(*subcommand, options);
        refuse_empty_words(*subcommand);
    }

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() != 0) return usage_error(app, error, argc, argv);
        app.exit(error);  // --help, --version
        return kExitOk;
    }
    log::set_up(options.verbose, options.quiet, options.log_format == "json");
    if (options.progress == "openjd") log::tell_openjd();
    if (*run) {
        const auto record = apply_like(*run, options);
        return record.ok() ? run_subcommand(options, *record) : fail(record.status());
    }
    if (*pilot) log::warning(former_name_text("--pilot", "--calibration"));
    if (*plan) return plan_subcommand(options, plan_format, plan_calibration);
    if (*inspect) return inspect_subcommand(options);
    if (*view_app) return view_subcommand(argc, argv);
    if (*diff_app) return diff_subcommand(options, diff);
    if (*check_app) return check_subcommand(options, check);
    if (*sheet_app) return sheet_subcommand(options, sheet);
    if (*scene_app) return scene_subcommand(options, scene);
    if (*ab) return ab_subcommand(options, experiment, argc, argv);
    if (*bench) return bench_subcommand(options, experiment, argc, argv);
    if (*study_app) return study_subcommand(options, study, argc, argv);
    if (*blind_app) return blind_subcommand(options, blind);
    if (*tune_app) return tune_subcommand(options, tune, argc, argv);
    if (*stress_app) return stress_subcommand(options, stress);
    if (*selftest) return selftest_subcommand(options, selftest_only);
    if (*serve_app) return serve_subcommand(options, serve);
    if (*info) return info_subcommand(options);
    if (*schema) return schema_subcommand();
    if (*passes) return passes_subcommand(passes_format);
    if (*man) std::fputs(man_page(app).c_str(), stdout);
    if (*completion) std::fputs(bash_completion(app).c_str(), stdout);
    return kExitOk;
}

// If a standard stream were closed, the next file opened would get its number, and messages would
// go into an image.
void open_standard_streams() {
    for (int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (fcntl(fd, F_GETFD) >= 0) continue;
        // Read-only, so that writing to a closed stdout fails and is noticed.
        const int flags = fd == STDERR_FILENO ? O_WRONLY : O_RDONLY;
        if (const int opened = open("/dev/null", flags); opened >= 0 && opened != fd) {
            dup2(opened, fd);
            close(opened);
        }
    }
}

// A reader that closes the pipe at the end (`passes | head`) has what it wanted. Lines lost earlier
// (`run --json`) and all other failures are errors.
bool stdout_failed() {
    errno = 0;
    const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout);
    return failed && errno != EPIPE;
}

}  // namespace
}  // namespace postchain

int main(int argc, char** argv) {
    // A file-size limit must fail write() instead of raising a signal, and a closed pipe must not
    // end the process in the middle of a file.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    postchain::open_standard_streams();
    int code = postchain::kExitSomeFailed;
    try {
        code = postchain::command(argc, argv);
    } catch (const std::bad_alloc&) {
        code = postchain::kExitInput;  // as for StatusCode::memory
        std::fprintf(stderr, "postchain: error: not enough memory\n");
    } catch (const std::system_error& error) {
        std::fprintf(stderr,
                     "postchain: error: cannot start a thread (too little memory, or too many "
                     "threads): %s\n",
                     error.what());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "postchain: error: unexpected failure: %s\n",
                     postchain::printable(error.what()).c_str());
    }
    if (postchain::stdout_failed()) {
        std::fprintf(stderr, "postchain: error: stdout cannot be written\n");
        return code == postchain::kExitOk ? postchain::kExitOutput : code;
    }
    return code;
}
