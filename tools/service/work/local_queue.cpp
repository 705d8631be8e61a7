#include "tools/service/work/local_queue.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include "tools/service/work/process.h"

namespace postchain::service {
namespace {

int task_of(const ArrayState& state) {
    return state.done + state.failed + 1;
}

std::string file_of(const TaskArray& array, int task, const char* extension) {
    return concat(array.log_folder, "/", task, extension);
}

// Of the two files that a task prints to.
int64_t printed_by(const TaskArray& array, int task) {
    int64_t bytes = 0;
    for (const char* extension : {".events", ".log"}) {
        struct stat found = {};
        if (::stat(file_of(array, task, extension).c_str(), &found) == 0) bytes += found.st_size;
    }
    return bytes;
}

// "SIGSEGV" for people who look it up.
std::string name_of_signal(int signal) {
    const char* name = ::sigabbrev_np(signal);
    return name ? concat("SIG", name) : concat("signal ", signal);
}

}  // namespace

LocalQueue::~LocalQueue() {
    for (auto& [name, running] : arrays_)
        if (running.process > 0) kill_process(running.process);
}

Result<std::string> LocalQueue::submit(const TaskArray& array) {
    Running& running = arrays_[array.name] = Running();
    running.array = array;
    running.state = {.id = array.name, .waiting = int(array.tasks.size()), .message = {}};
    if (const Status status = start_next(running); !status.ok()) {
        arrays_.erase(array.name);
        return status;
    }
    return array.name;
}

Status LocalQueue::start_next(Running& running) const {
    const int task = task_of(running.state);
    ProcessSettings process{running.array.command};
    for (const std::string& word : running.array.tasks[size_t(task - 1)])
        process.words.push_back(word);
    const auto open = [&](const char* extension) {
        return Descriptor(::open(file_of(running.array, task, extension).c_str(),
                                 O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    };
    const Descriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    const Descriptor events = open(".events"), log = open(".log");
    if (events.get() < 0 || log.get() < 0)
        return Status(StatusCode::output,
                      concat(running.array.log_folder, ": ", std::strerror(errno)));
    process.folder = running.array.folder;
    process.in = nothing.get();
    process.out = events.get();
    process.err = log.get();
    process.nice = settings_.nice;
    process.memory = settings_.memory;
    ASSIGN_OR_RETURN(running.process, start_process(process));
    --running.state.waiting;
    running.state.running = 1;
    running.printed = printed_by(running.array, task);
    running.printed_at = Clock::now();
    return Status();
}

// The end of the running task, and the start of the next one. `why`: how it failed, if not by
// itself.
void LocalQueue::enter_end(Running& running, int code, const std::string& why) {
    ArrayState& state = running.state;
    const int task = task_of(state);
    std::ofstream(file_of(running.array, task, ".exit")) << code << "\n";
    running.process = -1;
    state.running = 0;
    if (code == 0) {
        ++state.done;
        return;
    }
    ++state.failed;
    state.failed_task = task;
    state.message = !why.empty() ? why
                    : code > 128 ? "its process was ended by " + name_of_signal(code - 128)
                                 : concat("its process ended with exit code ", code);
}

void LocalQueue::follow(Running& running) const {
    if (running.process < 0) return;
    const auto now = Clock::now();
    int status = 0;
    std::string why;
    if (::waitpid(running.process, &status, WNOHANG) != running.process) {
        const int64_t printed = printed_by(running.array, task_of(running.state));
        if (printed != running.printed) running.printed_at = now;
        running.printed = printed;
        const double quiet_s = std::chrono::duration<double>(now - running.printed_at).count();
        const bool hangs = running.array.silence_s > 0 && quiet_s > running.array.silence_s;
        const bool late = running.canceled && now - *running.canceled > settings_.grace;
        if (!hangs && !late) return;
        kill_process(running.process);
        status = SIGKILL;
        if (hangs)
            why = concat("nothing was read, filtered or written for ", running.array.silence_s,
                         " s: a disk or the device hangs, or the limit is too low for this chain");
    }
    enter_end(running, code_of(status), why);
    while (running.state.waiting > 0 && running.process < 0) {
        if (running.canceled) {
            running.state.waiting = 0;
        } else if (const Status started = start_next(running); !started.ok()) {
            --running.state.waiting;
            enter_end(running, 127, started.message());
        }
    }
}

Result<std::map<std::string, ArrayState>> LocalQueue::look(const std::vector<ArrayName>& arrays) {
    // An array that nobody asks for any more is forgotten, its task killed.
    for (auto at = arrays_.begin(); at != arrays_.end();) {
        const bool wanted = std::ranges::any_of(
            arrays, [&](const ArrayName& one) { return one.name == at->first; });
        if (!wanted && at->second.process > 0) kill_process(at->second.process);
        at = wanted ? std::next(at) : arrays_.erase(at);
    }
    std::map<std::string, ArrayState> states;
    for (auto& [name, running] : arrays_) {
        follow(running);
        states[name] = running.state;
    }
    return states;
}

Status LocalQueue::cancel(const std::string& id) {
    const auto found = arrays_.find(id);
    if (found == arrays_.end() || found->second.canceled) return Status();
    found->second.canceled = Clock::now();
    if (found->second.process > 0) ::kill(found->second.process, SIGTERM);
    return Status();
}

}  // namespace postchain::service
