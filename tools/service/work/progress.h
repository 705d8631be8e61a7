// Which steps of the running job are under way, and since when: a step that takes too long hangs.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tools/sequence/run/frame_task.h"

namespace postchain::service {

class Progress {
  public:
    void step(sequence::FrameStep step, int frame, bool begins);
    // Work that is not a step of one frame: "the job was not read". Empty = none.
    void does(const std::string& what);

    struct UnderWay {
        std::optional<sequence::FrameStep> step;
        std::optional<int> frame;
        std::string what;  // "frame 3 was not read"
        double seconds = 0;
    };
    std::optional<UnderWay> longest() const;

  private:
    using Clock = std::chrono::steady_clock;
    struct Step {
        int frame = 0;
        Clock::time_point since;
    };
    mutable std::mutex mutex_;
    std::map<sequence::FrameStep, Step> steps_;
    std::string does_;
    Clock::time_point does_since_;
};

}  // namespace postchain::service
