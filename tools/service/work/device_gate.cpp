#include "tools/service/work/device_gate.h"

namespace postchain::service {

void DeviceGate::enter(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (holds_.empty() && now - ended_ >= job_) first_ = now;
    holds_.insert(now);
}

void DeviceGate::leave(Clock::time_point begun, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    holds_.erase(holds_.find(begun));
    if (holds_.empty()) ended_ = now;
}

RunDecision DeviceGate::ask(Clock::time_point now) const {
    const std::lock_guard lock(mutex_);
    const bool waits = !holds_.empty() && now - *holds_.rbegin() < kMaxHold &&
                       (now - first_) % (previews_ + job_) < previews_;
    return waits ? RunDecision::wait : RunDecision::go_on;
}

}  // namespace postchain::service
