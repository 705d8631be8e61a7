// Bench results on disk: one small JSON file with its key per variant and frame, and one per
// timing. Files appear complete or not at all.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/measure/report/report.h"

namespace postchain::experiment {

struct FrameResult {
    std::map<std::string, double> metrics;
    std::optional<report::ErrorSplit> split;
    std::vector<Elision> elisions;
};

class BenchStore {
  public:
    // `conditions`: everything a result depends on except chain and frame (device, settings).
    BenchStore(std::string folder, std::string conditions, io::OutputFiles files);
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
    Status save(const std::string& path, const std::string& text) const;
    std::string folder_;
    std::string conditions_;
    io::OutputFiles files_;
};

}  // namespace postchain::experiment
