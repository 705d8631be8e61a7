// Results of bench on disk: one small JSON file with its key per variant and frame, and one per
// timing. Equal keys mean equal results. Files appear complete or not at all.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/measure/experiment/experiment_input.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

struct FrameResult {
    std::map<std::string, double> metrics;
    std::optional<report::ErrorSplit> split;
    std::vector<Elision> elisions;
    std::vector<float> slice;  // RGB of report::Slice; empty: none
};

class ResultStore {
  public:
    // `conditions`: everything a result depends on except chain and frame (device, settings).
    ResultStore(std::string folder, std::string conditions, io::OutputFiles files);
    Status prepare() const;  // creates DIR/results; errors (output)

    // `work`: chain and input of this frame. Empty if there is no result with this key.
    std::optional<FrameResult> frame(const std::string& name, int frame,
                                     const std::string& work) const;
    std::optional<report::Timing> timing(const std::string& name, const std::string& work) const;
    Status keep(const std::string& name, int frame, const std::string& work,
                const FrameResult& result) const;
    Status keep(const std::string& name, const std::string& work,
                const report::Timing& timing) const;

  private:
    std::string path(const std::string& name) const;
    std::string key(const std::string& work) const;
    std::string folder_;
    std::string conditions_;
    io::OutputFiles files_;
};

// Everything a result depends on except chain and input files. `rules`: of elision, that are used.
std::string conditions_of(const report::Report& report, const ExperimentSettings& settings,
                          const RuleNames& rules);

// Key part for the chain and this frame's input and ground truth files, with the previous frame's
// if a difference over time is measured. `more`: further conditions. Errors (input): files that
// cannot be read.
Result<std::string> key_of_result(const Chain& chain, int frame, const std::string& more,
                                  const ExperimentSettings& settings, const ExperimentInput& input);

}  // namespace postchain::experiment
