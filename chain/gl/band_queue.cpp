#include "chain/gl/band_queue.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "chain/bands.h"

namespace postchain::gl {
namespace {

constexpr double kBandMs = 40;

// The part of a band of kBandTaps that the first one of a dispatch has: a software renderer is
// slower than any GPU, by about this much.
constexpr double kFirstBand = 1.0 / 32;

// Sizes of neighboring bands differ by these factors at most: blocks of a frame cost differently,
// and a program's first dispatch may also compile it.
constexpr double kShrink = 0.25, kGrow = 2;

}  // namespace

BandQueue::BandQueue(bool software, std::function<bool()> stop, Meanwhile meanwhile)
    : software_(software),
      least_(software_ ? std::max(1u, std::thread::hardware_concurrency()) : 1),
      stop_(std::move(stop)),
      meanwhile_(std::move(meanwhile)) {}

void BandQueue::begin_dispatch(double taps_of_group) {
    ++dispatch_;
    groups_ = std::max(kFirstBand * kBandTaps / taps_of_group, least_);
}

void BandQueue::band_begins() {
    begun_ = Clock::now();
}

Status BandQueue::band_ends(unsigned groups) {
    queued_.push_back({Fence::here(), begun_, groups, dispatch_});
    glFlush();
    while (queued_.size() > (software_ ? 0u : 1u)) wait_for_first();
    if (stop_ && stop_()) return Status(StatusCode::canceled, "stopped while it was filtered");
    return Status();
}

void BandQueue::wait_for_first() {
    Queued first = std::move(queued_.front());
    queued_.pop_front();
    first.fence.wait(meanwhile_);
    const auto begun = std::max(first.begun, last_);
    last_ = Clock::now();
    const double ms = std::chrono::duration<double, std::milli>(last_ - begun).count();
    if (first.dispatch == dispatch_) resize(first.groups / std::max(ms, 1e-3));
}

void BandQueue::resize(double groups_per_ms) {
    const double wanted = kBandMs * groups_per_ms;
    groups_ = std::max(std::clamp(wanted, kShrink * groups_, kGrow * groups_), least_);
    // Each thread of a software renderer takes an equal part.
    groups_ = least_ * std::floor(groups_ / least_);
}

}  // namespace postchain::gl
