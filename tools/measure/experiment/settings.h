// Settings of ab and bench, and the tables from which a command makes their options. Settings of
// the run itself have their own rows (tools/sequence/settings/job_settings.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/base/parameter.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/experiment/temporal_stability.h"
#include "tools/metrics/flip.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::experiment {

struct ExperimentSettings {
    sequence::RunSettings run;  // input, frames, source, plan options, missing, version
    std::string input;          // as typed
    std::string truth;          // as typed; empty = none given
    std::string truth_is;       // its name in the report; empty = as typed
    std::string no_truth;       // why there is none; empty = none was given
    // Lens and shutter of a generated one, by frame; empty = not generated.
    std::map<int, Camera> truth_cameras;
    std::string folder;  // the report's folder; created if it does not exist
    std::string assets;  // folder of the page's images; empty = embedded
    io::OnExisting on_existing = io::OnExisting::fail;  // for an existing report
    bool resumes = false;                               // skip: continues an earlier report
    std::vector<std::string> command;
    int threads = 0;  // CPU threads, stated in the report; 0 = one per core
    std::string renderer;
    bool software = false;
    int repeats = 5;                          // repetitions of each timing
    int page_frames = 8;                      // maximum number of frames whose images are kept
    int stability_frames = kStabilityFrames;  // maximum number measured for flicker and grid
    metrics::FlipSettings flip;
};

struct BenchSettings : ExperimentSettings {
    BenchSettings() {
        page_frames = 1;
        on_existing = io::OnExisting::skip;
        resumes = true;
    }
    std::string chain_name;           // "paper"
    int max_variants = kMaxVariants;  // a larger product of the sweeps is refused
    int split_frames = 1;             // frames on which the error is split
    int truth_samples = 256;          // per pixel, for the ground truth of a generated scene
};

// Settings that are not in the tables of an experiment.
struct RunContext {
    sequence::RunSettings run;
    std::string input;                     // as typed
    std::vector<std::string> chain_files;  // as typed
    std::vector<Camera> cameras;           // one per chain; may name aperture images
    std::vector<std::string> command;
    int threads = 0;  // CPU threads; 0 = one per core
};
void complete(ExperimentSettings& settings, RunContext context);

const ParameterTable& flip_parameters();  // over metrics::FlipSettings
// The rows of every measurement, over ExperimentSettings and types derived from it with other
// defaults.
template <class P>
ParameterTableBuilder<P> measuring_rows() {
    ParameterTableBuilder<P> builder;
    builder
        .text(
            "truth", &P::truth,
            {.unit = "TRUTH", .help = "ground truth frames: both.####.exr", .unset_means = "none"})
        .integer("repeats", &P::repeats,
                 {.min = 1, .max = 10000, .help = "repetitions of each timing"})
        .rows(static_cast<metrics::FlipSettings P::*>(&P::flip), flip_parameters());
    return builder;
}

const ParameterTable& ab_parameters();     // over ExperimentSettings
const ParameterTable& bench_parameters();  // over BenchSettings

}  // namespace postchain::experiment
