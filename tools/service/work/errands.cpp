#include "tools/service/work/errands.h"

#include <string>
#include <system_error>

namespace postchain::service {

ErrandThread::~ErrandThread() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        changed_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
}

Status ErrandThread::begin() {
    try {
        thread_ = std::thread([this] { loop(); });
    } catch (const std::system_error& error) {
        return Status(StatusCode::internal, std::string("cannot start a thread: ") + error.what());
    }
    return Status();
}

bool ErrandThread::run(std::function<void()> errand) {
    const std::lock_guard lock(mutex_);
    if (ends_ || errands_.size() >= most_) return false;
    errands_.push_back(std::move(errand));
    changed_.notify_all();
    return true;
}

void ErrandThread::loop() {
    for (;;) {
        std::function<void()> errand;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return ends_ || !errands_.empty(); });
            if (errands_.empty()) return;
            errand = std::move(errands_.front());
            errands_.pop_front();
        }
        try {
            errand();
        } catch (...) {
            // Tasks must not throw. If one does, the next one still runs.
        }
    }
}

}  // namespace postchain::service
