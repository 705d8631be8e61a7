#include "tools/sequence/run/frame_feed.h"

#include <utility>

namespace postchain::sequence {

ListFeed::ListFeed(std::vector<FrameTask> tasks, const RunSettings& settings)
    : settings_(settings), tasks_(std::move(tasks)) {
    for (const FrameTask& task : tasks_) sources_.insert(task.source);
}

std::optional<FrameFeed::Fed> ListFeed::next(SequenceReader&, const std::function<bool()>&) {
    if (next_ == tasks_.size()) return std::nullopt;
    Fed fed{tasks_[next_++], Status()};
    if (fed.task.files.empty())
        fed.missing = Status(StatusCode::input,
                             absent_files(fed.task.frame, settings_) + ": frame is not on disk");
    return fed;
}

}  // namespace postchain::sequence
