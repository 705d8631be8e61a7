// Counters served at /metrics in the Prometheus text format. They start at 0 with the process.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tools/sequence/record/frame_report.h"
#include "tools/service/store/job_store.h"

namespace postchain::service {

struct StuckThreads {
    size_t now = 0, ever = 0;
    double oldest_step_s = 0;  // of the running job
};

class Counters {
  public:
    Counters(const std::string& version);
    ~Counters();

    // Callable from any thread; throws nothing.
    void add(const sequence::FrameReport& report) noexcept;
    void set_renderer(const std::string& renderer) noexcept;
    void waited_for_previews(double seconds) noexcept;            // the running job
    void started(double waited_s) noexcept;                       // a job, for the first time
    void ended(JobKind kind, const std::string& state) noexcept;  // a job
    std::string text(const std::map<JobState, size_t>& jobs, const QueueTimes& times,
                     const std::vector<OwnerUse>& owners, const StuckThreads& stuck) const;

  private:
    struct Families;
    std::unique_ptr<Families> families_;
    mutable std::mutex mutex_;  // of text()
};

}  // namespace postchain::service
