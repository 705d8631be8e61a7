// The price of a step on a GPU that is not here, from counts and published rates. Good to a factor
// of 1.5 to 2.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "chain/plan/plan.h"
#include "tests/bench/amd_listing.h"

namespace postchain::bench {

inline constexpr double kWave = 32;         // invocations
inline constexpr double kLevelMs = 0.006;   // a level waits for the one before
inline constexpr uint32_t kFetchNs = 500;   // a round of a loop with a dependent fetch
inline constexpr uint32_t kSharedNs = 100;  // and without one
inline constexpr double kLatencyWaves = 8;  // a scheduler with fewer waits for its longest lane

// Published figures; instructions: of a wave, a second.
struct Rates {
    const char* name;
    double instructions, texels, bytes;
    double schedulers;
};
inline constexpr std::array<Rates, 5> kRates = {{
    {"RTX 3060", 199e9, 199e9, 360e9, 112},   // 28 SM x 4 x 1.78 GHz; 112 texture units
    {"RX 6700 XT", 206e9, 413e9, 384e9, 80},  // 40 CU x 2 x 2.58 GHz; 160 texture units
    {"Iris Xe", 32e9, 65e9, 68e9, 96 * 7},    // 96 EU x 1.35 GHz x 8 of 32 lanes; 48 units
    {"H200", 1045e9, 1045e9, 4800e9, 528},    // 132 SM x 4 x 1.98 GHz; 528 units
    {"GTX 480", 21e9, 42e9, 177e9, 30},       // the report's: 15 SM x 32 lanes x 1.4 GHz; 60 units
}};

struct StepCost {
    std::string name;  // "joint_blur.gather"
    double waves = 0;
    std::vector<double> instructions;  // of waves, for each generation; the first one counts
    double texels = 0;                 // of waves, each times texel_cost()
    double bytes = 0;
    double longest_ms = 0;  // latency of the longest wave
    bool waits = false;     // for a level before
    double software = 0;    // wave-instructions on a software renderer, which skips no branch
    double cpu_ms = 0;      // measured there

    double ms(const Rates& on) const;
};

// A fetch of one texel: of 64 bits at most 1, of halves up to 128 bits 2, of 128 bits 4.
double texel_cost(Format format);

// The cost of the texels that a step's waves read.
double fetch_cost(const Plan& plan, const Step& step, const Instructions& all);

// The bytes that a step moves: of each texture at most all, and at most what its waves read or
// write. `share`: the part of the frame's blocks that the step computes.
double moved_bytes(const Plan& plan, const Step& step, const Instructions& all, double share);

// Spearman's; equal values share their ranks.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace postchain::bench
