#include "tools/service/work/helper_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

extern char** environ;

namespace postchain::service {
namespace {

bool open_pipe(HelperEnd& read, HelperEnd& write) {
    std::array<int, 2> ends;
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read.fd = ends[0];
    write.fd = ends[1];
    return true;
}

}  // namespace

void HelperEnd::close() {
    if (fd >= 0) ::close(fd);
    fd = -1;
}

Status HelperProcess::start(const std::string& program, const std::string& word) {
    end();
    HelperEnd read, write;
    int fault = open_pipe(read, to_) && open_pipe(from_, write) ? 0 : errno;
    if (fault == 0) {
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, read.fd, STDIN_FILENO);
        posix_spawn_file_actions_adddup2(&actions, write.fd, STDOUT_FILENO);
        posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
        std::array<char*, 3> words = {const_cast<char*>(program.c_str()),
                                      const_cast<char*>(word.c_str()), nullptr};
        fault = posix_spawn(&pid_, program.c_str(), &actions, nullptr, words.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
    }
    if (fault == 0) return Status();
    pid_ = -1;
    return Status(StatusCode::internal,
                  concat("a process for images cannot be started: ", std::strerror(fault)));
}

bool HelperProcess::runs() {
    if (pid_ >= 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ >= 0;
}

bool HelperProcess::send(std::string_view text) {
    return send_all(to_.fd, text);
}

int HelperProcess::wait() {
    int state = 0;
    while (::waitpid(pid_, &state, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return state;
}

void HelperProcess::end() {
    to_.close();
    from_.close();
    if (pid_ < 0) return;
    ::kill(pid_, SIGKILL);
    // One of the lowest priority may need seconds for its end on a busy machine. Nobody waits for
    // it: the system removes it after this process.
    constexpr auto kStep = std::chrono::milliseconds(1);
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    while (::waitpid(pid_, nullptr, WNOHANG) == 0 && std::chrono::steady_clock::now() < until)
        std::this_thread::sleep_for(kStep);
    pid_ = -1;
}

bool send_all(int fd, std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(fd, text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

void set_limit(decltype(RLIMIT_AS) what, rlim_t most) {
    const rlimit both = {most, most};
    (void)setrlimit(what, &both);
}

}  // namespace postchain::service
