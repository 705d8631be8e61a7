// Times one step of the work.
#pragma once

#include <chrono>

namespace postchain::sequence {

using Clock = std::chrono::steady_clock;

inline double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace postchain::sequence
