#include "tools/apps/common/program.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>

#include "chain/base/parameter.h"
#include "chain/base/printable.h"
#include "config/reporter.h"
#include "tools/apps/common/confine.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/manual.h"

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

// Replaces this process by the part's program, with the same words. Returns only if that fails.
Status start(const Part& part, char** argv) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::string path = (self.parent_path() / part.program).string();
    execv(path.c_str(), argv);
    return Status(
        StatusCode::usage,
        concat(path, ": cannot be started (", std::strerror(errno), "); install the package ",
               part.program, ", or the part of a build (cmake --install build --component ",
               part.component, ")"));
}

// As --confine-to says.
Status confine(const Options& options) {
    if (options.confine_to.empty()) return Status();
    if (const std::string missing = confinement(); !missing.empty())
        log::warning("--confine-to: " + missing);
    return confine_to(options.confine_to, options.also_read);
}

int parse_and_run(const Program& program, int argc, char** argv) {
    Options options;
    options.command_line = {argv, argv + argc};
    // The name by which users know every program.
    CLI::App app(program.description, "postchain");
    app.set_version_flag("--version", std::string("postchain ") + kVersion);
    app.require_subcommand(1);
    app.footer(
        "Exit codes: 0 ok, 1 some frames failed, 2 usage, 3 chain file invalid, 4 input missing "
        "or unreadable,\n5 output not writable, 6 no usable GL, 7 non-finite values under "
        "--strict or a failed check of stress or selftest, 8 threshold exceeded, "
        "129/130/143 on signals.");
    std::vector<std::pair<const CLI::App*, RunSubcommand>> added;
    const auto add = [&](CLI::App& subcommand, RunSubcommand run) {
        added.emplace_back(&subcommand, std::move(run));
        add_logging(subcommand, options);
        refuse_empty_words(subcommand);
    };
    for (const SubcommandRow& row : all_subcommands()) {
        const Subcommand* ours = program.find(row.name);
        if (!ours && program.part) continue;
        CLI::App& subcommand = *app.add_subcommand(row.name, row.help);
        subcommand.group(row.group);
        if (ours) add(subcommand, ours->add(subcommand, options));
    }
    for (const auto& [name, help, text_of] : kManuals) {
        CLI::App& subcommand = *app.add_subcommand(name, help);
        subcommand.group(kReference);
        add(subcommand, [&program, &app, text_of = text_of]() -> Result<int> {
            std::fputs(text_of(program, app).c_str(), stdout);
            return kExitOk;
        });
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
        if (const Status status = confine(options); !status.ok()) return fail(status);
        const Result<int> code = run();
        return code.ok() ? *code : fail(code.status());
    }
    return kExitOk;
}

// Starts the part's program, if the words are for one.
int command(const Program& program, int argc, char** argv) {
    const std::string_view first = argc > 1 ? argv[1] : "";
    for (const SubcommandRow& row : all_subcommands())
        if (first == row.name && row.part && !program.part) {
            const Status status = start(*row.part, argv);
            log::set_up(false, false, asks_for("--log-format", "json", argc, argv));
            return fail(status);
        }
    std::vector<char*> words(argv, argv + argc);
    const bool is_manual = std::ranges::count(kManuals, first, &Manual::name) > 0;
    if (program.only && !program.find(first) && !is_manual && first != "--version")
        words.insert(words.begin() + 1, const_cast<char*>(program.only));
    words.push_back(nullptr);
    return parse_and_run(program, int(words.size()) - 1, words.data());
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

std::span<const SubcommandRow> all_subcommands() {
    static constexpr const char* kFilter = "Filter a sequence";
    static constexpr const char* kLook = "Look at files";
    static constexpr const char* kMeasure = "Measure and compare chains";
    static constexpr const char* kMachine = "Test this machine and the filters";
    static constexpr SubcommandRow kRows[] = {
        {kFilter, "run", "filter a sequence"},
        {kFilter, "plan", "show what would run, what is left out and why"},
        {kFilter, "view", "show a sequence through a chain in a window, and edit the chain",
         &kView},
        {kFilter, "tune",
         "find the chain with the least error in a given time, or the fastest within an error",
         &kLab},
        {kLook, "inspect", "channels, profile, value ranges and check of the motion vectors"},
        {kLook, "check", "which outputs of a sequence are whole, missing, or from other settings"},
        {kLook, "sheet", "thumbnails of a sequence in one image"},
        {kLook, "diff", "error metrics of an image or sequence against a reference"},
        {kMeasure, "ab", "compare two chains on one sequence: report with verdict", &kLab},
        {kMeasure, "bench", "error against run time over swept parameters", &kLab},
        {kMeasure, "study", "ab or bench over several scenes, in one table", &kLab},
        {kMeasure, "scene", "render a generated sequence, optionally with ground truth", &kLab},
        {kMachine, "selftest", "check that this device renders correct images"},
        {kMachine, "stress", "filter extreme cases and list known limits: the stability matrix",
         &kLab},
        {kMachine, "info", "GL devices, limits and library versions"},
        {"Serve other machines", "serve", "accept jobs over HTTP", &kServe},
        {kReference, "passes", "every pass and parameter"},
        {kReference, "schema", "JSON Schema of a chain file"},
    };
    return kRows;
}

const Subcommand* Program::find(std::string_view subcommand) const {
    const auto found = std::ranges::find(subcommands, subcommand, &Subcommand::name);
    return found == subcommands.end() ? nullptr : &*found;
}

int run_program(const Program& program, int argc, char** argv) {
    // A file-size limit must fail write() instead of raising a signal, and a closed pipe must not
    // end the process in the middle of a file.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    open_standard_streams();
    int code = kExitSomeFailed;
    try {
        code = command(program, argc, argv);
    } catch (const std::bad_alloc&) {
        code = kExitInput;  // as for StatusCode::memory
        std::fprintf(stderr, "postchain: error: not enough memory\n");
    } catch (const std::system_error& error) {
        std::fprintf(stderr,
                     "postchain: error: cannot start a thread (too little memory, or too many "
                     "threads): %s\n",
                     error.what());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "postchain: error: unexpected failure: %s\n",
                     printable(error.what()).c_str());
    }
    if (stdout_failed()) {
        std::fprintf(stderr, "postchain: error: stdout cannot be written\n");
        return code == kExitOk ? kExitOutput : code;
    }
    return code;
}

}  // namespace postchain
