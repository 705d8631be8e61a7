// Counters served at /metrics in the Prometheus text format. They start at 0 with the process.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "tools/sequence/run/frame_report.h"
#include "tools/service/store/job.h"

namespace postchain::service {

class Counters {
  public:
    Counters(const std::string& version);
    ~Counters();

    // Callable from any thread; throws nothing.
    void add(const sequence::FrameReport& report) noexcept;
    void set_renderer(const std::string& renderer) noexcept;
    std::string text(const std::map<JobState, size_t>& jobs) const;

  private:
    struct Families;
    std::unique_ptr<Families> families_;
};

}  // namespace postchain::service
