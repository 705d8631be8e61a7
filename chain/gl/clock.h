// Times intervals of GL work by the rules of docs/benchmarks.md: TIMESTAMP pairs on a GPU, read
// only when ready; the wall clock around glFinish on a software renderer, whose timers are wrong by
// orders of magnitude. Every time is tagged with its source.
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <vector>

#include "chain/gl/device.h"

namespace postchain::gl {

class Clock {
  public:
    explicit Clock(const Device& device);
    ~Clock();
    const char* source() const { return software_ ? "wall clock around glFinish" : "GL_TIMESTAMP"; }

    void begin();  // start of a sequence of marks
    void mark();   // end of one stretch, start of the next
    // Milliseconds of each interval of the last sequence; nothing until the device is done. Never
    // waits.
    std::optional<std::vector<double>> read_if_ready() const;

  private:
    // A set of queries is used again only after the other sets have been: a frame that is still
    // under way keeps its own.
    static constexpr size_t kSets = 4;
    struct Set {
        std::vector<unsigned> queries;
        size_t used = 0;
    };

    bool software_;
    std::vector<std::chrono::steady_clock::time_point> walls_;
    std::array<Set, kSets> sets_;
    size_t current_ = 0;
};

}  // namespace postchain::gl
