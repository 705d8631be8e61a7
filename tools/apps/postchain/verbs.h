// The verbs of the command. Each takes what was typed and returns the exit code.
#pragma once

#include <string>

#include "tools/apps/postchain/options.h"

namespace postchain {

int run_verb(const Options& options);                              // run.cpp
int plan_verb(const Options& options, const std::string& format);  // describe.cpp
int info_verb(const Options& options);
int schema_verb();
int passes_verb(const std::string& format);
int inspect_verb(const Options& options);  // inspect.cpp

struct SceneOptions {  // scene.cpp
    std::string name;
    std::string folder;
    std::string size = "640x360";
    std::string frames = "1-8";
    int truth_samples = 0;
    bool overwrite = false;
};
int scene_verb(const Options& options, const SceneOptions& scene);

struct DiffOptions {   // diff.cpp
    std::string a, b;  // A is the reference
    std::vector<std::string> metrics;
    std::vector<std::string> maps;
    std::string map_metric = "hdr_flip";
    std::vector<std::string> fail_above;
    double pixels_per_degree = 0;
    std::string tone_mapper = "aces";
};
void add_diff(CLI::App& verb, Options& options, DiffOptions& diff);
int diff_verb(const Options& options, const DiffOptions& diff);

struct ExperimentOptions {  // experiments.cpp
    std::string chain_b;    // of ab; A stands in Options::chain
    std::string truth;
    bool overwrite = false;
    int repeats = 5;
    int page_frames = 0;  // 0: the verb's own default
    std::string assets;
    std::vector<std::string> fail_above;
    double pixels_per_degree = 0;
    std::string tone_mapper = "aces";
    // Of bench:
    std::vector<std::string> sweeps;
    std::vector<std::string> under;
    int max_variants = 64;
    int split_frames = 1;
    int truth_samples = 256;
};
void add_ab(CLI::App& verb, Options& options, ExperimentOptions& experiment);
int ab_verb(const Options& options, const ExperimentOptions& experiment, int argc, char** argv);
void add_bench(CLI::App& verb, Options& options, ExperimentOptions& experiment);
int bench_verb(const Options& options, const ExperimentOptions& experiment, int argc, char** argv);

struct StressOptions {  // stress.cpp
    std::string only;
};
void add_stress(CLI::App& verb, Options& options, StressOptions& stress);
int stress_verb(const Options& options, const StressOptions& stress);

// Man page and bash completion of the whole command, made from its options (completion.cpp).
std::string man_page(const CLI::App& app);
std::string bash_completion(const CLI::App& app);

// Prints the status as an error, unless it has been said already, and returns its exit code.
int fail(const Status& status);
// The same failure for fail() to be silent about: its diagnostics are on stderr.
inline Status already_said(const Status& status) {
    return status.ok() ? status : Status(status.code(), "");
}

}  // namespace postchain
