#include "tools/service/work/device_gate.h"

namespace postchain::service {

void DeviceGate::enter(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (holds_++ == 0 && now - ended_ >= job_) first_ = now;
    begun_ = now;
}

void DeviceGate::leave(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (--holds_ == 0) ended_ = now;
}

Turn DeviceGate::ask(Clock::time_point now) const {
    const std::lock_guard lock(mutex_);
    const bool waits =
        holds_ > 0 && now - begun_ < kMaxHold && (now - first_) % (previews_ + job_) < previews_;
    return waits ? Turn::wait : Turn::go_on;
}

}  // namespace postchain::service
