// Times intervals of GL work by the rules of docs/performance.md: TIMESTAMP pairs on a GPU, read
// only when ready; the wall clock around glFinish on a software renderer, whose timers are wrong by
// orders of magnitude. Every time is tagged with its source.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "chain/gl/device.h"
#include "chain/plan/times.h"

namespace postchain::gl {

class Clock {
  public:
    explicit Clock(const Device& device);
    ~Clock();
    Clock(const Clock&) = delete;
    Clock& operator=(const Clock&) = delete;
    const char* source() const { return software_ ? "wall clock around glFinish" : "GL_TIMESTAMP"; }

    void begin(uint64_t frame, uint64_t tag = 0);  // start of a sequence of marks
    // End of an interval and start of the next: "pass", or "pass.step".
    void mark(int pass, std::string_view name, std::string_view step = {});
    // Subtracts a time from the interval that is running: the device was left to other work.
    void leave_out(double milliseconds);
    // The newest sequence that the device has finished, with intervals of the same pass and name
    // summed at the place of the first; null: none. Never waits.
    const Times* newest();
    // Likewise among the sequences with these tags.
    const Times* newest(std::span<const uint64_t> tags);
    // The sequence that was begun last is forgotten.
    void cancel();
    // Its queries went with their context.
    void abandon();

  private:
    // A sequence is written over only after the others have been: a device may be that many frames
    // behind.
    static constexpr size_t kSequences = 8;
    struct Sequence {
        Times times;
        size_t marks = 0;  // 0: none; the first is its start
        std::vector<unsigned> queries;
        std::vector<std::chrono::steady_clock::time_point> walls;
        std::vector<double> left_out;  // ms of each interval; may be shorter
    };
    void take();
    bool read(Sequence& sequence);
    template <class Wanted>
    const Times* newest_of(const Wanted& wanted);

    bool software_;
    std::array<Sequence, kSequences> sequences_;
    size_t current_ = 0;
    Times newest_;
};

}  // namespace postchain::gl
