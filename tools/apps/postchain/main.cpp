// postchain: the command. Each subcommand has its own file.
#include <fcntl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>
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
#include "tools/apps/postchain/plan.h"
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
    PlanSettings plan;
    std::string selftest_only, passes_format = "text";

    CLI::App app("Motion blur, FXAA and depth of field over rendered frames, in any order.",
                 "postchain");
    app.set_version_flag("--version", std::string("postchain ") + kVersion);
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 ok, 1 some frames failed, 2 usage, 3 chain file invalid, 4 input missing "
        "or unreadable,\n5 output not writable, 6 no usable GL, 7 non-finite values under "
        "--strict or a failed check of stress or selftest, 8 threshold exceeded, "
        "129/130/143 on signals.");

    struct Subcommand {
        CLI::App* app;
        std::function<int()> run;
    };
    std::vector<Subcommand> subcommands;
    const auto add = [&](const char* name, const char* help,
                         std::function<int()> run) -> CLI::App& {
        subcommands.push_back({app.add_subcommand(name, help), std::move(run)});
        return *subcommands.back().app;
    };

    add_run(add("run", "filter a sequence",
                [&] {
                    const auto record = apply_like(*app.get_subcommand("run"), options);
                    return record.ok() ? run_subcommand(options, *record) : fail(record.status());
                }),
            options);
    add_plan(add("plan", "show what would run, what is left out and why",
                 [&] { return plan_subcommand(options, plan); }),
             options, plan);
    add_inspect(add("inspect", "channels, profile, facts and sign self-check of a file",
                    [&] { return inspect_subcommand(options); }),
                options);
    add_view(add("view", "show a sequence through a chain in a window, and edit the chain",
                 [&] { return view_subcommand(argc, argv); }),
             options, view);
    add_diff(add("diff", "error metrics of an image or sequence against a reference",
                 [&] { return diff_subcommand(options, diff); }),
             options, diff);
    add_check(add("check", "which outputs of a sequence are whole, missing, or from other settings",
                  [&] { return check_subcommand(options, check); }),
              options, check);
    add_sheet(add("sheet", "thumbnails of a sequence in one image",
                  [&] { return sheet_subcommand(options, sheet); }),
              options, sheet);
    add_scene(add("scene", "render a generated sequence, optionally with ground truth",
                  [&] { return scene_subcommand(options, scene); }),
              options, scene);
    add_ab(add("ab", "compare two chains on one sequence: report with verdict",
               [&] { return ab_subcommand(options, experiment, argc, argv); }),
           options, experiment);
    add_bench(add("bench", "error against run time over swept parameters",
                  [&] { return bench_subcommand(options, experiment, argc, argv); }),
              options, experiment);
    add_study(add("study", "ab or bench over several scenes, in one table",
                  [&] { return study_subcommand(options, study, argc, argv); }),
              options, study);
    add_blind(
        add("blind", "a page for observers who compare outputs without knowing which is which",
            [&] { return blind_subcommand(options, blind); }),
        options, blind);
    add_tune(add("tune",
                 "find the chain with the least error in a given time, or the fastest within an "
                 "error",
                 [&] { return tune_subcommand(options, tune, argc, argv); }),
             options, tune);
    add_stress(
        add("stress", "the stability matrix", [&] { return stress_subcommand(options, stress); }),
        options, stress);
    add_selftest(add("selftest", "check that this device renders correct images",
                     [&] { return selftest_subcommand(options, selftest_only); }),
                 options, selftest_only);
    add_serve(
        add("serve", "accept jobs over HTTP", [&] { return serve_subcommand(options, serve); }),
        options, serve);

    add_info(add("info", "GL devices, limits and library versions",
                 [&] { return info_subcommand(options); }),
             options);
    add("schema", "JSON Schema of a chain file", schema_subcommand);
    add_passes(
        add("passes", "every pass and parameter", [&] { return passes_subcommand(passes_format); }),
        passes_format);
    const auto print = [&](std::string (*text_of)(const CLI::App&)) {
        return [&app, text_of] {
            std::fputs(text_of(app).c_str(), stdout);
            return kExitOk;
        };
    };
    add("man", "the man page, as roff", print(man_page));
    add("completion", "completion script for bash", print(bash_completion));
    for (const Subcommand& one : subcommands) {
        add_logging(*one.app, options);
        refuse_empty_words(*one.app);
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
    for (const Subcommand& one : subcommands)
        if (*one.app) return one.run();
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
