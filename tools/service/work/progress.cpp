#include "tools/service/work/progress.h"

namespace postchain::service {

void Progress::step(sequence::FrameStep step, int frame, bool begins) {
    const std::lock_guard lock(mutex_);
    if (begins)
        steps_[step] = {frame, Clock::now()};
    else
        steps_.erase(step);
}

void Progress::does(const std::string& what) {
    const std::lock_guard lock(mutex_);
    does_ = what;
    does_since_ = Clock::now();
}

std::optional<Progress::UnderWay> Progress::longest() const {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    std::optional<UnderWay> longest;
    const auto consider = [&](Clock::time_point since, UnderWay under_way) {
        under_way.seconds = std::chrono::duration<double>(now - since).count();
        if (!longest || under_way.seconds > longest->seconds) longest = std::move(under_way);
    };
    for (const auto& [step, one] : steps_)
        consider(one.since,
                 {step, one.frame, concat("frame ", one.frame, " was not ", name_of(step)), 0});
    if (!does_.empty()) consider(does_since_, {std::nullopt, std::nullopt, does_, 0});
    return longest;
}

}  // namespace postchain::service
