// Options shared by subcommands. Those of a job are made from its table.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "config/chain_file.h"
#include "config/chain_find.h"
#include "tools/sequence/settings/job_settings.h"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace postchain {

// Options as typed. One instance serves every subcommand, since a process runs one.
struct Options {
    std::vector<std::string> command_line;  // with the program's name
    std::string chain;                      // file or shipped name
    std::vector<std::string> sets;
    std::string relative_to;      // folder of the files that the chain names; empty = the chain's
    std::string like;             // of run
    std::string recorded_chain;   // chain file text; replaces `chain`
    std::string recorded_camera;  // camera file text; replaces job.camera
    sequence::JobSettings job;
    std::string device = "auto";
    int threads = 0;
    bool verbose = false;
    bool quiet = false;
    std::string log_format = "text";
    std::string progress = "terminal";
    bool json = false;
    bool check = false;
    std::vector<std::string> confine_to;  // folders; none: not confined
    std::vector<std::string> also_read;   // files, of a confined process
    bool camera_metadata = false;         // of inspect: prints the table of attributes
};

void add_logging(CLI::App& subcommand, Options& options);
// CHAIN, or another word; `key`: of its setting.
void add_chain_file(CLI::App& subcommand, const std::string& word, const std::string& key,
                    std::string& chain);
void add_chain(CLI::App& subcommand, Options& options);  // CHAIN, --set, --relative-to
void add_relative_to(CLI::App& subcommand, Options& options);
void add_threads(CLI::App& subcommand, Options& options);
void add_device(CLI::App& subcommand, Options& options);  // and --threads
// The settings of a subcommand that shows frames as --png does, and --threads.
void add_displayed(CLI::App& subcommand, Options& options);
// --confine-to and --also-read, for subcommands that a service starts.
void add_confine(CLI::App& subcommand, Options& options);
// --progress, for subcommands that a farm runs. Add --json first if the subcommand has it.
void add_progress(CLI::App& subcommand, Options& options);

// The value of --size: WIDTHxHEIGHT. Errors (usage).
Result<std::array<int, 2>> parse_size(const std::string& text);

// Refuses empty values everywhere: they come from unset shell variables.
void refuse_empty_words(CLI::App& subcommand);

// Refuses what is no decimal number, as chain files do, and values outside the range, with the
// message of CLI::Range.
CLI::Validator number_within(const CLI::Validator& range);

const ParameterTable& job_parameters();

// Adds an option for a table row: its name, type, choices, range, default and help. `settings` is
// the table's struct and must outlive the subcommand. A boolean that is true by default becomes
// --no-KEY.
void add_setting(CLI::App& subcommand, const Parameter& row, ParameterRef settings);
void add_settings(CLI::App& subcommand, const ParameterTable& table, const std::string& group,
                  ParameterRef settings);

// An option that may be repeated, with one word each.
void add_list(CLI::App& subcommand, const std::string& name, const std::string& type,
              std::vector<std::string>& words, const std::string& help);

// --on-existing for subcommands without incremental results: fail, overwrite.
void add_on_existing(CLI::App& subcommand, const std::string& help, io::OnExisting& on_existing);

// find_chain() with --relative-to.
Result<ChainText> find_chain_of(const Options& options);
// The chain with its diagnostics; the images that its camera names are not read. Errors: there is
// no such file.
Result<ChainFile> read_chain_of(const Options& options);
// Prints every diagnostic; the returned error is already printed.
Result<ChainFile> load_chain_of(const Options& options);
// Settings of options.job; `notes` gets the diagnostics of its camera file, errors too.
Result<sequence::RunSettings> read_settings(const Options& options, Diagnostics& notes);
// Prints the diagnostics of its camera file.
Result<sequence::RunSettings> run_settings_of(const Options& options);
// sequence::choose_device() with --device and --threads.
Result<egl::ContextOptions> choose_device(const Options& options);
Result<std::unique_ptr<egl::Context>> context_of(const Options& options);

inline constexpr const char* kVersion = POSTCHAIN_VERSION;

}  // namespace postchain
