#include "tools/service/work/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <utility>

// The header of glibc 2.36 does not say so itself.
extern "C" {
#include <sys/pidfd.h>
}

extern char** environ;

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr size_t kMaxOutput = size_t(64) << 20;  // bytes
constexpr milliseconds kSlice{100};              // between looks at `stop`
constexpr milliseconds kReap{2000};              // until a killed program has ended

class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    ~Descriptor() { close(); }
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&&) = delete;

    int get() const { return fd_; }
    void close() {
        if (fd_ >= 0) ::close(fd_);
        fd_ = -1;
    }

  private:
    int fd_;
};

struct Pipe {
    Descriptor reads, writes;
};

Result<Pipe> make_pipe() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return Status(StatusCode::output, std::strerror(errno));
    ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
    return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

// A file in memory: a program that does not read its input holds nobody up.
Result<Descriptor> input_file(const std::string& input) {
    Descriptor file(::memfd_create("input", MFD_CLOEXEC));
    bool good = file.get() >= 0;
    for (size_t at = 0; good && at < input.size();) {
        const ssize_t written = ::write(file.get(), input.data() + at, input.size() - at);
        good = written > 0;
        at += good ? size_t(written) : 0;
    }
    if (!good || ::lseek(file.get(), 0, SEEK_SET) != 0)
        return Status(StatusCode::output, std::strerror(errno));
    return file;
}

// In a process group of its own, without the signal mask and handlers of this process.
Result<pid_t> spawn(const std::vector<std::string>& words, int in, int out, int err) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in, 0);
    posix_spawn_file_actions_adddup2(&actions, out, 1);
    posix_spawn_file_actions_adddup2(&actions, err, 2);
    posix_spawn_file_actions_addclosefrom_np(&actions, 3);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(
        &attributes, short(POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF));
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t child = 0;
    const int failed =
        ::posix_spawnp(&child, arguments.front(), &actions, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        return Status(StatusCode::output,
                      concat(std::strerror(failed), "; install it, or add its folder to PATH"));
    return child;
}

// Appends what can be read now. False at the end of the pipe.
bool read_part(int fd, std::string& text) {
    std::array<char, 65536> part;
    while (text.size() <= kMaxOutput) {
        const ssize_t got = ::read(fd, part.data(), part.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && errno == EAGAIN) return true;
        if (got <= 0) return false;
        text.append(part.data(), size_t(got));
    }
    return true;
}

// Waits until the process has ended, at most so long.
bool wait_for_end(int process, milliseconds limit) {
    pollfd ended = {process, POLLIN, 0};
    return ::poll(&ended, 1, int(limit.count())) == 1;
}

}  // namespace

std::string shell_quoted(const std::string& word) {
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

Result<ProgramResult> run_program(const std::vector<std::string>& words, const std::string& input,
                                  milliseconds limit, const std::atomic<bool>* stop) {
    const std::string& name = words.front();
    ASSIGN_OR_RETURN(auto out, make_pipe().at(name));
    ASSIGN_OR_RETURN(auto err, make_pipe().at(name));
    ASSIGN_OR_RETURN(auto in, input_file(input).at(name));
    ASSIGN_OR_RETURN(const pid_t child,
                     spawn(words, in.get(), out.writes.get(), err.writes.get()).at(name));
    out.writes.close();
    err.writes.close();
    const Descriptor process(::pidfd_open(child, 0));
    ProgramResult result;
    auto end = Clock::now() + limit;
    bool stopped = false, late = process.get() < 0, ended = false;
    std::array<pollfd, 3> waits = {pollfd{out.reads.get(), POLLIN, 0},
                                   pollfd{err.reads.get(), POLLIN, 0},
                                   pollfd{process.get(), POLLIN, 0}};
    while (!late && !ended) {
        if (stop && *stop && !stopped) {
            stopped = true;
            end = std::min(end, Clock::now() + kStopGrace);
        }
        const auto left = std::chrono::ceil<milliseconds>(end - Clock::now());
        late = left.count() <= 0 || result.out.size() + result.err.size() > kMaxOutput;
        if (late) break;
        ::poll(waits.data(), waits.size(), int(std::min(left, kSlice).count()));
        // The end is looked at first: what the program printed before it is then in the pipes.
        ended = wait_for_end(process.get(), milliseconds(0));
        if (!read_part(out.reads.get(), result.out)) waits[0].fd = -1;
        if (!read_part(err.reads.get(), result.err)) waits[1].fd = -1;
    }
    // Also what it left running.
    ::kill(-child, SIGKILL);
    int status = 0;
    if (process.get() < 0 || wait_for_end(process.get(), kReap)) {
        while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
    }
    if (late)
        return Status(StatusCode::output, stopped ? name + ": was ended with the service"
                                          : result.out.size() + result.err.size() > kMaxOutput
                                              ? name + ": printed too much"
                                              : concat(name, ": did not answer within ",
                                                       double(limit.count()) / 1000, " s"));
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
}

}  // namespace postchain::service
