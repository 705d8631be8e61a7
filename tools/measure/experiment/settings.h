// What ab and bench are told, and the tables of it from which a command makes its options. What
// concerns the run of the frames has rows of its own (tools/sequence/run/job_settings.h).
#pragma once

#include <string>
#include <vector>

#include "chain/parameter.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/metrics/flip.h"
#include "tools/sequence/run/run_settings.h"

namespace postchain::experiment {

struct ExperimentSettings {
    sequence::RunSettings run;  // input, frames, source, plan options, missing, version
    std::string input;          // as typed
    std::string truth;          // as typed; empty: none given
    std::string truth_is;       // what the report calls it; empty: as typed
    std::string no_truth;       // why there is none; empty: none was given
    std::string folder;         // of the report; made when it is not there
    std::string assets;         // of the page's pictures; empty: they are in the page
    io::OnExisting on_existing = io::OnExisting::fail;  // of a report that is there
    bool resumes = false;                               // skip: an earlier report is continued
    std::vector<std::string> command;
    int threads = 0;  // of this process, as the report says; 0 = one per core
    std::string renderer;
    bool software = false;
    int repeats = 5;      // of each timing
    int page_frames = 8;  // largest number of frames whose pictures are kept
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
    int truth_samples = 256;          // per pixel, of the truth of a generated scene
};

const ParameterTable& ab_parameters();     // over ExperimentSettings
const ParameterTable& bench_parameters();  // over BenchSettings

}  // namespace postchain::experiment
