#include "tools/service/work/slurm_queue.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>
#include <sstream>

#include "chain/base/text.h"
#include "tools/sequence/files/sequence.h"
#include "tools/service/store/job.h"
#include "tools/service/work/process.h"

namespace postchain::service {
namespace {

// slurmctld answers within seconds, or it is down.
constexpr auto kAnswerLimit = std::chrono::seconds(20);
constexpr const char* kSilence[] = {
    "Unable to contact", "timed out", "temporarily", "Connection", "communication",
    "Zero Bytes",        "backup",    "munge",       "Munge",      "authentication"};

std::string first_line(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

// The commands fail for a controller that is down or busy too.
bool is_silence(const std::string& text) {
    return std::ranges::any_of(
        kSilence, [&](const char* part) { return text.find(part) != std::string::npos; });
}

// The number of tasks in "7", "1-40%4", "3,5,9-12".
int count_of(const std::string& text) {
    const auto tasks = io::FrameRange::parse(text.substr(0, text.find('%')));
    return tasks.ok() ? int(tasks->frames.size()) : 1;
}

void add(ArrayState& tasks, const std::string& id, const std::string& state,
         const std::string& task) {
    const auto is = [&](std::initializer_list<const char*> names) {
        return std::ranges::any_of(names,
                                   [&](const char* name) { return state.starts_with(name); });
    };
    tasks.id = id;
    const int count = count_of(task);
    if (is({"PENDING", "REQUEUE", "CONFIGURING", "SUSPENDED", "SPECIAL_EXIT", "RESV_DEL_HOLD"})) {
        tasks.waiting += count;
    } else if (is({"RUNNING", "COMPLETING", "STAGE_OUT", "SIGNALING", "STOPPED", "RESIZING"})) {
        tasks.running += count;
    } else if (is({"COMPLETED"})) {
        tasks.done += count;
    } else {
        tasks.failed += count;
        tasks.message = "task " + task + ": " + state.substr(0, state.find(' '));
        std::from_chars(task.data(), task.data() + task.size(), tasks.failed_task);
    }
}

std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    std::istringstream text(line);
    for (std::string field; std::getline(text, field, '|');) fields.push_back(field);
    return fields;
}

// For jobs that have ended, and were forgotten.
bool is_unknown(const Status& status) {
    return status.message().find("Invalid job id") != std::string::npos;
}

std::string with_user(std::string word, const std::string& user) {
    constexpr std::string_view kUser = "{user}";
    for (size_t at = 0; (at = word.find(kUser, at)) != std::string::npos; at += user.size())
        word.replace(at, kUser.size(), user);
    return word;
}

}  // namespace

void add_tasks_of_squeue(const std::string& text, std::map<std::string, ArrayState>& jobs) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const auto fields = fields_of(line);
        if (fields.size() != 4) continue;
        const auto job = jobs.find(fields[3]);
        if (job != jobs.end()) add(job->second, fields[0], fields[2], fields[1]);
    }
}

void add_tasks_of_sacct(const std::string& text, std::map<std::string, ArrayState>& jobs) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const auto fields = fields_of(line);
        const size_t under = fields.empty() ? std::string::npos : fields[0].find('_');
        if (fields.size() != 3 || under == std::string::npos) continue;
        std::string task = fields[0].substr(under + 1);
        std::erase_if(task, [](char c) { return c == '[' || c == ']'; });
        const auto job = jobs.find(fields[2]);
        if (job != jobs.end()) add(job->second, fields[0].substr(0, under), fields[1], task);
    }
}

// Each task's words are in the script: the frames of all tasks may be more than a command may have.
std::string script_of(const TaskArray& job, const std::string& version) {
    std::string script = "#!/bin/sh\n";
    if (!version.empty()) {
        const std::string program = shell_quoted(job.command.front());
        script += concat("found=$(", program, " --version) || exit\n",  //
                         "if [ \"$found\" != ", shell_quoted("postchain " + version), " ]; then\n",
                         "    echo \"$(hostname) has $found, the service is postchain ", version,
                         "\" >&2\n    exit 2\nfi\n");
    }
    script += "set --";
    for (const std::string& word : job.command) script += " " + shell_quoted(word);
    script += "\ncase $SLURM_ARRAY_TASK_ID in\n";
    for (size_t i = 0; i < job.tasks.size(); ++i) {
        if (job.tasks[i].empty()) continue;
        script += concat(i + 1, ") set -- \"$@\"");
        for (const std::string& word : job.tasks[i]) script += " " + shell_quoted(word);
        script += ";;\n";
    }
    // What it prints on stdout are the lines that the service follows; sbatch has the rest.
    const std::string task = shell_quoted(job.log_folder) + "/$SLURM_ARRAY_TASK_ID";
    return script + "esac\nset -- \"$@\" --threads=\"${SLURM_CPUS_PER_TASK:-1}\"\n\"$@\" >> " +
           task + ".events\ncode=$?\necho $code > " + task + ".exit\nexit $code\n";
}

// The output of a command of Slurm that succeeds. Errors: (usage) it refuses; (output) Slurm does
// not answer.
Result<std::string> SlurmQueue::answer_of(const std::vector<std::string>& words,
                                          const std::string& input) const {
    if (stop_) return Status(StatusCode::output, "the service is shutting down");
    ASSIGN_OR_RETURN(const auto ran, run_program({words}, input, kAnswerLimit, &stop_));
    if (ran.exit_code != 0)
        return Status(is_silence(ran.err) ? StatusCode::output : StatusCode::usage,
                      concat(words.front(), ": ", first_line(ran.err)));
    return ran.out;
}

// Only administrators may ask for a negative one, so that the largest priority has 0.
int SlurmQueue::nice_of(const TaskRank& rank) const {
    return (kMaxPriority - rank.priority) * settings_.nice;
}

Result<std::string> SlurmQueue::submit(const TaskArray& job) {
    const std::string most = job.rank.most_tasks > 0 ? concat("%", job.rank.most_tasks) : "";
    std::vector<std::string> words = {"sbatch",
                                      "--parsable",
                                      "--requeue",
                                      "--open-mode=append",
                                      "--job-name=" + job.name,
                                      "--comment=" + job.comment,
                                      "--chdir=" + job.folder,
                                      concat("--array=1-", job.tasks.size(), most),
                                      concat("--nice=", nice_of(job.rank)),
                                      concat("--cpus-per-task=", settings_.cpus),
                                      "--output=" + job.log_folder + "/%a.log"};
    if (!settings_.memory.empty()) words.push_back("--mem=" + settings_.memory);
    if (!job.after.empty()) words.push_back("--dependency=afterany:" + job.after);
    for (const std::string& word : settings_.words) words.push_back(with_user(word, job.owner));
    ASSIGN_OR_RETURN(auto answer, answer_of(words, script_of(job, settings_.version)));
    const std::string id = first_line(answer).substr(0, answer.find_first_of(";\n"));
    if (id.empty() ||
        !std::ranges::all_of(id, [](unsigned char c) { return std::isdigit(c) != 0; }))
        return Status(StatusCode::output, "sbatch: did not print a job's id: " + answer);
    return id;
}

Result<std::map<std::string, ArrayState>> SlurmQueue::look(const std::vector<ArrayName>& jobs) {
    std::map<std::string, ArrayState> tasks;
    std::string names;
    for (const ArrayName& job : jobs) {
        tasks[job.name];
        names += (names.empty() ? "" : ",") + job.name;
    }
    // Without names too: it shows that slurmctld answers.
    std::vector<std::string> words = {"squeue", "--me", "--noheader", "--states=all",
                                      "--format=%F|%K|%T|%j"};
    if (!names.empty()) words.push_back("--name=" + names);
    const auto now = answer_of(words);
    if (!now.ok()) return Status(StatusCode::output, now.status().message());
    add_tasks_of_squeue(*now, tasks);
    std::string ended;
    for (const ArrayName& job : jobs)
        if (!job.id.empty() && !tasks[job.name].known())
            ended += (ended.empty() ? "" : ",") + job.id;
    if (ended.empty()) return tasks;
    // They ended some minutes ago. Without accounting only the outputs tell how.
    const auto accounted =
        answer_of({"sacct", "-n", "-X", "-P", "-j", ended, "-o", "JobID,State,JobName"});
    if (accounted.ok()) add_tasks_of_sacct(*accounted, tasks);
    return tasks;
}

Status SlurmQueue::change(const std::string& id, const TaskRank& rank) {
    const auto done =
        answer_of({"scontrol", "update", "JobId=" + id, concat("Nice=", nice_of(rank)),
                   concat("ArrayTaskThrottle=", rank.most_tasks)});
    return done.ok() || is_unknown(done.status()) ? Status() : done.status();
}

Status SlurmQueue::cancel(const std::string& id) {
    const auto done = answer_of({"scancel", id});
    return done.ok() || is_unknown(done.status()) ? Status() : done.status();
}

}  // namespace postchain::service
