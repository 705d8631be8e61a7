// Processes that the service starts: jobs, helpers that read files of clients, and programs that
// answer a question. Each is in a process group of its own, inherits only its three standard
// streams, and dies with the thread that started it.
//
// They are forked and not made by posix_spawn, which can neither limit a child nor tie its life to
// its parent's. Boost.Process 1.74, which Debian 12 has, waits with a limit by forking once more.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chain/base/status.h"

namespace postchain::service {

// A file descriptor that is closed with the object.
class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    ~Descriptor() { close(); }
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        close();
        fd_ = std::exchange(other.fd_, -1);
        return *this;
    }

    int get() const { return fd_; }
    void close();

  private:
    int fd_;
};

struct Pipe {
    Descriptor reads, writes;
};
// Errors (output).
Result<Pipe> make_pipe();

struct ProcessSettings {
    std::vector<std::string> words;   // the program, in PATH unless it has a '/', and its arguments
    std::string folder = {};          // where it starts; empty = here
    int in = -1, out = -1, err = -1;  // its streams; -1 = this process's
    int nice = 0;                     // added
    uint64_t memory = 0;              // bytes of its own that it may write (RLIMIT_DATA); 0 = any
};

// Bytes that libraries and threads of a process need beside its frames.
inline constexpr uint64_t kOwnMemory = uint64_t(2) << 30;

// Errors (output): it cannot be started.
Result<pid_t> start_process(const ProcessSettings& settings);

// The exit code of a process that has ended; 128 plus the number of the signal that ended it.
int code_of(int wait_status);
// Kills a process with its group, and waits for its end for some seconds at most.
void kill_process(pid_t process);

// A child with pipes to its stdin and from its stdout. It is killed with the object, unless it has
// ended, and always waited for.
class HelperProcess {
  public:
    HelperProcess() = default;
    ~HelperProcess() { end(); }
    HelperProcess(const HelperProcess&) = delete;
    HelperProcess& operator=(const HelperProcess&) = delete;

    Status start(ProcessSettings settings);  // errors (internal)
    bool runs();
    // False: the child has ended.
    bool send(std::string_view text);
    int from() const { return from_.get(); }
    void end();  // kills it

  private:
    Descriptor to_, from_;
    pid_t pid_ = -1;
};

struct ProgramResult {
    int exit_code = 0;
    std::string out, err;
};

// Runs a program with `input` on its standard input, and reads what it prints; `settings.in`, `out`
// and `err` are not used. After `limit`, or kStopGrace after `stop` was set, it is killed. Errors
// (output): it cannot be started, was killed, or prints too much.
inline constexpr std::chrono::milliseconds kStopGrace{2000};
Result<ProgramResult> run_program(ProcessSettings settings, const std::string& input,
                                  std::chrono::milliseconds limit,
                                  const std::atomic<bool>* stop = nullptr);

// For a shell: 'it'\''s'.
std::string shell_quoted(const std::string& word);

}  // namespace postchain::service
