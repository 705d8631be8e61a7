#include "tools/python/call.h"

#include <unistd.h>

#include <chrono>
#include <exception>
#include <set>

#include "tools/python/errors.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

constexpr auto kBetweenLooks = std::chrono::milliseconds(50);

// Guarded by the GIL.
std::set<Call*>& running() {
    static std::set<Call*> calls;
    return calls;
}
bool exiting = false;

}  // namespace

Call::Call() : process_(getpid()) {
    if (exiting) raise(Status(StatusCode::canceled, "postchain: the interpreter is about to exit"));
    running().insert(this);
}

Call::~Call() {
    running().erase(this);
}

bool Call::is_of_this_process() const {
    return process_ == getpid();
}

void Call::send(Message message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
    changed_.notify_all();
}

void Call::finish() {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_all();
}

void Call::wait(const Idle& idle) {
    std::exception_ptr thrown;
    const auto guard = [&](const Message& message) {
        if (thrown) return;
        try {
            message();
        } catch (...) {
            thrown = std::current_exception();
            stop_ = true;
        }
    };
    for (bool finished = false; !finished;) {
        std::deque<Message> messages;
        {
            const py::gil_scoped_release no_gil;
            std::unique_lock lock(mutex_);
            changed_.wait_for(lock, kBetweenLooks, [&] { return finished_ || !messages_.empty(); });
            finished = finished_;
            messages.swap(messages_);
        }
        for (const Message& message : messages) guard(message);
        guard([] {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        });
        if (idle) guard([&] { idle(*this); });
    }
    if (thrown) std::rethrow_exception(thrown);
}

void stop_all_calls() {
    exiting = true;
    std::erase_if(running(), [](const Call* call) { return !call->is_of_this_process(); });
    while (!running().empty()) {
        for (Call* call : running()) call->ask_to_stop();
        const py::gil_scoped_release no_gil;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

}  // namespace postchain::python
