// Bytes that a plan moves through memory: the least time it can take is these over the bandwidth.
//
// Each texture counts once for each step that reads it and once for each that writes it, whole,
// however often and wherever its pixels are fetched: caches hold what is fetched again nearby. A
// block is in one of the work lists that a step fills; all blocks count for the list whose steps
// move most, so that no frame makes a plan move more.
#pragma once

#include <cstdint>
#include <vector>

#include "chain/plan/plan.h"

namespace postchain {

struct StepBytes {
    uint64_t read = 0;
    uint64_t written = 0;
    bool counts = true;  // false: another list takes all of its blocks

    uint64_t moved() const { return counts ? read + written : 0; }
};

// One for each step, of all blocks.
std::vector<StepBytes> bytes_of_steps(const Plan& plan);

// Bytes of a pass, by its index, or of all passes, per pixel of the frame.
double bytes_per_pixel(const Plan& plan, int pass);
double bytes_per_pixel(const Plan& plan);

}  // namespace postchain
