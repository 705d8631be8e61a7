#include "tools/apps/view/frame_store.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "tools/sequence/layers/frame_layers.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::view {
namespace {

constexpr std::chrono::milliseconds kScanInterval{1000};
constexpr int kFramesAhead = 4;

uint64_t bytes_of(const sequence::SourceFrame& frame) {
    uint64_t bytes = 0;
    for (const auto& [role, plane] : frame.planes) bytes += plane->data.size() * sizeof(float);
    return bytes;
}

// Stamps of the files of a frame and of its neighbors.
std::vector<io::FileStamp> stamps_of(int frame, const sequence::FramesOnDisk& files,
                                     const sequence::FramesOnDisk& neighbors) {
    std::vector<io::FileStamp> stamps;
    for (int number = frame - 1; number <= frame + 1; ++number) {
        const auto& frames = number == frame ? files : neighbors;
        if (const auto found = frames.find(number); found != frames.end())
            for (const auto& [role, path] : found->second)
                stamps.push_back(io::FileStamp::of(path));
    }
    return stamps;
}

sequence::FramesOnDisk frames_of(const io::InputSpec& input,
                                 const std::optional<io::FrameRange>& range) {
    auto list = io::find_frames(input, range);
    return list.ok() ? std::move(list->files) : sequence::FramesOnDisk();
}

}  // namespace

bool reads_the_same(const Chain& a, const Chain& b) {
    return (a.required() | a.optional()) == (b.required() | b.optional()) &&
           sequence::mattes_of(a) == sequence::mattes_of(b);
}

void give_way() {
    constexpr int kNice = 10;
    // For Linux this is the thread's own value. A failure only costs smoothness.
    setpriority(PRIO_PROCESS, id_t(syscall(SYS_gettid)), kNice);
}

FrameStore::FrameStore(sequence::RunSettings settings, uint64_t budget, std::function<void()> wake)
    : settings_(std::move(settings)), budget_(budget), wake_(std::move(wake)) {
    scan();
    thread_ = std::thread([this] { work(); });
}

FrameStore::~FrameStore() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void FrameStore::want(int frame, int direction, std::shared_ptr<const Chain> chain) {
    {
        const std::lock_guard lock(mutex_);
        if (wanted_ == frame && direction_ == direction && chain_ == chain) return;
        wanted_ = frame;
        direction_ = direction;
        chain_ = std::move(chain);
    }
    changed_.notify_all();
}

SharedFrame FrameStore::find(int frame) const {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(frame);
    return found == kept_.end() ? nullptr : found->second.frame;
}

uint64_t FrameStore::version(int frame) const {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(frame);
    if (found == kept_.end()) return 0;
    uint64_t hash = kHashSeed;
    for (const io::FileStamp& file : found->second.stamps)
        hash = hash_text(concat(file.path, " ", file.bytes, " ", file.time), hash);
    return hash;
}

Status FrameStore::failure(int frame) const {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(frame);
    if (found != kept_.end()) return found->second.status;
    if (files_.contains(frame)) return Status();
    return Status(StatusCode::input, settings_.input.color().format(frame) +
                                         ": frame is not on disk; render it, or leave it out");
}

std::vector<int> FrameStore::frames() const {
    const std::lock_guard lock(mutex_);
    std::vector<int> frames;
    for (const auto& [frame, files] : files_) frames.push_back(frame);
    return frames;
}

uint64_t FrameStore::bytes() const {
    const std::lock_guard lock(mutex_);
    uint64_t bytes = 0;
    for (const auto& [frame, kept] : kept_) bytes += kept.bytes;
    return bytes;
}

void FrameStore::scan() {
    auto files = frames_of(settings_.input, settings_.frames);
    const bool behind = settings_.input.patterns.contains(Role::behind);
    auto neighbors =
        behind ? frames_of(sequence::input_of_neighbors(settings_.input), settings_.frames) : files;
    std::map<int, std::vector<io::FileStamp>> stamps;
    {
        const std::lock_guard lock(mutex_);
        for (const auto& [frame, kept] : kept_) stamps[frame];
    }
    for (auto& [frame, of_frame] : stamps) of_frame = stamps_of(frame, files, neighbors);
    bool changed = false;
    {
        const std::lock_guard lock(mutex_);
        const size_t stale = std::erase_if(kept_, [&](const auto& entry) {
            return !files.contains(entry.first) || stamps[entry.first] != entry.second.stamps;
        });
        changed = stale > 0 || files != files_ || neighbors != neighbors_;
        files_ = std::move(files);
        neighbors_ = std::move(neighbors);
    }
    if (changed) {
        reader_.reset();
        wake_();
    }
}

void FrameStore::make_room(int frame) {
    uint64_t bytes = 0;
    for (const auto& [number, kept] : kept_) bytes += kept.bytes;
    while (bytes > budget_ && kept_.size() > 1) {
        auto oldest = kept_.end();
        for (auto it = kept_.begin(); it != kept_.end(); ++it)
            if (it->first != frame && it->first != wanted_ &&
                (oldest == kept_.end() || it->second.used < oldest->second.used))
                oldest = it;
        if (oldest == kept_.end()) return;
        bytes -= oldest->second.bytes;
        kept_.erase(oldest);
    }
}

void FrameStore::read(int frame, const std::shared_ptr<const Chain>& chain) {
    std::map<Role, std::string> files;
    auto on_disk = std::make_shared<sequence::FramesOnDisk>();
    {
        const std::lock_guard lock(mutex_);
        if (!files_.contains(frame)) return;
        files = files_.at(frame);
        *on_disk = neighbors_;
    }
    const bool again =
        std::find(handed_out_.begin(), handed_out_.end(), frame) != handed_out_.end();
    if (!reader_ || again || !reads_ || !reads_the_same(*reads_, *chain)) {
        const sequence::RunSettings settings = sequence::settings_for(settings_, {chain.get()});
        reader_ = std::make_unique<sequence::SequenceReader>(
            settings.source, settings.input,
            [chain, settings](const sequence::FrameHeader& header) {
                const RoleSet shown = {Role::inverse_depth, Role::motion, Role::motion_back};
                return shown |
                       sequence::planes_needed(*chain, settings.source, header, settings.plan);
            });
        reader_->see(on_disk);
        handed_out_.clear();
        reads_ = chain;
    }
    CachedFrame kept;
    kept.stamps = stamps_of(frame, {{frame, files}}, *on_disk);
    try {
        auto opened = reader_->open(frame, files);
        kept.status = opened.status();
        if (opened.ok()) {
            handed_out_.push_back(frame);
            auto source = reader_->read(*opened);
            kept.status = source.status();
            if (source.ok()) {
                source->description.frame_number = frame;
                kept.bytes = bytes_of(*source);
                kept.frame =
                    std::make_shared<const sequence::SourceFrame>(std::move(source.value()));
            }
        }
    } catch (...) {
        kept.status = status_of_exception(files.at(Role::color));
    }
    if (!kept.status.ok()) reader_.reset();
    {
        const std::lock_guard lock(mutex_);
        kept.used = ++clock_;
        kept_[frame] = std::move(kept);
        make_room(frame);
    }
    wake_();
}

// Reads one frame that is missing. False: all are read.
bool FrameStore::read_next() {
    std::optional<int> next;
    std::shared_ptr<const Chain> chain;
    {
        const std::lock_guard lock(mutex_);
        if (!wanted_ || files_.empty()) return false;
        chain = chain_;
        if (reads_ && chain != reads_ && !reads_the_same(*chain, *reads_)) {
            kept_.clear();
            reads_.reset();
        }
        std::vector<int> frames;
        for (const auto& [frame, files] : files_) frames.push_back(frame);
        const auto here = std::find(frames.begin(), frames.end(), *wanted_);
        if (here == frames.end()) return false;
        uint64_t each = 0;
        for (const auto& [frame, kept] : kept_) each = std::max(each, kept.bytes);
        auto at = here - frames.begin();
        const auto count = std::ptrdiff_t(frames.size());
        for (int i = 0; i <= kFramesAhead && i < count; ++i) {
            const int frame = frames[size_t(at)];
            if (const auto kept = kept_.find(frame); kept == kept_.end()) {
                if (i == 0 || each == 0 || uint64_t(i + 1) * each <= budget_) next = frame;
                break;
            } else {
                kept->second.used = ++clock_;
            }
            at = (at + (direction_ < 0 ? count - 1 : 1)) % count;
        }
    }
    if (!next) return false;
    read(*next, chain);
    return true;
}

void FrameStore::work() {
    give_way();
    auto scanned = std::chrono::steady_clock::now();
    std::unique_lock lock(mutex_);
    while (!stop_) {
        lock.unlock();
        const bool read = read_next();
        if (std::chrono::steady_clock::now() - scanned >= kScanInterval) {
            scan();
            scanned = std::chrono::steady_clock::now();
        }
        lock.lock();
        if (!read && !stop_) changed_.wait_for(lock, kScanInterval / 2);
    }
}

}  // namespace postchain::view
