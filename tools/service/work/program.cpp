#include "tools/service/work/program.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>

extern char** environ;

namespace postchain::service {
namespace {

class Pipe {
  public:
    Pipe() { open_ = ::pipe2(ends_.data(), O_CLOEXEC) == 0; }
    ~Pipe() {
        close(0);
        close(1);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;

    bool is_open() const { return open_; }
    int end(size_t which) const { return ends_[which]; }
    void close(size_t which) {
        if (ends_[which] >= 0) ::close(ends_[which]);
        ends_[which] = -1;
    }

  private:
    std::array<int, 2> ends_ = {-1, -1};
    bool open_ = false;
};

}  // namespace

std::string shell_quoted(const std::string& word) {
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

Result<ProgramResult> run_program(const std::vector<std::string>& words, const std::string& input,
                                  std::chrono::milliseconds limit) {
    const std::string& name = words.front();
    Pipe in, out, err;
    if (!in.is_open() || !out.is_open() || !err.is_open())
        return Status(StatusCode::output, name + ": " + std::strerror(errno));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in.end(0), 0);
    posix_spawn_file_actions_adddup2(&actions, out.end(1), 1);
    posix_spawn_file_actions_adddup2(&actions, err.end(1), 2);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t child = 0;
    const int failed =
        posix_spawnp(&child, name.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        return Status(StatusCode::output, concat(name, ": ", std::strerror(failed),
                                                 "; install it, or add its folder to PATH"));
    in.close(0);
    out.close(1);
    err.close(1);
    // The input is a few lines, which fit into a pipe.
    const ssize_t written = ::write(in.end(1), input.data(), input.size());
    in.close(1);
    ProgramResult result;
    const auto end = std::chrono::steady_clock::now() + limit;
    bool late = size_t(written) != input.size();
    std::array<pollfd, 2> reads = {pollfd{out.end(0), POLLIN, 0}, pollfd{err.end(0), POLLIN, 0}};
    while (!late && (reads[0].fd >= 0 || reads[1].fd >= 0)) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
            end - std::chrono::steady_clock::now());
        const int ready = left.count() <= 0 ? 0 : ::poll(reads.data(), 2, int(left.count()));
        if (ready < 0 && errno == EINTR) continue;
        late = ready <= 0;
        for (size_t i = 0; i < 2 && !late; ++i) {
            if (reads[i].fd < 0 || reads[i].revents == 0) continue;
            std::array<char, 4096> part;
            const ssize_t got = ::read(reads[i].fd, part.data(), part.size());
            if (got > 0)
                (i == 0 ? result.out : result.err).append(part.data(), size_t(got));
            else
                reads[i].fd = -1;
        }
    }
    if (late) ::kill(child, SIGKILL);
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (late)
        return Status(StatusCode::output,
                      concat(name, ": did not answer within ", limit.count() / 1000, " s"));
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
}

}  // namespace postchain::service
