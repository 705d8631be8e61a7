// Times stretches of GL work by the rules of spec metrics.md: TIMESTAMP pairs on a GPU, read only
// when ready; the wall clock around glFinish on a software renderer, whose timers are wrong by
// orders of magnitude. Every time is tagged with its source.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace postchain::gl {

class Context;

class Clock {
  public:
    explicit Clock(const Context& context);
    ~Clock();
    const char* source() const { return software_ ? "wall clock around glFinish" : "GL_TIMESTAMP"; }

    void begin();                // start of a sequence of marks
    void mark();                 // end of one stretch, start of the next
    std::vector<double> read();  // milliseconds of each stretch; waits for the device

  private:
    bool software_;
    std::vector<std::chrono::steady_clock::time_point> walls_;
    std::vector<unsigned> queries_;
    size_t used_ = 0;
};

}  // namespace postchain::gl
