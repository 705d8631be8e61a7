#include "tools/service/work/helper_threads.h"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/stop.h"

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kMaxLost = 16;
constexpr auto kLastTasks = std::chrono::seconds(10);  // time for them at the end

std::chrono::nanoseconds time_on_processor(clockid_t clock) {
    timespec time = {};
    ::clock_gettime(clock, &time);
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

Result<std::thread> start_thread(std::function<void()> work) try {
    return std::thread([work = std::move(work)] {
        try {
            work();
        } catch (...) {
            // Out of memory, at a place that has not foreseen it.
        }
    });
} catch (const std::exception& error) {
    return Status(StatusCode::internal, std::string("cannot start a thread: ") + error.what());
}

struct HelperThreads::Inside {
    struct Helper {
        std::thread thread;
        std::optional<Clock::time_point> busy_since;
        // When the task was last seen to compute, and the processor time of the thread then.
        Clock::time_point seen;
        std::chrono::nanoseconds used{0};
        std::shared_ptr<std::atomic<bool>> stop;  // of its task
        bool lost = false;
        bool ended = false;
        std::string share;  // of its task
    };
    struct Task {
        std::function<void()> work;
        std::function<void()> dropped;
        std::shared_ptr<std::atomic<bool>> stop;
    };
    struct Share {
        std::deque<Task> tasks;
        size_t running = 0;
        uint64_t turn = 0;  // of its last task
    };

    const size_t threads, most_waiting;
    const std::chrono::milliseconds patience;
    std::mutex mutex;
    std::condition_variable changed;
    std::map<std::string, Share> shares;  // with waiting or running tasks
    size_t waiting = 0;
    uint64_t turns = 0;
    std::vector<std::shared_ptr<Helper>> helpers;
    bool ends = false;

    // The share whose turn it is: of those that may have another thread, the one that has waited
    // longest since its last task.
    Share* next_share(std::string& name) {
        const size_t most = ends || threads == 1 ? threads + kMaxLost : threads - 1;
        Share* next = nullptr;
        for (auto& [key, share] : shares) {
            if (share.tasks.empty() || share.running >= most) continue;
            if (next && share.turn >= next->turn) continue;
            next = &share;
            name = key;
        }
        return next;
    }

    void loop(Helper& self) {
        std::unique_lock lock(mutex);
        while (!self.lost) {
            Share* share = nullptr;
            changed.wait(lock, [&] {
                share = next_share(self.share);
                return share || (ends && waiting == 0);
            });
            if (!share) break;
            Task task = std::move(share->tasks.front());
            share->tasks.pop_front();
            --waiting;
            ++share->running;
            share->turn = ++turns;
            self.busy_since = self.seen = Clock::now();
            self.used = time_on_processor(CLOCK_THREAD_CPUTIME_ID);
            self.stop = task.stop;
            lock.unlock();
            run(task);
            task = {};
            lock.lock();
            self.busy_since.reset();
            self.stop.reset();
            // A thread that was replaced has given its place away already.
            if (!self.lost) leave(self.share);
        }
        self.ended = true;
        changed.notify_all();
    }

    static void run(const Task& task) {
        const StopFlag scope(task.stop.get());
        try {
            task.work();
        } catch (...) {
            // Tasks must not throw. If one does, the next one still runs.
        }
    }

    void leave(const std::string& name) {
        const auto share = shares.find(name);
        if (share == shares.end()) return;
        if (--share->second.running == 0 && share->second.tasks.empty()) shares.erase(share);
        changed.notify_all();
    }

    // Makes room for a task of this share, by another share's last one. Returns that one.
    std::optional<Task> make_way(const std::string& name) {
        const auto most = std::ranges::max_element(
            shares, {}, [](const auto& one) { return one.second.tasks.size(); });
        const auto own = shares.find(name);
        const size_t mine = own == shares.end() ? 0 : own->second.tasks.size();
        if (most == shares.end() || most->second.tasks.size() <= mine + 1) return std::nullopt;
        Task last = std::move(most->second.tasks.back());
        most->second.tasks.pop_back();
        if (most->second.tasks.empty() && most->second.running == 0) shares.erase(most);
        --waiting;
        return last;
    }

    static Status add(const std::shared_ptr<Inside>& inside) {
        auto helper = std::make_shared<Helper>();
        auto thread = start_thread([inside, helper] {
            while (!helper->ended) {
                try {
                    inside->loop(*helper);
                } catch (...) {
                    // Out of memory between two tasks; the next one may be taken.
                }
            }
        });
        if (!thread.ok()) return thread.status();
        helper->thread = std::move(*thread);
        inside->helpers.push_back(std::move(helper));
        return Status();
    }

    // Whether the thread waits. One that computes has a hundredth of the patience on a processor,
    // even among a hundred others.
    bool hangs(Helper& helper) const {
        if (!helper.busy_since) return false;
        clockid_t clock = 0;
        if (::pthread_getcpuclockid(helper.thread.native_handle(), &clock) == 0) {
            const auto used = time_on_processor(clock);
            if (used - helper.used > patience / 100) {
                helper.seen = Clock::now();
                helper.used = used;
            }
        }
        return Clock::now() - helper.seen > patience;
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
            inside->leave(helper.share);
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
    : inside_(new Inside{.threads = threads,
                         .most_waiting = most_waiting,
                         .patience = patience,
                         .mutex = {},
                         .changed = {},
                         .shares = {},
                         .helpers = {}}) {}

HelperThreads::~HelperThreads() {
    end();
}

Status HelperThreads::begin() {
    const std::lock_guard lock(inside_->mutex);
    for (size_t i = 0; i < inside_->threads; ++i) RETURN_IF_ERROR(Inside::add(inside_));
    return Status();
}

bool HelperThreads::run(std::function<void()> task, TaskTurn turn) {
    std::optional<Inside::Task> dropped;
    {
        const std::lock_guard lock(inside_->mutex);
        Inside::replace(inside_);
        if (inside_->ends) return false;
        if (inside_->waiting >= inside_->most_waiting) {
            dropped = inside_->make_way(turn.share);
            if (!dropped) return false;
        }
        Inside::Share& share = inside_->shares[turn.share];
        share.tasks.push_back({std::move(task), std::move(turn.dropped), std::move(turn.stop)});
        ++inside_->waiting;
        inside_->changed.notify_all();
    }
    if (dropped && dropped->dropped) dropped->dropped();
    return true;
}

size_t HelperThreads::hanging() const {
    const std::lock_guard lock(inside_->mutex);
    return size_t(std::ranges::count_if(inside_->helpers, [&](const auto& helper) {
        return !helper->ended && inside_->hangs(*helper);
    }));
}

std::chrono::milliseconds HelperThreads::stalled() const {
    const std::lock_guard lock(inside_->mutex);
    if (inside_->waiting == 0) return {};
    Clock::time_point last;  // when a task was begun
    for (const auto& helper : inside_->helpers) {
        if (helper->ended || helper->lost) continue;
        if (!helper->busy_since) return {};
        last = std::max(last, *helper->busy_since);
    }
    return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - last);
}

bool HelperThreads::alive() const {
    const std::lock_guard lock(inside_->mutex);
    size_t lost = 0;
    for (const auto& helper : inside_->helpers) {
        if (helper->ended) continue;
        if (!inside_->hangs(*helper)) return true;
        lost += helper->lost;
    }
    return lost < kMaxLost;
}

size_t HelperThreads::end() {
    std::unique_lock lock(inside_->mutex);
    inside_->ends = true;
    const auto stop = [](const std::shared_ptr<std::atomic<bool>>& flag) {
        if (flag) *flag = true;
    };
    for (const auto& helper : inside_->helpers) stop(helper->stop);
    for (const auto& [name, share] : inside_->shares)
        for (const Inside::Task& task : share.tasks) stop(task.stop);
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
