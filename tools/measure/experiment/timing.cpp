#include "tools/measure/experiment/timing.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <thread>

#include "tools/measure/experiment/statistics.h"

namespace postchain::experiment {
namespace {

// Processor seconds of the whole machine since boot; negative if unknown.
double busy_seconds() {
    std::ifstream file("/proc/stat");
    std::string word;
    double user, nice, system, idle, wait, interrupts, soft, steal;
    if (!(file >> word >> user >> nice >> system >> idle >> wait >> interrupts >> soft >> steal))
        return -1;
    return (user + nice + system + interrupts + soft + steal) / double(sysconf(_SC_CLK_TCK));
}

double own_seconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * t.tv_usec; };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

BusyMeter::BusyMeter()
    : start_(std::chrono::steady_clock::now()), busy_s_(busy_seconds()), own_s_(own_seconds()) {}

double BusyMeter::others_s() const {
    const double busy = busy_seconds();
    if (busy < 0 || busy_s_ < 0) return 0;
    // The kernel counts in ticks of 10 ms.
    return std::max(0.0, (busy - busy_s_) - (own_seconds() - own_s_) - 0.02);
}

double BusyMeter::others_share() const {
    const double cores = std::max(1u, std::thread::hardware_concurrency());
    return others_s() / std::max(1e-3, seconds_since(start_) * cores);
}

Result<report::Timing> time_plan(Executor& executor, const Plan& plan, PlaneView planes,
                                 int repeats, int warm_ups) {
    report::Timing timing;
    timing.frame = plan.frame_number;
    timing.source = executor.timing_source();
    std::vector<std::vector<double>> of_pass(plan.passes.size());
    std::vector<double> totals;
    executor.set_timing(true);
    for (int i = 0; i < warm_ups; ++i) RETURN_IF_ERROR(executor.filter(plan, planes).status());
    const BusyMeter busy;
    for (int i = 0; i < repeats; ++i) {
        RETURN_IF_ERROR(executor.filter(plan, planes).status());
        const auto times = executor.pass_times();
        if (times.empty() && !plan.steps.empty())
            return Status(StatusCode::gl, "the timers were not ready after the read-back");
        double total = 0;
        for (const PassTime& time : times) {
            of_pass[size_t(time.pass)].push_back(time.milliseconds);
            total += time.milliseconds;
        }
        totals.push_back(total);
    }
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        report::PassCost cost;
        cost.pass = concat(i, ".", plan.passes[i].type);
        cost.elided = plan.passes[i].elided;
        if (!of_pass[i].empty()) cost.time = time_figure(std::move(of_pass[i]));
        timing.passes.push_back(std::move(cost));
    }
    timing.total = time_figure(std::move(totals));
    if (const double share = busy.others_share(); share > kBusyShare) {
        timing.trustworthy = false;
        timing.why_not =
            concat("other processes took ", int(100 * share + 0.5), " % of all cores meanwhile");
    }
    return timing;
}

}  // namespace postchain::experiment
