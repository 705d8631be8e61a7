// Supplies frames to a walk: from a list known in advance, or from a folder that a renderer is
// still filling.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"
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
    // Any thread. Names the awaited frames; empty = none.
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

// Feeds a walk with the frames that a renderer writes, as soon as they are complete.
//
// A frame is taken when each of its files is complete (planes/complete_file.h) and had the same
// size and modification time at two looks, a second apart, and when the neighbors that its filters
// read are complete too, if they are expected: every frame of RunSettings::frames is; without
// frames none is known to be. Nothing else decides when a frame is filtered, so outputs are those
// of a run on the complete sequence. The folder is polled, because a network file system does not
// report other machines' writes.
//
// After Watch::idle_s without changes, complete frames are processed as in a run, and missing or
// incomplete ones are reported as missing.
class WatchFeed final : public FrameFeed {
  public:
    // `tasks`: the requested frames without files; empty if unknown. `settings` and its `watch`
    // must outlive this object. `between_looks`: the time between two looks at the folder.
    WatchFeed(std::vector<FrameTask> tasks, const RunSettings& settings,
              Clock::duration between_looks = std::chrono::seconds(1));

    std::optional<Fed> next(SequenceReader& reader, const std::function<bool()>& given_up) override;
    bool has(int frame) const override { return is_open_ || asked_.contains(frame); }
    size_t total() const override { return total_; }
    std::string waits_for() const override;

  private:
    struct File {
        io::FileStamp stamp;
        bool complete = false;
        Status why;  // if it is not complete
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
    const Clock::duration between_looks_;
    const bool is_open_;                 // without RunSettings::frames: any frame may come
    std::set<int> expected_;             // frames that will come
    std::set<int> asked_;                // frames of this walk
    std::vector<FrameTask> waiting_;     // in processing order
    std::map<std::string, File> files_;  // by path
    FramesOnDisk on_disk_;               // with all their files
    std::shared_ptr<const FramesOnDisk> neighbors_on_disk_ = std::make_shared<FramesOnDisk>();
    std::set<int> color_on_disk_;                  // frames, even if other planes are missing
    std::map<int, std::set<Neighbor>> read_with_;  // neighbors read by complete frames
    std::set<int> neighbors_awaited_;              // frames that only wait for a neighbor
    Clock::time_point next_look_, last_change_;
    bool closing_ = false;  // idle time is over: waits for no more frames
    std::atomic<size_t> total_ = 0;

    mutable std::mutex mutex_;
    std::string text_;
};

}  // namespace postchain::sequence
