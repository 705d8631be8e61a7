// Chooses the part of a chain's samples that keeps its frames within a time. Pure: times go in,
// a part comes out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace postchain::guest {

class Governor {
  public:
    static constexpr std::array<double, 5> kParts = {1, 0.75, 0.5, 0.375, 0.25};
    static constexpr double kMinSeconds = 0.5;  // between two changes

    // `least`: the smallest part it may choose.
    explicit Governor(double budget_ms, double least) : budget_ms_(budget_ms), least_(least) {}

    // The time of a frame that ran with the present part.
    void add(double milliseconds);
    // Changes the part if the times since the last change ask for it; true if it did. It goes down
    // to the first part that fits if times follow the samples, and up by one part if that fits with
    // a tenth to spare. `now`: seconds, of any origin.
    bool change(double now);

    // Takes the last change() back. It is tried again as if it had been made.
    void take_back() { level_ = before_; }

    double part() const { return kParts[level_]; }
    double budget_ms() const { return budget_ms_; }
    // The median time at the present part; 0: not known yet.
    double milliseconds() const;
    uint64_t changes() const { return changes_; }

  private:
    static constexpr size_t kMinFrames = 4, kMaxFrames = 8;

    double budget_ms_, least_;
    size_t level_ = 0, before_ = 0;              // before_: of the last change
    std::array<double, kMaxFrames> times_ = {};  // the newest, in no order
    size_t frames_ = 0;                          // since the last change
    double changed_ = -1e30;                     // when
    uint64_t changes_ = 0;
};

}  // namespace postchain::guest
