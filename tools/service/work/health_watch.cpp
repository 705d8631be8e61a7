#include "tools/service/work/health_watch.h"

#include <optional>

namespace postchain::service {
namespace {

constexpr auto kPeriod = std::chrono::seconds(1);
constexpr auto kLate = std::chrono::seconds(15);  // after the last look

}  // namespace

HealthWatch::HealthWatch(std::function<WatchedHealth()> look)
    : look_(std::move(look)), thread_(1, 1, std::chrono::hours(24)) {}

Status HealthWatch::begin() {
    last_ = look_();
    looked_ = Clock::now();
    RETURN_IF_ERROR(thread_.begin());
    (void)thread_.run([this] { loop(); });
    return Status();
}

void HealthWatch::loop() {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, kPeriod, [&] { return ends_; })) {
        lock.unlock();
        std::optional<WatchedHealth> now;
        try {
            now = look_();
        } catch (...) {
            // Out of memory. The next look may succeed.
        }
        lock.lock();
        if (!now) continue;
        last_ = std::move(*now);
        looked_ = Clock::now();
    }
}

size_t HealthWatch::end() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    changed_.notify_all();
    return thread_.end();
}

WatchedHealth HealthWatch::last(int64_t& late_s) const {
    const std::lock_guard lock(mutex_);
    const auto since = Clock::now() - looked_;
    late_s = since > kLate ? std::chrono::duration_cast<std::chrono::seconds>(since).count() : 0;
    return last_;
}

}  // namespace postchain::service
