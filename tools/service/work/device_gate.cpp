#include "tools/service/work/device_gate.h"

namespace postchain::service {

void DeviceGate::enter(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (reservations_.empty() && now - ended_ >= job_) first_ = now;
    reservations_.insert(now);
}

void DeviceGate::leave(Clock::time_point begun, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    reservations_.erase(reservations_.find(begun));
    if (reservations_.empty()) ended_ = now;
}

RunDecision DeviceGate::ask(Clock::time_point now) const {
    const std::lock_guard lock(mutex_);
    const bool waits = !reservations_.empty() && now - *reservations_.rbegin() < kMaxReservation &&
                       (now - first_) % (previews_ + job_) < previews_;
    return waits ? RunDecision::wait : RunDecision::go_on;
}

}  // namespace postchain::service
