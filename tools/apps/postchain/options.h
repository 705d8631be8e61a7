// The options that verbs share. Those of a job are made from its table.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "config/chain_file.h"
#include "tools/sequence/run/job_settings.h"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace postchain {

// As typed. One instance serves every verb: a process runs one verb.
struct Options {
    std::string chain;  // file or shipped name
    std::vector<std::string> sets;
    std::string like;             // of run
    std::string recorded_chain;   // text, in place of `chain`
    std::string recorded_camera;  // text, in place of job.camera
    sequence::JobSettings job;
    std::string device = "auto";
    int threads = 0;
    bool verbose = false;
    bool quiet = false;
    std::string log_format = "text";
    std::string progress = "terminal";
    bool json = false;
    bool camera_metadata = false;  // of inspect: the table of the attributes
};

void add_logging(CLI::App& verb, Options& options);
void add_chain(CLI::App& verb, Options& options);   // CHAIN, --set
void add_device(CLI::App& verb, Options& options);  // --device, --threads
// --progress, of the verbs that a farm runs. A verb that prints JSON has its --json already.
void add_progress(CLI::App& verb, Options& options);

// An empty word is a shell variable that was not set; no option and no argument takes it.
void refuse_empty_words(CLI::App& verb);

// Refuses what is no number or outside the range, in the words of CLI::Range.
CLI::Validator number_within(double least, double most);

// The table of Options::job, over the built-in passes.
const ParameterTable& job_parameters();

// One option for a row of a table: its name, type, choices, range, default and help. `settings` is
// the table's struct and outlives the verb. A boolean that is true by default becomes --no-KEY.
void add_setting(CLI::App& verb, const Parameter& row, ParameterRef settings);
// Those of one group.
void add_settings(CLI::App& verb, const ParameterTable& table, const std::string& group,
                  ParameterRef settings);

// --on-existing of a verb that keeps no earlier results: fail, overwrite.
void add_on_existing(CLI::App& verb, const std::string& help, io::OnExisting& on_existing);

// Prints every diagnostic; when the file is invalid, the status has been said already.
Result<ChainFile> load_chain_of(const Options& options);
// Those of options.job, with what its camera file's reader has to say printed.
Result<sequence::RunSettings> run_settings_of(const Options& options);
// As of sequence::context_options_of(), with --device and --threads.
Result<egl::ContextOptions> context_options_of(const Options& options);
Result<std::unique_ptr<egl::Context>> context_of(const Options& options);
int threads_of(const Options& options);

inline constexpr const char* kVersion = POSTCHAIN_VERSION;

}  // namespace postchain
