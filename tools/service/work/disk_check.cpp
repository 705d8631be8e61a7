#include "tools/service/work/disk_check.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "tools/service/work/helper_threads.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;

constexpr uint64_t kMinRoom = 64 << 20;  // free bytes; below, a disk counts as full
constexpr auto kPatience = std::chrono::seconds(1);

}  // namespace

std::string trouble_of_folder(const std::string& folder) {
    if (::access(folder.c_str(), W_OK | X_OK) != 0) return folder + ": cannot be written";
    struct statvfs room;
    if (::statvfs(folder.c_str(), &room) == 0 &&
        uint64_t(room.f_bavail) * uint64_t(room.f_frsize) < kMinRoom)
        return folder + ": the disk is full";
    return "";
}

struct DiskCheck::Inside {
    const std::vector<std::string> folders;
    const std::function<std::string(const std::string&)> trouble_of;
    std::mutex mutex = {};
    std::condition_variable checked = {};
    bool busy = false;
    Clock::time_point began = {};
    std::string checking = {};  // the folder
    std::string fault = {};     // the last result

    void check() {
        std::string found;
        try {
            for (const std::string& folder : folders) {
                {
                    const std::lock_guard lock(mutex);
                    checking = folder;
                }
                const std::string trouble = trouble_of(folder);
                if (!trouble.empty()) found += (found.empty() ? "" : "; ") + trouble;
            }
        } catch (...) {
            found = status_of_exception("the disks").message();
        }
        const std::lock_guard lock(mutex);
        fault = found;
        busy = false;
        checked.notify_all();
    }
};

DiskCheck::DiskCheck(std::vector<std::string> folders,
                     std::function<std::string(const std::string&)> trouble_of)
    : inside_(new Inside{.folders = std::move(folders), .trouble_of = std::move(trouble_of)}) {}

std::string DiskCheck::fault() {
    std::unique_lock lock(inside_->mutex);
    if (!inside_->busy) {
        auto thread = start_thread([inside = inside_] { inside->check(); });
        if (!thread.ok()) return thread.status().message();
        thread->detach();
        inside_->busy = true;
        inside_->began = Clock::now();
    }
    if (inside_->checked.wait_for(lock, kPatience, [&] { return !inside_->busy; }))
        return inside_->fault;
    const auto seconds =
        std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - inside_->began).count();
    return concat(inside_->checking, ": the disk has not answered for ", seconds, " s");
}

}  // namespace postchain::service
