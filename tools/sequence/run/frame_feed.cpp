#include "tools/sequence/run/frame_feed.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "chain/base/parameter.h"
#include "tools/sequence/planes/complete_file.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {
namespace {

constexpr auto kSlice = std::chrono::milliseconds(50);  // delay until a stop is noticed

bool same(const io::FileStamp& a, const io::FileStamp& b) {
    return a.bytes == b.bytes && a.time == b.time;
}

}  // namespace

ListFeed::ListFeed(std::vector<FrameTask> tasks, const RunSettings& settings)
    : settings_(settings), tasks_(std::move(tasks)) {
    for (const FrameTask& task : tasks_) sources_.insert(task.source);
}

std::optional<FrameFeed::Fed> ListFeed::next(SequenceReader&, const std::function<bool()>&) {
    if (next_ == tasks_.size()) return std::nullopt;
    Fed fed{tasks_[next_++], Status()};
    if (fed.task.files.empty()) fed.missing = absent_frame(fed.task.frame, settings_);
    return fed;
}

WatchFeed::WatchFeed(std::vector<FrameTask> tasks, const RunSettings& settings,
                     Clock::duration between_looks)
    : settings_(settings),
      between_looks_(between_looks),
      is_open_(frames_are_unknown(settings)),
      waiting_(std::move(tasks)) {
    for (const FrameTask& task : waiting_) asked_.insert(task.frame);
    expected_ = asked_;
    if (settings.frames)
        expected_.insert(settings.frames->frames.begin(), settings.frames->frames.end());
    total_ = waiting_.size();
    next_look_ = last_change_ = Clock::now();
}

std::string WatchFeed::waits_for() const {
    const std::lock_guard lock(mutex_);
    return text_;
}

std::optional<FrameFeed::Fed> WatchFeed::next(SequenceReader& reader,
                                              const std::function<bool()>& given_up) {
    std::optional<Fed> fed = pick(reader);
    while (!fed && !given_up()) {
        if (!is_open_ && waiting_.empty()) break;
        if (closing_) {
            fed = give_up_one();
            break;
        }
        if (Clock::now() < next_look_) {
            std::this_thread::sleep_for(kSlice);
            continue;
        }
        look();
        const std::chrono::duration<double> quiet = Clock::now() - last_change_;
        closing_ = settings_.watch->idle_s && quiet.count() >= *settings_.watch->idle_s;
        fed = pick(reader);
        if (!fed) say_what_is_awaited();
    }
    const std::lock_guard lock(mutex_);
    text_.clear();
    return fed;
}

void WatchFeed::look() {
    const io::FilesOnDisk found = io::files_on_disk(settings_.input);
    const io::InputSpec of_neighbors = input_of_neighbors(settings_.input);
    auto neighbors = std::make_shared<FramesOnDisk>();
    on_disk_.clear();
    color_on_disk_.clear();
    for (const auto& [frame, path] : found.at(Role::color)) {
        color_on_disk_.insert(frame);
        for (const auto& [input, frames] :
             {std::pair{&settings_.input, &on_disk_}, std::pair{&of_neighbors, neighbors.get()}}) {
            auto files = io::files_of(frame, *input, found);
            if (files.size() == input->patterns.size()) (*frames)[frame] = std::move(files);
        }
        if (is_open_ && asked_.insert(frame).second) {
            waiting_.push_back({frame, frame, {}, settings_.output.format(frame)});
            ++total_;
        }
    }
    neighbors_on_disk_ = std::move(neighbors);

    std::set<int> wanted;
    for (const FrameTask& task : waiting_)
        wanted.insert({task.frame - 1, task.frame, task.frame + 1});
    bool changed = false;
    std::set<std::string> there;
    for (const auto& [role, frames] : found)
        for (const auto& [frame, path] : frames)
            if (wanted.contains(frame) || (is_open_ && !asked_.contains(frame)) ||
                !settings_.input.patterns.at(role).has_token()) {
                there.insert(path);
                changed = look_at(path) || changed;
            }
    changed = std::erase_if(files_,
                            [&](const auto& file) {
                                return !there.contains(file.first) && !file.second.complete;
                            }) > 0 ||
              changed;
    if (changed) last_change_ = Clock::now();
    next_look_ = Clock::now() + between_looks_;
}

// True if the file is new or has changed since the last look.
bool WatchFeed::look_at(const std::string& path) {
    const io::FileStamp now = io::FileStamp::of(path);
    const auto [at, fresh] = files_.try_emplace(path);
    File& file = at->second;
    if (fresh || !same(file.stamp, now)) {
        file = {now, false, Status(StatusCode::input, path + ": is still changing")};
        return true;
    }
    if (file.complete) return false;
    // Network file systems cache sizes and times; opening the file, as the check does, refreshes
    // them.
    file.why = io::check_complete(path);
    const io::FileStamp after = io::FileStamp::of(path);
    file.complete = file.why.ok() && same(after, now);
    const bool changed = !same(after, now);
    file.stamp = after;
    return changed;
}

// Why a file of the frame is not complete, or ok. A file that has changed since its check is not.
Status WatchFeed::incomplete(const FilesOfFrame& files) {
    for (const auto& [role, path] : files) {
        const auto known = files_.find(path);
        if (known == files_.end()) return Status(StatusCode::input, path + ": is new");
        File& file = known->second;
        if (file.complete && !same(file.stamp, io::FileStamp::of(path))) {
            files_.erase(known);
            return Status(StatusCode::input, path + ": is still changing");
        }
        if (!file.complete) return file.why;
    }
    return Status();
}

bool WatchFeed::will_come(int frame) const {
    if (closing_) return false;
    return is_open_ || expected_.contains(frame) || color_on_disk_.contains(frame);
}

bool WatchFeed::waits_for_neighbor(const FrameTask& task, SequenceReader& reader) {
    if (!settings_.input.color().has_token()) return false;
    for (const Neighbor neighbor : kNeighbors) {
        const int number = task.frame + frames_to(neighbor);
        if (!will_come(number)) continue;
        if (const auto files = neighbors_on_disk_->find(number);
            files != neighbors_on_disk_->end() && incomplete(files->second).ok())
            continue;
        auto known = read_with_.find(task.frame);
        if (known == read_with_.end())
            known = read_with_.emplace(task.frame, reader.reads_with(task.frame, task.files)).first;
        if (known->second.contains(neighbor)) return true;
    }
    return false;
}

std::optional<FrameFeed::Fed> WatchFeed::pick(SequenceReader& reader) {
    neighbors_awaited_.clear();
    for (auto task = waiting_.begin(); task != waiting_.end(); ++task) {
        const auto files = on_disk_.find(task->frame);
        if (files == on_disk_.end() || !incomplete(files->second).ok()) continue;
        task->files = files->second;
        if (waits_for_neighbor(*task, reader)) {
            neighbors_awaited_.insert(task->frame);
            continue;
        }
        Fed fed{std::move(*task), Status()};
        waiting_.erase(task);
        read_with_.erase(fed.task.frame);
        reader.see(neighbors_on_disk_);
        return fed;
    }
    return std::nullopt;
}

// When waiting ends: the next frame that cannot be processed.
std::optional<FrameFeed::Fed> WatchFeed::give_up_one() {
    if (waiting_.empty()) return std::nullopt;
    Fed fed{std::move(waiting_.front()), Status()};
    waiting_.erase(waiting_.begin());
    const std::string quiet =
        concat("nothing has changed for ", text_of(*settings_.watch->idle_s), " s ({idle})"_keyed);
    const auto files = on_disk_.find(fed.task.frame);
    if (files == on_disk_.end())
        fed.missing = Status(StatusCode::input, concat(absent_files(fed.task.frame, settings_),
                                                       ": frame did not come; ", quiet));
    else
        fed.missing =
            Status(StatusCode::input, concat("frame ", fed.task.frame, " is not complete, and ",
                                             quiet, ": ", incomplete(files->second).message()));
    fed.task.files.clear();
    return fed;
}

void WatchFeed::say_what_is_awaited() {
    std::vector<int> absent, unfinished;
    for (const FrameTask& task : waiting_) {
        if (neighbors_awaited_.contains(task.frame)) continue;
        (color_on_disk_.contains(task.frame) ? unfinished : absent).push_back(task.frame);
    }
    std::string text;
    const auto add = [&](const char* what, const std::vector<int>& frames) {
        if (!frames.empty())
            text += concat(text.empty() ? "" : "; ", what, " ", frames_text(frames));
    };
    add("missing:", absent);
    add("incomplete:", unfinished);
    add("complete, waiting for a neighboring frame:",
        {neighbors_awaited_.begin(), neighbors_awaited_.end()});
    if (text.empty()) text = "another frame";
    const std::lock_guard lock(mutex_);
    text_ = std::move(text);
}

}  // namespace postchain::sequence
