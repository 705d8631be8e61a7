#include "chain/plan/times.h"

#include <algorithm>

namespace postchain {

double Times::milliseconds() const {
    double sum = 0;
    for (const Interval& interval : intervals) sum += interval.milliseconds;
    return sum;
}

void Times::add_up(std::span<const Interval> measured) {
    size_t count = 0;
    for (const Interval& interval : measured) {
        const auto end = intervals.begin() + std::ptrdiff_t(count);
        const auto known = std::find_if(intervals.begin(), end, [&](const Interval& other) {
            return other.pass == interval.pass && other.name == interval.name;
        });
        if (known != end) {
            known->milliseconds += interval.milliseconds;
            continue;
        }
        if (count == intervals.size()) intervals.emplace_back();
        intervals[count++] = interval;
    }
    intervals.resize(count);
}

}  // namespace postchain
