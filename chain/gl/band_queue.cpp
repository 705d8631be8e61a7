#include "chain/gl/band_queue.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "chain/plan/bands.h"

namespace postchain::gl {
namespace {

constexpr double kBandMs = 40;

constexpr auto kAskAgain = std::chrono::milliseconds(1);

// The part of a band of kBandTaps that the first one of a dispatch has: a software renderer is
// slower than any GPU, by about this much.
constexpr double kFirstBand = 1.0 / 32;

// Sizes of neighboring bands differ by these factors at most: blocks of a frame cost differently,
// and a program's first dispatch may also compile it.
constexpr double kShrink = 0.25, kGrow = 2;

double milliseconds(std::chrono::duration<double, std::milli> time) {
    return time.count();
}

}  // namespace

BandQueue::BandQueue(bool software, ContinueCallback ask, Meanwhile meanwhile)
    : software_(software),
      least_(software_ ? std::max(1u, std::thread::hardware_concurrency()) : 1),
      ask_(std::move(ask)),
      meanwhile_(std::move(meanwhile)) {}

void BandQueue::begin_dispatch(double taps_of_group) {
    ++dispatch_;
    groups_ = std::max(kFirstBand * kBandTaps / taps_of_group, least_);
}

Status BandQueue::band_begins() {
    for (RunDecision decision; ask_ && (decision = ask_()) != RunDecision::go_on;) {
        if (decision == RunDecision::stop)
            return Status(StatusCode::canceled, "stopped while it was filtered");
        while (!queued_.empty()) wait_for_first();
        const auto since = Clock::now();
        std::this_thread::sleep_for(kAskAgain);
        waited_ms_ += milliseconds(Clock::now() - since);
    }
    begun_ = Clock::now();
    return Status();
}

void BandQueue::band_ends(unsigned groups) {
    queued_.push_back({Fence::here(), begun_, groups, dispatch_});
    glFlush();
    while (queued_.size() > (software_ ? 0u : 1u)) wait_for_first();
}

void BandQueue::wait_for_first() {
    Queued first = std::move(queued_.front());
    queued_.pop_front();
    first.fence.wait(meanwhile_);
    const auto begun = std::max(first.begun, last_);
    last_ = Clock::now();
    const double ms = milliseconds(last_ - begun);
    if (first.dispatch == dispatch_) resize(first.groups / std::max(ms, 1e-3));
}

void BandQueue::resize(double groups_per_ms) {
    const double wanted = kBandMs * groups_per_ms;
    groups_ = std::max(std::clamp(wanted, kShrink * groups_, kGrow * groups_), least_);
    // Each thread of a software renderer takes an equal part.
    groups_ = least_ * std::floor(groups_ / least_);
}

}  // namespace postchain::gl
