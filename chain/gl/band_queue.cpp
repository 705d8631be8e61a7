#include "chain/gl/band_queue.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "chain/plan/bands.h"

namespace postchain::gl {
namespace {

constexpr double kWantedMs = 40;

constexpr auto kAskAgain = std::chrono::milliseconds(1);

// The first band of a program that was not measured, in ms of kUnknownRate: a software renderer is
// slower than any GPU, by about this much.
constexpr double kFirstMs = kLeastBandMs, kFirstSoftwareMs = kBandMs / 32;

// Sizes of neighboring bands differ by these factors at most: blocks of a frame cost differently,
// and a program's first dispatch may also compile it.
constexpr double kShrink = 0.25, kGrow = 2;

double milliseconds(std::chrono::duration<double, std::milli> time) {
    return time.count();
}

}  // namespace

BandQueue::BandQueue(bool software, BandTimer& timer, ContinueCallback ask, Meanwhile meanwhile)
    : software_(software),
      timer_(timer),
      least_(software_ ? std::max(1u, std::thread::hardware_concurrency()) : 1),
      ask_(std::move(ask)),
      meanwhile_(std::move(meanwhile)) {}

// Waits until the last band has ended, so that the next run begins after it.
BandQueue::~BandQueue() {
    while (!queued_.empty()) wait_for_first();
}

void BandQueue::begin_dispatch(unsigned program, double taps_of_group, double most_rate) {
    ++next_.dispatch;
    next_.program = program;
    next_.taps_of_group = taps_of_group;
    next_.most_rate = most_rate;
    const double first_ms = timer_.rates.knows(program) ? kWantedMs
                            : software_                 ? kFirstSoftwareMs
                                                        : kFirstMs;
    set_groups(first_ms * timer_.rates.of(program) / taps_of_group);
}

// Each thread of a software renderer takes an equal part.
void BandQueue::set_groups(double groups) {
    groups_ = std::max(least_ * std::floor(groups / least_), least_);
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
    next_.span = timer_.begin();
    return Status();
}

void BandQueue::band_ends(unsigned groups) {
    timer_.end(next_.span);
    queued_.push_back({Fence::here(), next_.span, groups, next_.dispatch, next_.program,
                       next_.taps_of_group, next_.most_rate});
    glFlush();
    while (queued_.size() > (software_ ? 0u : 1u)) wait_for_first();
}

void BandQueue::wait_for_first() {
    Queued first = std::move(queued_.front());
    queued_.pop_front();
    first.fence.wait(meanwhile_);
    const double ms = std::max(timer_.ms(first.span), 1e-3);
    timer_.rates.add(first.program, first.groups * first.taps_of_group, ms, first.most_rate);
    if (first.dispatch == next_.dispatch && first.groups > 0) resize(first.groups / ms);
}

void BandQueue::resize(double groups_per_ms) {
    set_groups(std::clamp(kWantedMs * groups_per_ms, kShrink * groups_, kGrow * groups_));
}

}  // namespace postchain::gl
