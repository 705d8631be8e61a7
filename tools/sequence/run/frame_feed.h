// Where a walk has its frames from: a list that is known before it begins, or a folder that a
// renderer still fills (run/watch_feed.h).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/sequence/run/frame_task.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

class FrameFeed {
  public:
    virtual ~FrameFeed() = default;

    struct Fed {
        FrameTask task;
        Status missing;  // not ok: the frame did not come, and why; `task` is to be reported alone
    };
    // Reader thread. The next frame, in the order in which they are walked; nothing: there is no
    // further one, or `given_up` has come true while it waited.
    virtual std::optional<Fed> next(SequenceReader& reader,
                                    const std::function<bool()>& given_up) = 0;
    // Reader thread. Whether the frame is or may become one of this walk.
    virtual bool has(int frame) const = 0;
    // Any thread. How many frames there are, as far as is known.
    virtual size_t total() const = 0;
    // Any thread. What is waited for; empty: nothing.
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
