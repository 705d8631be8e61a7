// postchain diff: turns options into work, and reads the pairs to compare.
//
//   DiffOptions --work_of--> DiffWork --read_pair, per frame--> metrics::Pair
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/apps/postchain/options.h"
#include "tools/measure/metrics/compare.h"
#include "tools/sequence/files/output_files.h"

namespace postchain {

// The only metric of more than one pair: mean |change of the error| from frame to frame.
inline constexpr const char* kTde = "tde";
inline constexpr const char* kDefaultMap = "hdr_flip";

struct DiffOptions {
    std::string a, b;  // A is the reference
    std::vector<std::string> metrics;
    std::vector<std::string> maps;
    std::string map_metric;  // empty: not given, kDefaultMap
    io::OnExisting on_existing = io::OnExisting::fail;
    std::vector<std::string> fail_above;
    std::optional<double> pixels_per_degree;  // those of FlipSettings if not given
    std::string tone_mapper;
    std::optional<double> over;
};

struct DiffFrame {
    int number = 0;
    std::string a, b;  // paths
    std::string both() const { return a + " against " + b; }
};

struct DiffWork {
    sequence::SourceSettings source;
    std::vector<DiffFrame> frames;
    bool sequence = false;
    metrics::CompareSettings compare;
    std::optional<double> over;  // gray that both are composited over first
    bool tde = false;
    std::vector<metrics::MetricLimit> limits;
    std::vector<io::PathPattern> maps;
    io::OutputFiles files;  // the maps and the compared inputs

    // As a number or a map.
    bool wants(const char* metric) const {
        return compare.metrics.count(metric) > 0 || compare.map == metric;
    }
};

// Errors: usage; input (frames missing on disk); output (existing maps).
Result<DiffWork> work_of(const Options& options, const DiffOptions& diff);

// The color of both files, composited over the gray if given. Errors (input) name both files: no
// color, unreadable, different windows.
Result<metrics::Pair> read_pair(const DiffWork& work, const DiffFrame& frame);
Result<metrics::RgbImage> read_reference(const DiffWork& work, const DiffFrame& frame);

}  // namespace postchain
