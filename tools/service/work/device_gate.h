// Previews go first on the device: while one has reserved it, the running job waits before its next
// band (chain/gl/band_queue.h). Thread-safe.
#pragma once

#include <chrono>
#include <mutex>
#include <set>

#include "chain/gl/band_queue.h"

namespace postchain::service {

class DeviceGate {
  public:
    using Clock = std::chrono::steady_clock;
    // If previews follow each other without a pause, the job has the device after this time, for a
    // quarter of it.
    static constexpr auto kPreviews = std::chrono::milliseconds(1000);
    // A preview that takes longer hangs, or is as long as a frame of the job: the job goes on.
    static constexpr auto kMaxReservation = std::chrono::seconds(60);

    explicit DeviceGate(Clock::duration previews = kPreviews)
        : previews_(previews), job_(previews / 4) {}

    class Reservation {
      public:
        explicit Reservation(DeviceGate& gate) : gate_(gate), begun_(Clock::now()) {
            gate_.enter(begun_);
        }
        ~Reservation() { gate_.leave(begun_, Clock::now()); }
        Reservation(const Reservation&) = delete;
        Reservation& operator=(const Reservation&) = delete;

      private:
        DeviceGate& gate_;
        const Clock::time_point begun_;
    };

    // The job's question: RunDecision::go_on or RunDecision::wait.
    RunDecision ask(Clock::time_point now = Clock::now()) const {
        const std::lock_guard lock(mutex_);
        const bool waits = !reservations_.empty() &&
                           now - *reservations_.rbegin() < kMaxReservation &&
                           (now - first_) % (previews_ + job_) < previews_;
        return waits ? RunDecision::wait : RunDecision::go_on;
    }

    // Reservation calls these two.
    void enter(Clock::time_point now) {
        const std::lock_guard lock(mutex_);
        if (reservations_.empty() && now - ended_ >= job_) first_ = now;
        reservations_.insert(now);
    }
    void leave(Clock::time_point begun, Clock::time_point now) {
        const std::lock_guard lock(mutex_);
        reservations_.erase(reservations_.find(begun));
        if (reservations_.empty()) ended_ = now;
    }

  private:
    const Clock::duration previews_, job_;
    mutable std::mutex mutex_;
    std::multiset<Clock::time_point> reservations_;  // when each began
    Clock::time_point first_;                        // since when previews follow each other
    Clock::time_point ended_;                        // the last reservation
};

}  // namespace postchain::service
