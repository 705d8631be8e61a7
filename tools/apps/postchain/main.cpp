// postchain: the command. Each subcommand has its own file.
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string_view>
#include <system_error>

#include "chain/base/parameter.h"
#include "chain/base/printable.h"
#include "config/reporter.h"
#include "passes/registry.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/subcommands.h"
#include "tools/service/work/image_helper.h"
#include "tools/service/work/preview_helper.h"

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

// The arguments that the subcommand does not take, in words: the first unknown option, with the
// closest known one, or the first argument, which may be the input or the output. Empty if there
// are none.
std::string unexpected(const CLI::App& subcommand) {
    const std::vector<std::string> words = subcommand.remaining();
    std::vector<std::string> known;
    for (const CLI::Option* option : subcommand.get_options())
        for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    for (const std::string& word : words) {
        if (!word.starts_with('-')) continue;
        const std::string name = word.substr(0, word.find('='));
        const std::string near = name.starts_with("--") ? nearest_word(name, known) : "";
        return concat("unknown option '", name, "'",
                      near.empty() ? "" : " (did you mean '" + near + "'?)");
    }
    if (words.empty()) return "";
    for (const std::string option : {"--input", "--output"})
        if (const CLI::Option* one = subcommand.get_option_no_throw(option);
            one && one->count() == 0)
            return concat("unexpected argument '", words[0], "' (did you mean '", option, " ",
                          words[0], "'?)");
    return concat("unexpected argument '", words[0], "'");
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
    } else if (dynamic_cast<const CLI::ExtrasError*>(&error) ||
               dynamic_cast<const CLI::RequiredError*>(&error)) {
        // A misspelled option is missing under its right name, too.
        const std::string words = unexpected(given.empty() ? app : *given[0]);
        if (!words.empty()) text = words;
    }
    log::error(concat(text, "; see postchain ", given.empty() ? "" : given[0]->get_name() + " ",
                      "--help"));
    return kExitUsage;
}

struct Subcommand {
    const char* group;  // heading in --help
    const char* name;
    const char* help;
    RunSubcommand (*add)(CLI::App& subcommand, Options& options);
};
constexpr const char* kFilter = "Filter a sequence";
constexpr const char* kLook = "Look at files";
constexpr const char* kMeasure = "Measure and compare chains";
constexpr const char* kMachine = "Test this machine and the filters";
constexpr const char* kServe = "Serve other machines";
constexpr const char* kReference = "Reference";
constexpr Subcommand kSubcommands[] = {
    {kFilter, "run", "filter a sequence", add_run},
    {kFilter, "plan", "show what would run, what is left out and why", add_plan},
    {kFilter, "view", "show a sequence through a chain in a window, and edit the chain", add_view},
    {kFilter, "tune",
     "find the chain with the least error in a given time, or the fastest within an error",
     add_tune},
    {kLook, "inspect", "channels, profile, value ranges and check of the motion vectors",
     add_inspect},
    {kLook, "check", "which outputs of a sequence are whole, missing, or from other settings",
     add_check},
    {kLook, "sheet", "thumbnails of a sequence in one image", add_sheet},
    {kLook, "diff", "error metrics of an image or sequence against a reference", add_diff},
    {kMeasure, "ab", "compare two chains on one sequence: report with verdict", add_ab},
    {kMeasure, "bench", "error against run time over swept parameters", add_bench},
    {kMeasure, "study", "ab or bench over several scenes, in one table", add_study},
    {kMeasure, "blind", "a page for observers who compare outputs without knowing which is which",
     add_blind},
    {kMeasure, "scene", "render a generated sequence, optionally with ground truth", add_scene},
    {kMachine, "selftest", "check that this device renders correct images", add_selftest},
    {kMachine, "stress", "filter extreme cases and list known limits: the stability matrix",
     add_stress},
    {kMachine, "info", "GL devices, limits and library versions", add_info},
    {kServe, "serve", "accept jobs over HTTP", add_serve},
    {kReference, "passes", "every pass and parameter", add_passes},
    {kReference, "schema", "JSON Schema of a chain file", add_schema},
    {kReference, "man", "the man page, as roff", add_man},
    {kReference, "completion", "completion script for bash", add_completion},
};

int command(int argc, char** argv) {
    Options options;
    options.command_line = {argv, argv + argc};
    CLI::App app("Motion blur, FXAA and depth of field over rendered frames, in any order.",
                 "postchain");
    app.set_version_flag("--version", std::string("postchain ") + kVersion);
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 ok, 1 some frames failed, 2 usage, 3 chain file invalid, 4 input missing "
        "or unreadable,\n5 output not writable, 6 no usable GL, 7 non-finite values under "
        "--strict or a failed check of stress or selftest, 8 threshold exceeded, "
        "129/130/143 on signals.");
    std::vector<std::pair<const CLI::App*, RunSubcommand>> added;
    for (const Subcommand& one : kSubcommands) {
        CLI::App& subcommand = *app.add_subcommand(one.name, one.help);
        subcommand.group(one.group);
        added.emplace_back(&subcommand, one.add(subcommand, options));
        add_logging(subcommand, options);
        refuse_empty_words(subcommand);
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
    for (const auto& [subcommand, run] : added) {
        if (!subcommand->parsed()) continue;
        const Result<int> code = run();
        return code.ok() ? *code : fail(code.status());
    }
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

// A reader that closes the pipe has what it wanted: `schema | head -1`.
bool reader_has_left() {
    pollfd out = {STDOUT_FILENO, 0, 0};
    return ::poll(&out, 1, 0) == 1 && (out.revents & (POLLERR | POLLHUP)) != 0;
}

bool stdout_failed() {
    const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout);
    return failed && !reader_has_left();
}

}  // namespace
}  // namespace postchain

int main(int argc, char** argv) {
    // A file-size limit must fail write() instead of raising a signal, and a closed pipe must not
    // end the process in the middle of a file.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    postchain::open_standard_streams();
    if (argc == 2 && std::string_view(argv[1]) == postchain::service::kImageHelper)
        return postchain::service::run_image_helper(postchain::builtin_passes());
    if (argc == 2 && std::string_view(argv[1]) == postchain::service::kPreviewHelper)
        return postchain::service::run_preview_helper(postchain::builtin_passes());
    if (argc == 2 && std::string_view(argv[1]) == postchain::service::kProgramHelper)
        return postchain::service::run_program_helper(postchain::builtin_passes());
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
