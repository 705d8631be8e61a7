// A GL context with its executor, on a thread of its own: the context of a Python thread that has
// one (a host's, Blender's) stays current, and any Python thread may use the device.
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "tools/python/call.h"

namespace postchain::python {

class Device {
  public:
    // `name`: "auto", "gpu", "software" or a number, as for --device. Raises.
    static std::shared_ptr<Device> create(const std::string& name);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const std::string& renderer() const { return renderer_; }
    bool is_software() const { return is_software_; }
    const egl::ContextOptions& options() const { return options_; }
    // By `work` of run(), after other code has made a context of its own on the device's thread.
    Status make_current() { return worker_->context->make_current(); }
    // Frees the context. Later calls raise UsageError.
    void close();

    // Runs `work`, a function of a Call and the executor, on the device's thread, after the calls
    // that came before. It returns a Status or a Result.
    template <class Work>
    auto run(const char* place, const Work& work, const Call::Idle& idle = {}) {
        Call call;
        std::invoke_result_t<Work, Call&, Executor&> result =
            Status(StatusCode::internal, "not run");
        post([&] {
            result = guarded(place, call, [&](Call& own) {
                Executor& executor = *worker_->executor;
                const StopScope scope(executor, &own.stop());
                return work(own, executor);
            });
            call.finish();
        });
        call.wait(idle);
        return result;
    }

  private:
    struct Worker {
        std::mutex mutex;
        std::condition_variable changed;
        std::deque<std::function<void()>> tasks;
        bool closing = false;
        std::thread thread;
        // The thread's own.
        std::unique_ptr<egl::Context> context;
        std::unique_ptr<Executor> executor;

        void work_off();
    };
    Device();
    void post(std::function<void()> task);

    const pid_t process_;  // that made it
    std::string renderer_;
    bool is_software_ = false;
    egl::ContextOptions options_;
    std::shared_ptr<Worker> worker_;  // shared with its thread, which may end later
};

// The device of calls that name none: made at the first use, on --device auto.
std::shared_ptr<Device> default_device();

// The argument `device`: a Device, or None. Raises.
std::shared_ptr<Device> device_of(const pybind11::object& device);

// CPU threads of software rendering and of EXR files; before the first device is made. Raises.
void set_threads(const pybind11::object& threads);
int cpu_threads();  // 0 = one for each core

// Closes every device. For Python's atexit.
void close_all_devices();

// For SceneRenderer, which makes a context of its own. Warnings are added to `warnings`. Raises.
egl::ContextOptions context_options(const std::string& name, std::vector<std::string>& warnings);

// The process must be the one that made the first context: GL does not survive a fork. Raises.
void check_process();

}  // namespace postchain::python
