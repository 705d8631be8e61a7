// Times a plan by the rules of docs/performance.md: warm-up, repetitions, median and spread, with
// the source named; times are marked unreliable if other processes kept the machine busy.
#pragma once

#include <chrono>

#include "chain/gl/executor.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

inline constexpr int kWarmUps = 1;  // the first dispatch compiles
// Share of all cores, used by other programs, from which times are unreliable.
inline constexpr double kBusyShare = 0.1;

// Processor seconds used by other processes since construction, from /proc/stat.
class BusyMeter {
  public:
    BusyMeter();
    double others_s() const;      // 0 if unknown
    double others_share() const;  // as a fraction of what all cores could have given

  private:
    std::chrono::steady_clock::time_point start_;
    double busy_s_ = 0;
    double own_s_ = 0;
};

// Runs the plan on `planes` repeats + warm_ups times. Nothing else in this process may run at the
// same time. Transfers are not counted. Errors: gl.
Result<report::Timing> time_plan(Executor& executor, const Plan& plan, PlaneView planes,
                                 int repeats, int warm_ups = kWarmUps);

}  // namespace postchain::experiment
