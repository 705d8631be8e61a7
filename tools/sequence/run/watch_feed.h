// The frames of a sequence as a renderer writes them, complete ones only.
//
// A frame is taken when each of its files is complete (frame/complete_file.h) and has had one size
// and one time of change for two looks, a second apart, and when the frames before and after that
// its filters read are so too, those of them that will come. Which will: of RunSettings::frames
// every one; without them nobody knows. Nothing else tells when a frame is filtered, so the outputs
// are those of a run on the complete sequence. Looked at is by reading the folder, because a file
// system of other machines tells nothing of what they write.
//
// When nothing has changed for Watch::idle_s, what is there is taken as a run takes it, and what is
// not, or is not complete, is reported as missing.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>

#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/run/clock.h"
#include "tools/sequence/run/frame_feed.h"

namespace postchain::sequence {

class WatchFeed final : public FrameFeed {
  public:
    // `tasks`: of the frames that are asked for, without their files; none where they are not
    // known. `settings`, with its `watch`, outlives this.
    WatchFeed(std::vector<FrameTask> tasks, const RunSettings& settings);

    std::optional<Fed> next(SequenceReader& reader, const std::function<bool()>& given_up) override;
    bool has(int frame) const override { return is_open_ || asked_.contains(frame); }
    size_t total() const override { return total_; }
    std::string waits_for() const override;

  private:
    struct File {
        io::FileStamp stamp;
        bool complete = false;
        Status why;  // it is not
    };
    using FilesOfFrame = std::map<Role, std::string>;

    void look();
    bool look_at(const std::string& path);
    std::optional<Fed> pick(SequenceReader& reader);
    std::optional<Fed> give_up_one();
    Status incomplete(const FilesOfFrame& files);
    bool waits_for_neighbor(const FrameTask& task, SequenceReader& reader);
    bool will_come(int frame) const;
    void say_what_is_awaited();

    const RunSettings& settings_;
    const bool is_open_;                 // without RunSettings::frames: any frame may come
    std::set<int> expected_;             // those that will come
    std::set<int> asked_;                // those of this walk
    std::vector<FrameTask> waiting_;     // in the order in which they are taken, if they can be
    std::map<std::string, File> files_;  // by path
    std::shared_ptr<const FramesOnDisk> on_disk_ = std::make_shared<FramesOnDisk>();
    std::set<int> color_on_disk_;                  // frames, with or without their other planes
    std::map<int, std::set<Neighbor>> read_with_;  // of complete frames, what they read besides
    std::set<int> neighbors_awaited_;              // frames that wait for another one alone
    Clock::time_point next_look_, last_change_;
    bool closing_ = false;  // nothing has come for so long: no more is waited for
    std::atomic<size_t> total_ = 0;

    mutable std::mutex mutex_;
    std::string text_;
};

}  // namespace postchain::sequence
