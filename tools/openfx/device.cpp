#include "tools/openfx/device.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "chain/egl/context.h"

namespace postchain::openfx {
namespace {

// Well below the tenth of a second within which a render is to end.
constexpr std::chrono::milliseconds kAskEvery(10);

struct Task {
    const DeviceWork* work = nullptr;  // null: purge
    std::atomic<bool> stop = false;
    bool done = false;
    Status status;
};

struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::shared_ptr<Task>> tasks;
    bool closing = false;
    std::thread thread;
};
Shared& shared() {
    static auto* const state = new Shared;  // outlives every thread
    return *state;
}

Status canceled_by_host() {
    return Status(StatusCode::canceled, "canceled by the host");
}

// Lives on the device's thread.
struct Gl {
    std::unique_ptr<egl::Context> context;
    std::optional<Executor> executor;

    Status open() {
        if (executor) return Status();
        if (!context) {
            ASSIGN_OR_RETURN(context, egl::Context::create());
        }
        executor.emplace(context->device());
        return Status();
    }
    Status run(const Task& task) try {
        RETURN_IF_ERROR(open());
        const StopScope scope(*executor, &task.stop);
        return (*task.work)(*executor, context->device());
    } catch (...) {
        return status_of_exception("filtering a frame");
    }
};

void work_off() {
    Gl gl;
    Shared& state = shared();
    std::unique_lock lock(state.mutex);
    while (true) {
        state.changed.wait(lock, [&] { return state.closing || !state.tasks.empty(); });
        if (state.tasks.empty()) break;
        const auto task = state.tasks.front();
        state.tasks.pop_front();
        lock.unlock();
        if (task->work)
            task->status = gl.run(*task);
        else
            gl.executor.reset();
        lock.lock();
        task->done = true;
        state.changed.notify_all();
    }
}

}  // namespace

Status run_on_device(const DeviceWork& work, const std::function<bool()>& canceled) {
    if (canceled()) return canceled_by_host();
    Shared& state = shared();
    const auto task = std::make_shared<Task>();
    task->work = &work;
    std::unique_lock lock(state.mutex);
    if (!state.thread.joinable()) {
        state.closing = false;
        state.thread = std::thread(work_off);
    }
    state.tasks.push_back(task);
    state.changed.notify_all();
    while (!state.changed.wait_for(lock, kAskEvery, [&] { return task->done; })) {
        lock.unlock();
        if (!task->stop && canceled()) task->stop = true;
        lock.lock();
        if (task->stop && std::erase(state.tasks, task) > 0) return canceled_by_host();
    }
    return task->status;
}

void purge_device() {
    Shared& state = shared();
    const std::lock_guard lock(state.mutex);
    if (!state.thread.joinable()) return;
    state.tasks.push_back(std::make_shared<Task>());
    state.changed.notify_all();
}

void close_device() {
    Shared& state = shared();
    std::thread ending;
    {
        const std::lock_guard lock(state.mutex);
        state.closing = true;
        ending = std::move(state.thread);
    }
    state.changed.notify_all();
    if (ending.joinable()) ending.join();
}

}  // namespace postchain::openfx
