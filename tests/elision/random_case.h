// Random chains on random frames, each from one number.
#pragma once

#include <cstdint>
#include <string>

#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "tests/support/random.h"

namespace postchain::test {

// Cases that follow each other share passes and whatever a program is compiled for, and differ in
// all numbers: compiling takes much longer than running.
inline constexpr int kCasesOfAShape = 75;

struct RandomCase {
    Chain chain;
    FrameDescription frame;
    FramePlanes planes;
    PlanOptions elided;  // some rules off in one case of four
    std::string text;    // chain, frame, rules: for a failure's message
};

// The same for the same seed on every machine.
RandomCase random_case(uint64_t seed);

}  // namespace postchain::test
