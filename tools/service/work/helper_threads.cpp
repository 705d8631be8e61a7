#include "tools/service/work/helper_threads.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kMaxLost = 16;
constexpr auto kLastTasks = std::chrono::seconds(10);  // time for them at the end

}  // namespace

Result<std::thread> start_thread(std::function<void()> work) try {
    return std::thread(std::move(work));
} catch (const std::system_error& error) {
    return Status(StatusCode::internal, std::string("cannot start a thread: ") + error.what());
}

struct HelperThreads::Inside {
    struct Helper {
        std::thread thread;
        std::optional<Clock::time_point> busy_since;
        bool lost = false;
        bool ended = false;
    };

    const size_t threads, most_waiting;
    const std::chrono::milliseconds patience;
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::function<void()>> tasks;
    std::vector<std::shared_ptr<Helper>> helpers;
    bool ends = false;

    void loop(Helper& self) {
        std::unique_lock lock(mutex);
        while (!self.lost) {
            changed.wait(lock, [&] { return ends || !tasks.empty(); });
            if (tasks.empty()) break;
            auto task = std::move(tasks.front());
            tasks.pop_front();
            self.busy_since = Clock::now();
            lock.unlock();
            try {
                task();
            } catch (...) {
                // Tasks must not throw. If one does, the next one still runs.
            }
            task = nullptr;
            lock.lock();
            self.busy_since.reset();
        }
        self.ended = true;
        changed.notify_all();
    }

    static Status add(const std::shared_ptr<Inside>& inside) {
        auto helper = std::make_shared<Helper>();
        auto thread = start_thread([inside, helper] { inside->loop(*helper); });
        if (!thread.ok()) return thread.status();
        helper->thread = std::move(*thread);
        inside->helpers.push_back(std::move(helper));
        return Status();
    }

    bool hangs(const Helper& helper) const {
        return helper.busy_since && Clock::now() - *helper.busy_since > patience;
    }

    // Replaces threads that hang, if no other one is free. Requires the lock.
    static void replace(const std::shared_ptr<Inside>& inside) {
        size_t lost = 0;
        for (const auto& helper : inside->helpers) lost += helper->lost && !helper->ended;
        for (size_t i = 0; i < inside->helpers.size() && lost < kMaxLost; ++i) {
            Helper& helper = *inside->helpers[i];
            if (helper.lost || !inside->hangs(helper)) continue;
            if (!add(inside).ok()) return;
            helper.lost = true;
            ++lost;
        }
        std::erase_if(inside->helpers, [](const auto& helper) {
            if (helper->lost && helper->ended) helper->thread.join();
            return helper->lost && helper->ended;
        });
    }
};

HelperThreads::HelperThreads(size_t threads, size_t most_waiting,
                             std::chrono::milliseconds patience)
    : inside_(new Inside{threads, most_waiting, patience, {}, {}, {}, {}}) {}

HelperThreads::~HelperThreads() {
    end();
}

Status HelperThreads::begin() {
    const std::lock_guard lock(inside_->mutex);
    for (size_t i = 0; i < inside_->threads; ++i) RETURN_IF_ERROR(Inside::add(inside_));
    return Status();
}

bool HelperThreads::run(std::function<void()> task) {
    const std::lock_guard lock(inside_->mutex);
    Inside::replace(inside_);
    if (inside_->ends || inside_->tasks.size() >= inside_->most_waiting) return false;
    inside_->tasks.push_back(std::move(task));
    inside_->changed.notify_one();
    return true;
}

size_t HelperThreads::end() {
    std::unique_lock lock(inside_->mutex);
    inside_->ends = true;
    inside_->changed.notify_all();
    const auto all_ended = [&] {
        return std::ranges::all_of(inside_->helpers,
                                   [](const auto& helper) { return helper->ended; });
    };
    inside_->changed.wait_for(lock, kLastTasks, all_ended);
    size_t lost = 0;
    for (const auto& helper : inside_->helpers) {
        if (helper->ended) {
            helper->thread.join();
        } else {
            helper->thread.detach();
            ++lost;
        }
    }
    inside_->helpers.clear();
    return lost;
}

}  // namespace postchain::service
