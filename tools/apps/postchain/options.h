// The options that verbs share, and how they become settings.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "chain/gl/context.h"
#include "config/chain_file.h"
#include "tools/sequence/run/runner.h"

namespace CLI {
class App;
}

namespace postchain {

// As typed. One instance serves every verb: a process runs one verb.
struct Options {
    std::string chain;   // file or shipped name
    std::string input;   // -i
    std::string output;  // -o
    std::string frames;
    std::string cuts;
    std::vector<std::string> sets;
    std::string camera;
    std::string profile;
    std::string layer;
    std::string view;
    std::string precision = "fp32";
    std::string device = "auto";
    std::string on_existing = "fail";
    std::string missing = "error";
    std::string on_error = "stop";
    std::string overflow = "refuse";
    std::string nonfinite = "zero";
    std::string no_elide;  // empty, "all", or names of rules with commas
    std::string elide;     // empty, or names of rules with commas
    bool strict = false;
    bool no_sidecar = false;
    bool png = false;
    int threads = 0;
    std::string dump_stages;
    bool verbose = false;
    bool quiet = false;
    std::string log_format = "text";
    bool json = false;
};

void add_logging(CLI::App& verb, Options& options);
void add_chain(CLI::App& verb, Options& options);    // CHAIN, --set
void add_input(CLI::App& verb, Options& options);    // -i, --frames, --camera, --profile, ...
void add_plan(CLI::App& verb, Options& options);     // --precision, --no-elide, --elide
void add_device(CLI::App& verb, Options& options);   // --device, --threads
void add_writing(CLI::App& verb, Options& options);  // -o, --on-existing, --on-error, ...

// Prints every diagnostic; when the file is invalid, the status has been said already.
Result<ChainFile> load_chain_of(const Options& options);
Result<PlanOptions> plan_options_of(const Options& options);
// Everything but `output` and the writing policies.
Result<sequence::RunSettings> input_settings_of(const Options& options);
Result<sequence::RunSettings> run_settings_of(const Options& options);
// Applies --threads to OpenEXR and to the software renderer, and reads --device.
Result<gl::ContextOptions> context_options_of(const Options& options);
Result<std::unique_ptr<gl::Context>> context_of(const Options& options);
int threads_of(const Options& options);

// "llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6"
std::string renderer_text(const gl::Context& context);

inline constexpr const char* kVersion = POSTCHAIN_VERSION;

}  // namespace postchain
