// Supplies frames to a walk: from a list known in advance, or from a folder that a renderer is
// still filling (run/watch_feed.h).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/sequence/settings/frame_task.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

class FrameFeed {
  public:
    virtual ~FrameFeed() = default;

    struct Fed {
        FrameTask task;
        Status missing;  // if not ok: why the frame did not come; `task` is only reported
    };
    // Reader thread. The next frame in processing order; empty if there is none or if `given_up`
    // became true during the wait.
    virtual std::optional<Fed> next(SequenceReader& reader,
                                    const std::function<bool()>& given_up) = 0;
    // Reader thread. Whether the frame is or may become part of this walk.
    virtual bool has(int frame) const = 0;
    // Any thread. Number of frames, as far as known.
    virtual size_t total() const = 0;
    // Any thread. Description of what is awaited; empty = nothing.
    virtual std::string waits_for() const = 0;
};

class ListFeed final : public FrameFeed {
  public:
    ListFeed(std::vector<FrameTask> tasks, const RunSettings& settings);

    std::optional<Fed> next(SequenceReader& reader, const std::function<bool()>& given_up) override;
    bool has(int frame) const override { return sources_.contains(frame); }
    size_t total() const override { return tasks_.size(); }
    std::string waits_for() const override { return ""; }

  private:
    const RunSettings& settings_;
    std::vector<FrameTask> tasks_;
    std::set<int> sources_;
    size_t next_ = 0;
};

}  // namespace postchain::sequence
