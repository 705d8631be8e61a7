#include "tests/command/command.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <thread>

namespace postchain::test {

namespace {

// Runs between fork and exec, in a single-threaded process.
[[noreturn]] void become(const Arguments& command, const Launch& launch,
                         const std::string& folder) {
    const std::string out = launch.stdout_path.empty() ? folder + "/stdout" : launch.stdout_path;
    const int in_fd = open("/dev/null", O_RDONLY);
    const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    const int err_fd = open((folder + "/stderr").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(in_fd, STDIN_FILENO);
    dup2(out_fd, STDOUT_FILENO);
    dup2(err_fd, STDERR_FILENO);
    for (int fd = 3; fd < 64; ++fd) close(fd);
    if (launch.close_stdout) close(STDOUT_FILENO);
    if (launch.close_stderr) close(STDERR_FILENO);
    for (const auto& [name, value] : launch.environment) {
        if (value)
            setenv(name.c_str(), value->c_str(), 1);
        else
            unsetenv(name.c_str());
    }
    if (!launch.folder.empty() && chdir(launch.folder.c_str()) != 0) _exit(125);
    if (launch.file_bytes) {
        const rlimit limit = {rlim_t(*launch.file_bytes), rlim_t(*launch.file_bytes)};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    if (launch.memory_bytes) {
        const rlimit limit = {rlim_t(*launch.memory_bytes), rlim_t(*launch.memory_bytes)};
        setrlimit(RLIMIT_AS, &limit);
    }
    std::vector<char*> argv;
    for (const auto& word : command) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
    _exit(126);
}

}  // namespace

std::string Outcome::text() const {
    std::ostringstream text;
    text << "exit code " << code << ", signal " << signal << "\nstdout: " << out.substr(0, 2000)
         << "\nstderr: " << err.substr(0, 4000);
    return text.str();
}

Process::Process(const Arguments& command, const Launch& launch) : launch_(launch) {
    pid_ = fork();
    if (pid_ == 0) become(command, launch_, folder_.path());
    if (pid_ < 0) ADD_FAILURE() << "fork failed";
}

Process::~Process() {
    if (!done_ && pid_ > 0) {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
}

void Process::send(int signal) const {
    if (!done_) kill(pid_, signal);
}

bool Process::running() {
    if (done_) return false;
    rusage usage = {};
    if (wait4(pid_, &status_, WNOHANG, &usage) != pid_) return true;
    peak_kib_ = usage.ru_maxrss;
    done_ = true;
    return false;
}

Outcome Process::wait() {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration<double>(launch_.timeout_s);
    while (running()) {
        if (Clock::now() > end) {
            ADD_FAILURE() << "the command did not end within " << launch_.timeout_s << " s";
            kill(pid_, SIGKILL);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    Outcome outcome;
    outcome.code = WIFEXITED(status_) ? WEXITSTATUS(status_) : -1;
    outcome.signal = WIFSIGNALED(status_) ? WTERMSIG(status_) : 0;
    outcome.peak_kib = peak_kib_;
    outcome.err = read_text(folder_.path("stderr"));
    if (launch_.stdout_path.empty()) outcome.out = read_text(folder_.path("stdout"));
    return outcome;
}

Arguments with_command(const Arguments& arguments) {
    return joined({POSTCHAIN_COMMAND}, arguments);
}

Outcome run(const Arguments& arguments, const Launch& launch) {
    return run_program(with_command(arguments), launch);
}

Outcome run_program(const Arguments& command, const Launch& launch) {
    return Process(command, launch).wait();
}

std::vector<Json> json_lines(const std::string& text) {
    std::vector<Json> values;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        values.push_back(Json::parse(line, nullptr, false));
        EXPECT_TRUE(values.back().is_object()) << line;
    }
    return values;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

void expect_ends(const Outcome& outcome, int code, const std::vector<std::string>& words) {
    EXPECT_EQ(outcome.code, code) << outcome.text();
    for (const std::string& word : words)
        EXPECT_TRUE(contains(outcome.err, word)) << word << "\n" << outcome.text();
}

void expect_prints(const Outcome& outcome, int code, const std::vector<std::string>& words) {
    EXPECT_EQ(outcome.code, code) << outcome.text();
    for (const std::string& word : words)
        EXPECT_TRUE(contains(outcome.out, word)) << word << "\n" << outcome.text();
}

std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
    std::vector<std::string> found;
    const std::regex expression(pattern);
    for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it)
        found.push_back((*it)[1]);
    return found;
}

}  // namespace postchain::test
