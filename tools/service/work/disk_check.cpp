#include "tools/service/work/disk_check.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include <cstdint>

namespace postchain::service {
namespace {

constexpr uint64_t kMinRoom = 64 << 20;  // free bytes; below, a disk counts as full
constexpr auto kPatience = std::chrono::seconds(1);

// Why files cannot be written to a folder; empty = they can.
std::string trouble_of_folder(const std::string& folder) {
    if (::access(folder.c_str(), W_OK | X_OK) != 0) return folder + ": cannot be written";
    struct statvfs room;
    if (::statvfs(folder.c_str(), &room) == 0 &&
        uint64_t(room.f_bavail) * uint64_t(room.f_frsize) < kMinRoom)
        return folder + ": the disk is full";
    return "";
}

}  // namespace

DiskCheck::DiskCheck(std::vector<std::string> folders)
    : folders_(std::move(folders)), thread_(1, 1, std::chrono::hours(24)) {}

void DiskCheck::check() {
    std::string fault;
    for (const std::string& folder : folders_) {
        {
            const std::lock_guard lock(mutex_);
            checking_ = folder;
        }
        const std::string trouble = trouble_of_folder(folder);
        if (!trouble.empty()) fault += (fault.empty() ? "" : "; ") + trouble;
    }
    const std::lock_guard lock(mutex_);
    fault_ = fault;
    busy_ = false;
    checked_.notify_all();
}

std::string DiskCheck::fault() {
    std::unique_lock lock(mutex_);
    if (!busy_) {
        busy_ = true;
        began_ = Clock::now();
        if (!thread_.run([this] { check(); })) busy_ = false;
    }
    if (checked_.wait_for(lock, kPatience, [&] { return !busy_; })) return fault_;
    const auto seconds =
        std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - began_).count();
    return concat(checking_, ": the disk has not answered for ", seconds, " s");
}

}  // namespace postchain::service
