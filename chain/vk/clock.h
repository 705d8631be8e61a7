// Times of the intervals of runs by timestamps. Those of a run are read when a later run takes its
// place among the runs in flight: it is over then, so nothing waits.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/times.h"
#include "chain/vk/device.h"

namespace postchain::vk {

class Clock {
  public:
    Clock(const Device& device, uint32_t runs_in_flight) : device_(device), runs_(runs_in_flight) {}
    ~Clock();
    Clock(const Clock&) = delete;
    Clock& operator=(const Clock&) = delete;

    // A run that takes this slot, whose last run is over, begins: `intervals` at most will end.
    // Without `timed` it only reads the last run's times. Errors: StatusCode::memory.
    Status begin(VkCommandBuffer commands, uint32_t slot, uint64_t frame, size_t intervals,
                 bool timed);
    // The end of an interval of the run that began last, and the start of the next.
    void mark(VkCommandBuffer commands, int pass, std::string_view name);
    // The newest run whose times were read; null: none.
    const Times* newest() const { return known_ ? &newest_ : nullptr; }
    // A recorded run was never submitted.
    void forget_runs();

  private:
    struct Run {
        VkQueryPool pool = VK_NULL_HANDLE;
        uint32_t room = 0, marks = 0;  // marks: 0 = not timed
        Times times;
    };
    void read(Run& run);

    const Device& device_;
    std::vector<Run> runs_;
    Run* now_ = nullptr;
    Times newest_;
    bool known_ = false;
    std::vector<uint64_t> ticks_;
};

}  // namespace postchain::vk
