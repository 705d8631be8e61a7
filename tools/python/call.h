// Work on another thread, for which a Python thread waits without the GIL.
//
//   Python thread                                other thread (no Python)
//   Call::wait(): about 20 times a second   <->  the work; looks at stop()
//   signals (Ctrl-C), messages, `idle`      <--  send()
//
// The waiting thread alone calls Python, so an interrupt or an exception of a callback never
// crosses the libraries: it stops the work, and is raised when that has ended.
#pragma once

#include <pybind11/pybind11.h>
#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <type_traits>

#include "chain/base/status.h"

namespace postchain::python {

class Call {
  public:
    // Called with the GIL; may throw.
    using Message = std::function<void()>;
    using Idle = std::function<void(Call&)>;

    // With the GIL. Raises CanceledError if the interpreter is about to exit.
    Call();
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    const std::atomic<bool>& stop() const { return stop_; }
    void ask_to_stop() { stop_ = true; }

    // By the working thread.
    void send(Message message);
    void finish();

    // With the GIL; returns when finish() was called, and raises what was thrown meanwhile.
    void wait(const Idle& idle = {});

    // False in a forked process for the calls of threads that it does not have.
    bool is_of_this_process() const;

  private:
    const pid_t process_;
    std::atomic<bool> stop_ = false;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Message> messages_;
    bool finished_ = false;
};

// Ends all calls, so that none runs when the interpreter is gone. For Python's atexit.
void stop_all_calls();

// The result of `work`, a function of a Call; exceptions become a Status.
template <class Work>
auto guarded(const char* place, Call& call, const Work& work) {
    using Returned = std::invoke_result_t<Work, Call&>;
    try {
        return work(call);
    } catch (...) {
        return Returned(status_of_exception(place));
    }
}

// Runs `work`, which returns a Status or a Result, on a thread of its own.
template <class Work>
auto in_background(const char* place, const Work& work, const Call::Idle& idle = {}) {
    Call call;
    std::invoke_result_t<Work, Call&> result = Status(StatusCode::internal, "not run");
    std::thread thread([&] {
        result = guarded(place, call, work);
        call.finish();
    });
    struct Join {
        std::thread& thread;
        ~Join() { thread.join(); }
    };
    {
        const Join join{thread};
        call.wait(idle);
    }
    return result;
}

}  // namespace postchain::python
