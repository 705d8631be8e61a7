// Which steps of the running job are under way, and since when: a step that takes too long hangs.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tools/sequence/settings/run_settings.h"

namespace postchain::service {

class Progress {
  public:
    using Clock = std::chrono::steady_clock;
    void step(sequence::FrameStep step, int frame, bool begins,
              Clock::time_point now = Clock::now());
    // Work that is not a step of one frame: "the job was not read". Empty = none.
    void does(const std::string& what);
    // The job waits for the device, or no longer: its filtering does not take this time. Returns
    // the seconds since the last call if it has waited since.
    double waits(bool waits, Clock::time_point now = Clock::now());

    struct UnderWay {
        std::optional<sequence::FrameStep> step;
        std::optional<int> frame;
        std::string what;  // "frame 3 was not read"
        double seconds = 0;
    };
    std::optional<UnderWay> longest(Clock::time_point now = Clock::now()) const;

  private:
    struct Step {
        int frame = 0;
        Clock::time_point since;
    };
    mutable std::mutex mutex_;
    std::map<sequence::FrameStep, Step> steps_;
    std::string does_;
    Clock::time_point does_since_;
    std::optional<Clock::time_point> waits_since_;
};

}  // namespace postchain::service
