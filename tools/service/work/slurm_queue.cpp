#include "tools/service/work/slurm_queue.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <csignal>
#include <cstring>
#include <sstream>

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

namespace {

// slurmctld answers within seconds, or it is down: sbatch and squeue then try for a minute.
constexpr auto kLimit = std::chrono::seconds(90);
constexpr const char* kSilence[] = {"Unable to contact", "timed out",  "temporarily", "Connection",
                                    "communication",     "Zero Bytes", "backup",      "munge",
                                    "authentication"};

std::string first_line(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

// The commands fail for a controller that is down or busy too.
bool is_silence(const std::string& text) {
    return std::ranges::any_of(
        kSilence, [&](const char* part) { return text.find(part) != std::string::npos; });
}

// The output of a command of Slurm that succeeds. Errors: (usage) it refuses; (output) Slurm does
// not answer.
Result<std::string> answer_of(const std::vector<std::string>& words,
                              const std::string& input = "") {
    ASSIGN_OR_RETURN(const auto ran, run_program(words, input, kLimit));
    if (ran.exit_code != 0)
        return Status(is_silence(ran.err) ? StatusCode::output : StatusCode::usage,
                      concat(words.front(), ": ", first_line(ran.err)));
    return ran.out;
}

// The value of "Name=value" in a line of scontrol.
std::string value_of(const std::string& line, const std::string& name) {
    const std::string key = " " + name + "=";
    const size_t at = (" " + line).find(key);
    if (at == std::string::npos) return "";
    const size_t begin = at + key.size() - 1;
    return line.substr(begin, line.find(' ', begin) - begin);
}

// The number of tasks in "7", "1-40%4", "3,5,9-12".
int count_of(std::string text) {
    text = text.substr(0, text.find('%'));
    int count = 0;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        const size_t dash = part.find('-');
        int first = 0, last = 0;
        std::from_chars(part.data(), part.data() + std::min(dash, part.size()), first);
        last = first;
        if (dash != std::string::npos)
            std::from_chars(part.data() + dash + 1, part.data() + part.size(), last);
        count += std::max(1, last - first + 1);
    }
    return std::max(1, count);
}

void add(RemoteTasks& tasks, const std::string& state, int count, const std::string& task) {
    const auto is = [&](std::initializer_list<const char*> names) {
        return std::ranges::any_of(names,
                                   [&](const char* name) { return state.starts_with(name); });
    };
    if (is({"PENDING", "REQUEUE", "CONFIGURING", "SUSPENDED", "SPECIAL_EXIT", "RESV_DEL_HOLD"})) {
        tasks.waiting += count;
    } else if (is({"RUNNING", "COMPLETING", "STAGE_OUT", "SIGNALING", "STOPPED", "RESIZING"})) {
        tasks.running += count;
    } else if (is({"COMPLETED"})) {
        tasks.done += count;
    } else {
        tasks.failed += count;
        tasks.message = "task " + task + ": " + state.substr(0, state.find(' '));
    }
}

bool is_unknown(const Status& status) {
    return status.message().find("Invalid job id") != std::string::npos;
}

}  // namespace

RemoteTasks tasks_of_scontrol(const std::string& text) {
    RemoteTasks tasks;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::string state = value_of(line, "JobState"), task = value_of(line, "ArrayTaskId");
        if (!state.empty()) add(tasks, state, count_of(task), task);
    }
    return tasks;
}

RemoteTasks tasks_of_sacct(const std::string& text) {
    RemoteTasks tasks;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const size_t bar = line.find('|'), under = line.find('_');
        if (bar == std::string::npos || under == std::string::npos) continue;
        std::string task = line.substr(under + 1, bar - under - 1);
        std::erase_if(task, [](char c) { return c == '[' || c == ']'; });
        add(tasks, line.substr(bar + 1), count_of(task), task);
    }
    return tasks;
}

Result<std::string> SlurmQueue::submit(const RemoteJob& job) {
    std::vector<std::string> words = {"sbatch",
                                      "--parsable",
                                      "--requeue",
                                      "--open-mode=append",
                                      "--job-name=" + job.name,
                                      concat("--array=1-", job.tasks),
                                      "--output=" + job.log_folder + "/%a.log"};
    if (!job.max_memory.empty()) words.push_back("--mem=" + job.max_memory);
    words.insert(words.end(), words_.begin(), words_.end());
    std::string script = "#!/bin/sh\nexec";
    for (const std::string& word : job.command) script += " " + shell_quoted(word);
    script += concat(" --chunk \"$SLURM_ARRAY_TASK_ID/", job.tasks, "\"\n");
    ASSIGN_OR_RETURN(auto answer, answer_of(words, script));
    const std::string id = first_line(answer).substr(0, answer.find_first_of(";\n"));
    if (id.empty() ||
        !std::ranges::all_of(id, [](unsigned char c) { return std::isdigit(c) != 0; }))
        return Status(StatusCode::output, "sbatch: did not print a job's id: " + answer);
    return id;
}

Result<std::string> SlurmQueue::find(const std::string& name) {
    ASSIGN_OR_RETURN(auto answer, answer_of({"squeue", "-h", "--name=" + name, "-o", "%F"}));
    return first_line(answer);
}

Result<RemoteTasks> SlurmQueue::look(const std::string& id) {
    const auto now = answer_of({"scontrol", "show", "job", "-o", id});
    if (now.ok()) return tasks_of_scontrol(*now);
    if (!is_unknown(now.status())) return now.status();
    // Ended some minutes ago. Without accounting only the outputs tell how.
    const auto ended = answer_of({"sacct", "-n", "-X", "-P", "-j", id, "-o", "JobID,State"});
    RemoteTasks tasks;
    tasks.known = false;
    return ended.ok() && !ended->empty() ? tasks_of_sacct(*ended) : tasks;
}

Status SlurmQueue::cancel(const std::string& id) {
    const auto done = answer_of({"scancel", id});
    return done.ok() || is_unknown(done.status()) ? Status() : done.status();
}

}  // namespace postchain::service
