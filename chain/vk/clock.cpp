#include "chain/vk/clock.h"

#include <span>

namespace postchain::vk {

Clock::~Clock() {
    for (const Run& run : runs_)
        device_.fn().DestroyQueryPool(device_.handle(), run.pool, device_.allocator());
}

void Clock::forget_runs() {
    for (Run& run : runs_) run.marks = 0;
}

Status Clock::begin(VkCommandBuffer commands, uint32_t slot, uint64_t frame, size_t intervals,
                    bool timed) {
    Run& run = runs_[slot];
    read(run);
    run.marks = 0;
    now_ = &run;
    if (!timed) return Status();
    const Functions& fn = device_.fn();
    const auto needed = uint32_t(intervals + 1);
    if (run.room < needed) {
        fn.DestroyQueryPool(device_.handle(), run.pool, device_.allocator());
        run.pool = VK_NULL_HANDLE;
        run.room = 0;
        auto info = info_of<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
        info.queryType = VK_QUERY_TYPE_TIMESTAMP;
        info.queryCount = needed;
        RETURN_IF_ERROR(
            status_of(fn.CreateQueryPool(device_.handle(), &info, device_.allocator(), &run.pool),
                      "vkCreateQueryPool"));
        run.room = needed;
        run.times.intervals.resize(intervals);
    }
    run.times.frame = frame;
    fn.CmdResetQueryPool(commands, run.pool, 0, run.room);
    fn.CmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, run.pool, run.marks++);
    return Status();
}

void Clock::mark(VkCommandBuffer commands, int pass, std::string_view name) {
    Run& run = *now_;
    if (run.marks == 0) return;
    Times::Interval& interval = run.times.intervals[run.marks - 1];
    interval.pass = pass;
    interval.name.assign(name);
    device_.fn().CmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, run.pool,
                                   run.marks++);
}

void Clock::read(Run& run) {
    if (run.marks == 0) return;
    ticks_.resize(run.marks);
    const VkResult result = device_.fn().GetQueryPoolResults(
        device_.handle(), run.pool, 0, run.marks, ticks_.size() * sizeof(uint64_t), ticks_.data(),
        sizeof(uint64_t), VK_QUERY_RESULT_64_BIT);
    if (result != VK_SUCCESS) return;
    const uint32_t bits = device_.timestamp_bits();
    const uint64_t mask = bits >= 64 ? ~uint64_t(0) : (uint64_t(1) << bits) - 1;
    for (uint32_t i = 0; i + 1 < run.marks; ++i)
        run.times.intervals[i].milliseconds = double((ticks_[i + 1] - ticks_[i]) & mask) *
                                              double(device_.limits().timestampPeriod) * 1e-6;
    newest_.frame = run.times.frame;
    newest_.add_up(std::span(run.times.intervals).first(run.marks - 1));
    known_ = true;
}

}  // namespace postchain::vk
