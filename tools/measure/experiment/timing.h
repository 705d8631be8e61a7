// Time of one plan, by the rules of docs/benchmarks.md: warm up, repeat, median and spread, source
// named, and mistrusted when something else kept the machine busy meanwhile.
#pragma once

#include <chrono>

#include "chain/gl/executor.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

inline constexpr int kWarmUps = 1;         // the first dispatch compiles
inline constexpr double kBusyShare = 0.1;  // of all cores, by others: times are mistrusted

// Seconds of processor time that other processes took since it was made, by /proc/stat.
class BusyMeter {
  public:
    BusyMeter();
    double others_s() const;      // 0 where it cannot be known
    double others_share() const;  // of what all cores could have given since then

  private:
    std::chrono::steady_clock::time_point start_;
    double busy_s_ = 0;
    double own_s_ = 0;
};

// Runs the plan on `planes` repeats + kWarmUps times. Nothing else of this process may run
// meanwhile. Transfers are not counted. Errors: gl.
Result<report::Timing> time_plan(Executor& executor, const Plan& plan, PlaneView planes,
                                 int repeats);

}  // namespace postchain::experiment
