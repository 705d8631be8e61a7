#include "chain/guest/governor.h"

#include <algorithm>

namespace postchain::guest {

void Governor::add(double milliseconds) {
    times_[frames_++ % kMaxFrames] = milliseconds;
}

double Governor::milliseconds() const {
    const size_t count = std::min(frames_, kMaxFrames);
    if (count == 0) return 0;
    auto sorted = times_;
    const auto middle = sorted.begin() + std::ptrdiff_t(count / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + std::ptrdiff_t(count));
    return *middle;
}

bool Governor::change(double now) {
    if (frames_ < kMinFrames || now - changed_ < kMinSeconds) return false;
    const double time = milliseconds();
    const auto predicted = [&](size_t level) { return time * kParts[level] / part(); };
    size_t next = level_;
    while (next + 1 < kParts.size() && kParts[next + 1] >= least_ && predicted(next) > budget_ms_)
        ++next;
    if (next == level_ && level_ > 0 && predicted(level_ - 1) <= 0.9 * budget_ms_) --next;
    if (next == level_) return false;
    before_ = level_;
    level_ = next;
    frames_ = 0;
    changed_ = now;
    ++changes_;
    return true;
}

}  // namespace postchain::guest
