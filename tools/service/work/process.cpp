#include "tools/service/work/process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

// The header of glibc 2.36 does not say so itself.
extern "C" {
#include <sys/pidfd.h>
}

namespace postchain::service {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr size_t kMaxOutput = size_t(130) << 20;  // bytes; an image of 4096 x 4096 has 128 MiB
constexpr milliseconds kSlice{100};               // between looks at `stop`
constexpr milliseconds kReap{2000};               // until a killed process has ended

bool write_all(int fd, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(fd, text.data(), text.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        text.remove_prefix(size_t(written));
    }
    return true;
}

// A file in memory: a program that does not read its input holds nobody up.
Result<Descriptor> input_file(const std::string& input) {
    Descriptor file(::memfd_create("input", MFD_CLOEXEC));
    if (file.get() < 0 || !write_all(file.get(), input) || ::lseek(file.get(), 0, SEEK_SET) != 0)
        return Status(StatusCode::output, std::strerror(errno));
    return file;
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

// In the child, between fork and exec: calls that are safe after a signal, and nothing else.
// Returns only if the program cannot be started.
void become(const ProcessSettings& settings, char* const* words, pid_t parent) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) _exit(1);  // it died before that
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    for (int signal = 1; signal < NSIG; ++signal) (void)::signal(signal, SIG_DFL);
    // Copies above the standard streams first, so that none replaces another's source.
    std::array<int, 3> streams = {settings.in, settings.out, settings.err};
    for (int& stream : streams)
        if (stream >= 0) stream = ::fcntl(stream, F_DUPFD_CLOEXEC, 3);
    for (int i = 0; i < 3; ++i)
        if (streams[size_t(i)] >= 0) ::dup2(streams[size_t(i)], i);
    // Also what a library has opened.
    ::close_range(3, ~0U, CLOSE_RANGE_CLOEXEC);
    if (!settings.folder.empty() && ::chdir(settings.folder.c_str()) != 0) return;
    if (settings.nice != 0) (void)!::nice(settings.nice);
    if (settings.memory > 0) {
        const rlimit most = {settings.memory, settings.memory};
        ::setrlimit(RLIMIT_DATA, &most);
    }
    const rlimit no_core = {0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    ::execvp(words[0], words);
}

}  // namespace

void Descriptor::close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
}

Result<Pipe> make_pipe() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return Status(StatusCode::output, std::strerror(errno));
    return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

Result<pid_t> start_process(const ProcessSettings& settings) {
    const std::string& name = settings.words.front();
    std::vector<char*> words;
    for (const std::string& word : settings.words) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    // Closed by exec; otherwise it has the reason.
    ASSIGN_OR_RETURN(auto fault, make_pipe().at(name));
    const pid_t parent = ::getpid();
    const pid_t child = ::fork();
    if (child < 0) return Status(StatusCode::output, concat(name, ": ", std::strerror(errno)));
    if (child == 0) {
        become(settings, words.data(), parent);
        const int error = errno;
        (void)!::write(fault.writes.get(), &error, sizeof(error));
        _exit(127);
    }
    // Here too, so that a signal to the group finds it at once.
    ::setpgid(child, child);
    fault.writes.close();
    int error = 0;
    ssize_t got = 0;
    do {
        got = ::read(fault.reads.get(), &error, sizeof(error));
    } while (got < 0 && errno == EINTR);
    if (got <= 0) return child;
    ::waitpid(child, nullptr, 0);
    return Status(StatusCode::output, concat(name, ": ", std::strerror(error),
                                             "; install it, or add its folder to PATH"));
}

int code_of(int wait_status) {
    return WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
}

void kill_process(pid_t process) {
    ::kill(-process, SIGKILL);
    const Descriptor handle(::pidfd_open(process, 0));
    // Nobody waits for one that hangs in a disk: the system removes it after this process.
    if (handle.get() >= 0 && !wait_for_end(handle.get(), kReap)) return;
    while (::waitpid(process, nullptr, WNOHANG) < 0 && errno == EINTR) {
    }
}

Status HelperProcess::start(ProcessSettings settings) {
    end();
    const auto started = [&]() -> Status {
        ASSIGN_OR_RETURN(auto in, make_pipe());
        ASSIGN_OR_RETURN(auto out, make_pipe());
        settings.in = in.reads.get();
        settings.out = out.writes.get();
        ASSIGN_OR_RETURN(pid_, start_process(settings));
        to_ = std::move(in.writes);
        from_ = std::move(out.reads);
        return Status();
    }();
    return started.ok() ? Status() : Status(StatusCode::internal, started.message());
}

bool HelperProcess::runs() {
    if (pid_ >= 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ >= 0;
}

bool HelperProcess::send(std::string_view text) {
    return write_all(to_.get(), text);
}

void HelperProcess::end() {
    to_.close();
    from_.close();
    if (pid_ >= 0) kill_process(pid_);
    pid_ = -1;
}

std::string shell_quoted(const std::string& word) {
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

Result<ProgramResult> run_program(ProcessSettings settings, const std::string& input,
                                  milliseconds limit, const std::atomic<bool>* stop) {
    const std::string& program = settings.words.front();
    const std::string name = program.substr(program.rfind('/') + 1);
    ASSIGN_OR_RETURN(auto out, make_pipe().at(name));
    ASSIGN_OR_RETURN(auto err, make_pipe().at(name));
    ASSIGN_OR_RETURN(auto in, input_file(input).at(name));
    for (const Pipe* pipe : {&out, &err}) ::fcntl(pipe->reads.get(), F_SETFL, O_NONBLOCK);
    settings.in = in.get();
    settings.out = out.writes.get();
    settings.err = err.writes.get();
    ASSIGN_OR_RETURN(const pid_t child, start_process(settings));
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
    result.exit_code = code_of(status);
    return result;
}

}  // namespace postchain::service
