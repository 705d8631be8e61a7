// Tests the differences between the variants of an ab report and describes them in words.
#pragma once

#include <map>
#include <string>

#include "tools/measure/experiment/statistics.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

inline constexpr uint64_t kBootstrapSeed = 20131101;
inline constexpr int kBootstrapReplicates = 2000;
inline constexpr int kBootstrapTilePx = 32;

// Computes report.comparison from the variants' series and the tiles, by metric.

report::Comparison compare_variants(const report::Report& report,
                                    const std::map<std::string, TileBootstrap>& tiles);

}  // namespace postchain::experiment
