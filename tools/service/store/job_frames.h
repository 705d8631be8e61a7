// The frames of the store's jobs. A frame is recorded as begun before its first file is opened. If
// the process dies, the next one finds the begun frames: docs/service.md, "After a crash".
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/service/store/store_file.h"

namespace postchain::service {

// An unfinished frame.
struct FrameToDo {
    int frame = 0;
    int attempts = 0;
    bool begun = false;  // at least once: this job may have written its output
    bool alone = false;  // it was in flight when a process died, so it runs alone
};

// The end of a frame.
struct FrameEnd {
    int frame = 0;
    FrameState state = FrameState::written;
    std::string message;  // warnings
    bool held = false;    // the output is another frame's image
    double filter_ms = 0;
    int64_t bytes = 0;  // of the output
};

// A job's frames, counted by state.
struct FrameTally {
    int waiting = 0, held = 0, missing = 0;
    std::vector<int> quarantined;
};

class JobFrames : public StoreFile {
  public:
    // In the order of the job.
    Result<std::vector<JobFrame>> frames(const std::string& id) const;
    Result<std::optional<JobFrame>> frame(const std::string& id, int frame) const;
    Result<FrameTally> tally(const std::string& id) const;
    Result<std::vector<FrameToDo>> to_do(const std::string& id) const;

    // Records the frames at the first start of the job. Later calls change nothing.
    Status enter_frames(const std::string& id, const std::vector<JobFrame>& frames);
    Status frame_begins(const std::string& id, int frame);
    Status frame_ends(const std::string& id, const FrameEnd& end);
    // The frame waits again, or is quarantined after the last attempt.
    Status frame_fails(const std::string& id, int frame, const std::string& message);
    // After a stop: interrupted frames wait again, without a counted attempt.
    Status release(const std::string& id);

  protected:
    JobFrames(std::string path, int attempts) : StoreFile(std::move(path)), attempts_(attempts) {}
    ~JobFrames() = default;

    const int attempts_;  // of a frame
};

}  // namespace postchain::service
