#include "tools/python/device.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "tools/python/errors.h"
#include "tools/python/values.h"
#include "tools/sequence/run/device.h"

namespace py = pybind11;

namespace postchain::python {
namespace {

// All guarded by the GIL.
struct Shared {
    std::set<Device*> alive;
    std::shared_ptr<Device> by_default;
    pid_t process = 0;                // that made the first context
    int threads = 0;                  // 0 = one for each core
    int joining = 0;                  // calls of close() that wait for a thread
    std::set<std::string> said = {};  // warnings
};
Shared& shared() {
    static auto* const state = new Shared;  // outlives every thread
    return *state;
}

// Mesa's exit handlers, which are older than this one, would join threads that a forked process
// does not have.
void end_forked_process(int status, void*) {
    if (shared().process == getpid()) return;
    std::fflush(nullptr);
    ::_exit(status);
}

}  // namespace

void check_process() {
    if (const pid_t first = shared().process; first != 0 && first != getpid())
        raise_usage(
            "postchain: this process was forked from one that had made a GL context; use "
            "multiprocessing.set_start_method('spawn')");
}

egl::ContextOptions context_options(const std::string& name, std::vector<std::string>& warnings) {
    check_process();
    // That there is no GPU is said once, not for each device and scene.
    auto options = value_of(
        sequence::choose_device(name, shared().threads, [&warnings](const std::string& text) {
            if (shared().said.insert(text).second) warnings.push_back(text);
        }));
    shared().process = getpid();
    return options;
}

Device::Device() : process_(getpid()), worker_(std::make_shared<Worker>()) {}

std::shared_ptr<Device> Device::create(const std::string& name) {
    std::vector<std::string> warnings;
    const egl::ContextOptions options = context_options(name, warnings);
    Call call;
    std::shared_ptr<Device> device(new Device);
    device->options_ = options;
    Worker& worker = *device->worker_;
    Status status;
    worker.tasks.push_back([&] {
        auto made = egl::Context::create(options);
        status = made.status();
        if (made.ok()) {
            worker.context = std::move(*made);
            device->renderer_ = sequence::renderer_text(worker.context->device());
            device->is_software_ = worker.context->device().software;
            worker.executor = std::make_unique<Executor>(worker.context->device());
        }
        call.finish();
    });
    worker.thread = std::thread([held = device->worker_] { held->work_off(); });
    shared().alive.insert(device.get());
    call.wait();
    if (!status.ok()) raise(status);
    static const int at_exit = ::on_exit(end_forked_process, nullptr);
    (void)at_exit;
    warn(warnings);
    return device;
}

Device::~Device() {
    // A forked process has the worker, but not its thread, whose reference keeps it.
    close();
}

void Device::close() {
    shared().alive.erase(this);
    if (process_ != getpid() || !worker_->thread.joinable()) return;
    {
        const std::lock_guard lock(worker_->mutex);
        worker_->closing = true;
    }
    worker_->changed.notify_all();
    std::thread ending = std::move(worker_->thread);
    ++shared().joining;
    {
        // Another thread may delete this device meanwhile.
        const py::gil_scoped_release no_gil;
        ending.join();
    }
    --shared().joining;
}

void Device::post(std::function<void()> task) {
    check_process();
    const std::lock_guard lock(worker_->mutex);
    if (worker_->closing) raise_usage("device: it is closed; make another Device()");
    worker_->tasks.push_back(std::move(task));
    worker_->changed.notify_all();
}

void Device::Worker::work_off() {
    std::unique_lock lock(mutex);
    while (true) {
        changed.wait(lock, [&] { return closing || !tasks.empty(); });
        if (tasks.empty()) break;
        const auto task = std::move(tasks.front());
        tasks.pop_front();
        lock.unlock();
        task();
        lock.lock();
    }
    executor.reset();
    context.reset();
}

std::shared_ptr<Device> default_device() {
    check_process();
    if (shared().by_default) return shared().by_default;
    auto made = Device::create("auto");  // without the GIL: another thread may have made one
    if (!shared().by_default) shared().by_default = std::move(made);
    return shared().by_default;
}

std::shared_ptr<Device> device_of(const py::object& device) {
    if (device.is_none()) return default_device();
    if (!py::isinstance<Device>(device))
        raise_usage("device: is a ", type_of(device), "; give a Device(), as Device(\"gpu\")");
    return device.cast<std::shared_ptr<Device>>();
}

int cpu_threads() {
    return shared().threads;
}

void set_threads(const py::object& given) {
    const int threads = argument_of<int>(given, "threads", "an integer");
    if (threads < 1 || threads > 1024) raise_usage("threads: ", threads, " is not in 1..1024");
    if (shared().process != 0)
        raise_usage("set_threads: a device has been made; call it before the first run");
    shared().threads = threads;
}

void close_all_devices() {
    shared().by_default.reset();
    while (!shared().alive.empty()) (*shared().alive.begin())->close();
    // Threads of Python that are in close() need the interpreter once more.
    while (shared().joining > 0) {
        const py::gil_scoped_release no_gil;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

}  // namespace postchain::python
