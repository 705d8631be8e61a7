#include "tools/service/work/health_watch.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include "tools/service/work/helper_threads.h"

namespace postchain::service {
namespace {

constexpr auto kPeriod = std::chrono::seconds(1), kPatience = std::chrono::seconds(1);
constexpr uint64_t kMinRoom = 64 << 20;  // free bytes; below, a disk counts as full

}  // namespace

std::string trouble_of_folder(const std::string& folder) {
    if (::access(folder.c_str(), W_OK | X_OK) != 0) return folder + ": cannot be written";
    struct statvfs room;
    if (::statvfs(folder.c_str(), &room) == 0 &&
        uint64_t(room.f_bavail) * uint64_t(room.f_frsize) < kMinRoom)
        return folder + ": the disk is full";
    return "";
}

HealthWatch::HealthWatch(std::vector<std::string> folders, std::function<WatchedHealth()> look,
                         std::chrono::milliseconds late,
                         std::function<std::string(const std::string&)> trouble_of)
    : folders_(std::move(folders)),
      look_(std::move(look)),
      late_(late),
      trouble_of_(std::move(trouble_of)) {}

Status HealthWatch::begin() {
    ASSIGN_OR_RETURN(thread_, start_thread([this] { loop(); }));
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] { return !busy_; });
    return Status();
}

void HealthWatch::loop() {
    std::unique_lock lock(mutex_);
    while (!ends_) {
        busy_ = true;
        lock.unlock();
        try {
            look();
        } catch (...) {
            // Out of memory. The next look may succeed.
        }
        lock.lock();
        busy_ = false;
        changed_.notify_all();
        changed_.wait_for(lock, kPeriod, [&] { return ends_; });
    }
    ended_ = true;
    changed_.notify_all();
}

void HealthWatch::look() {
    WatchedHealth now = look_();
    for (const std::string& folder : folders_) {
        {
            const std::lock_guard lock(mutex_);
            asked_ = folder;
        }
        const std::string trouble = trouble_of_(folder);
        if (!trouble.empty()) now.disks += (now.disks.empty() ? "" : "; ") + trouble;
    }
    const std::lock_guard lock(mutex_);
    asked_.clear();
    last_ = std::move(now);
    looked_ = Clock::now();
}

size_t HealthWatch::end() {
    std::unique_lock lock(mutex_);
    ends_ = true;
    changed_.notify_all();
    if (!thread_.joinable()) return 0;
    if (!changed_.wait_for(lock, kPatience, [&] { return ended_; })) {
        thread_.detach();
        return 1;
    }
    lock.unlock();
    thread_.join();
    return 0;
}

WatchedHealth HealthWatch::last(int64_t& late_s) const {
    const std::lock_guard lock(mutex_);
    const auto since = Clock::now() - looked_;
    late_s = since > late_ ? std::chrono::ceil<std::chrono::seconds>(since).count() : 0;
    WatchedHealth last = last_;
    if (late_s > 0)
        last.disks = concat(asked_.empty() ? "the store" : asked_,
                            ": the disk has not answered for ", late_s, " s");
    return last;
}

}  // namespace postchain::service
