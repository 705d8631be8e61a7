// Times of the intervals of a run, by pass or by step of its plan.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace postchain {

struct Times {
    struct Interval {
        int pass = 0;
        std::string name;
        double milliseconds = 0;
    };
    uint64_t frame = 0;
    uint64_t tag = 0;  // the caller's
    std::vector<Interval> intervals;

    double milliseconds() const;  // the sum of all intervals
    // The intervals become these, with those of one pass and name summed at the place of the first.
    void add_up(std::span<const Interval> measured);
};

}  // namespace postchain
