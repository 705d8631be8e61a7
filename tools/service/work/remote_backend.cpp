#include "tools/service/work/remote_backend.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <utility>

#include "chain/base/printable.h"
#include "chain/base/text.h"
#include "config/chain_file.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/files/output_files.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxQueued = 1'000'000;  // as of --max-queue
constexpr int kFailedPolls = 3;           // in a row, until the service is not ready

// Words of `postchain run` for the settings that the job gives, other than its files and frames.
std::vector<std::string> words_of(const JobRequest& request) {
    std::vector<std::string> words = {"--on-error=continue"};
    for (const auto& [key, value] : request.run.given) {
        if (key == "input" || key == "behind") continue;
        const std::string option = option_name(key);
        if (const bool* flag = std::get_if<bool>(&value))
            words.push_back(*flag ? option : "--no-" + option.substr(2));
        else
            words.push_back(option + "=" + text_of(value));
    }
    // These are not in `given`: they do not change the result.
    if (!request.run.sidecar) words.emplace_back("--no-sidecar");
    if (request.run.preview) words.emplace_back("--png");
    if (const uint64_t bytes = request.run.source.max_memory;
        bytes != sequence::default_memory_limit())
        words.push_back(concat("--max-memory=", bytes));
    return words;
}

// "1-6,8,10-20x5": a long job's frames fit into a command.
std::string stepped_ranges_of(std::span<const int> frames) {
    std::string text;
    for (size_t at = 0; at < frames.size();) {
        const int first = frames[at];
        const int step = at + 1 < frames.size() ? frames[at + 1] - first : 0;
        size_t last = at;
        while (step > 0 && last + 1 < frames.size() && frames[last + 1] - frames[last] == step)
            ++last;
        if (step > 1 && last == at + 1) last = at;
        text += concat(text.empty() ? "" : ",", first);
        if (last > at) text += concat("-", frames[last]);
        if (last > at && step > 1) text += concat("x", step);
        at = last + 1;
    }
    return text;
}

// Nobody else can know it before it is in the queue.
std::string random_name() {
    std::random_device random;
    const auto half = [&] { return hex_of(uint64_t(random()) << 32 | random()); };
    return "postchain-" + half() + half();
}

// The end of a task's messages, without control characters.
std::string last_line(const std::string& path) {
    constexpr std::streamoff kMost = 300;  // bytes
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? std::streamoff(file.tellg()) : 0;
    file.seekg(std::max<std::streamoff>(0, size - kMost));
    std::string last;
    for (std::string line; std::getline(file, line);)
        if (!line.empty()) last = line;
    return printable(last);
}

std::string input_words(const io::InputSpec& input) {
    if (!input.separate_files()) return input.color().text();
    std::string text;
    for (const auto& [role, pattern] : input.patterns)
        text += concat(text.empty() ? "" : ",", io::InputSpec::word_of(role), "=", pattern.text());
    return text;
}

}  // namespace

Status take_farm_folder(const std::string& folder, const std::vector<std::string>& roots) {
    std::error_code error;
    fs::create_directories(fs::path(folder).parent_path(), error);
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        return Status(StatusCode::output, concat(folder, ": ", std::strerror(errno)));
    struct stat found = {};
    if (::lstat(folder.c_str(), &found) != 0 || !S_ISDIR(found.st_mode))
        return Status(StatusCode::usage, folder + ": is not a folder; links are refused");
    if (found.st_uid != ::geteuid() || (found.st_mode & 077) != 0)
        return Status(StatusCode::usage,
                      folder + ": must belong to this user and be closed to others (mode 0700)");
    const std::string real = fs::canonical(folder, error).string() + "/";
    for (const std::string& root : roots)
        if (error || real.starts_with(root + "/") || (root + "/").starts_with(real))
            return Status(StatusCode::usage, concat(folder, ": must be outside of the root ", root,
                                                    ", whose users could change the tasks"));
    return Status();
}

Status write_task_file(const std::string& path, const std::string& text) {
    std::ofstream out(path);
    out << text;
    out.close();
    return out ? Status()
               : Status(StatusCode::output, path + ": cannot be written; see --farm-folder");
}

RemoteBackend::RemoteBackend(JobStore& store, const Readers& readers,
                             const RemoteSettings& settings)
    : store_(store), readers_(readers), settings_(settings) {}

RemoteBackend::~RemoteBackend() {
    end();
}

Status RemoteBackend::begin() {
    clean_up();
    // Jobs that an earlier process handed over are followed, whatever has room.
    ASSIGN_OR_RETURN(const auto queued, store_.jobs("queued", "", kMaxQueued));
    for (const Job& job : queued) {
        ASSIGN_OR_RETURN(const auto remote, store_.remote(job.id));
        if (!remote.empty()) RETURN_IF_ERROR(store_.start(job.id).status());
    }
    auto thread = start_thread([this, lost = lost_] {
        loop();
        *lost = 0;
    });
    if (thread.ok()) thread_ = std::move(*thread);
    return thread.status();
}

void RemoteBackend::wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    changed_.notify_all();
}

// The tasks go on; the next process follows them. A queue or a disk that hangs is not waited for.
void RemoteBackend::drain() {
    std::unique_lock lock(mutex_);
    ends_ = true;
    settings_.queue->stop();
    changed_.notify_all();
    if (*lost_ > 0 || changed_.wait_for(lock, settings_.drain, [&] { return !began_; })) return;
    *lost_ = 1;
    thread_.detach();
}

size_t RemoteBackend::end() {
    drain();
    if (thread_.joinable()) thread_.join();
    return *lost_;
}

BackendState RemoteBackend::state() const {
    const std::lock_guard lock(mutex_);
    BackendState state;
    const auto silence = Clock::now() - heard_;
    state.works = silence <= settings_.silence && failed_polls_ < kFailedPolls;
    state.renderer = settings_.queue->name();
    state.trouble = trouble_;
    if (silence > settings_.silence)
        state.trouble = concat(settings_.queue->name(), " has not answered for ",
                               std::chrono::duration_cast<std::chrono::seconds>(silence).count(),
                               " s", trouble_.empty() ? "" : ": ", trouble_);
    state.lost = *lost_;
    if (began_) state.oldest_step_s = std::chrono::duration<double>(Clock::now() - *began_).count();
    return state;
}

void RemoteBackend::loop() {
    std::unique_lock lock(mutex_);
    while (!ends_) {
        awake_ = false;
        began_ = Clock::now();
        lock.unlock();
        std::string failure;
        try {
            poll_queue();
        } catch (...) {
            failure = status_of_exception("following the jobs").message();
        }
        lock.lock();
        // A later poll may succeed, such as after a lack of memory.
        failed_polls_ = failure.empty() ? 0 : failed_polls_ + 1;
        if (!failure.empty()) trouble_ = failure;
        began_.reset();
        changed_.notify_all();
        changed_.wait_for(lock, idle_ ? settings_.idle_poll : settings_.poll,
                          [&] { return ends_ || awake_; });
    }
}

bool RemoteBackend::ends() const {
    const std::lock_guard lock(mutex_);
    return ends_;
}

RemoteBackend::Handed RemoteBackend::handed_of(const Job& job, const std::string& remote) {
    Handed handed;
    handed.job = job;
    std::istringstream words(remote);
    words >> handed.remote.name >> handed.remote.id >> handed.report.id;
    if (job.kind == JobKind::study) handed.report.name = handed.remote.name + "-report";
    return handed;
}

void RemoteBackend::hear_from_queue() {
    const std::lock_guard lock(mutex_);
    heard_ = Clock::now();
}

namespace {

// Each user has an equal part of the tasks that may run, and so has each job of a user.
std::map<std::string, RemoteRank> ranks_of(const std::vector<Job>& jobs, int most_tasks) {
    std::map<std::string, int> jobs_of;  // by owner
    for (const Job& job : jobs) ++jobs_of[job.owner];
    std::map<std::string, RemoteRank> ranks;
    for (const Job& job : jobs) {
        const int share = most_tasks / int(jobs_of.size()) / jobs_of[job.owner];
        ranks[job.id] = {job.priority, most_tasks > 0 ? std::max(1, share) : 0};
    }
    return ranks;
}

}  // namespace

void RemoteBackend::poll_queue() {
    std::string trouble;
    const auto note = [&](const Status& status) {
        if (!status.ok() && trouble.empty()) trouble = status.message();
    };
    const auto tell = [&] {
        const std::lock_guard lock(mutex_);
        trouble_ = trouble;
    };
    std::vector<Handed> handed;
    std::vector<RemoteName> names;
    std::vector<Job> unfinished;
    const auto known = store_.remotes();
    note(known.status());
    if (!known.ok()) return tell();
    for (const auto& [job, remote] : *known) {
        handed.push_back(handed_of(job, remote));
        names.push_back(handed.back().remote);
        if (!handed.back().report.name.empty()) names.push_back(handed.back().report);
        if (job.ended_ms == 0) unfinished.push_back(job);
    }
    // One call for all jobs. Before the outputs: what is missing afterward was not made.
    const auto tasks = settings_.queue->look(names);
    note(tasks.status());
    if (!tasks.ok()) return tell();
    hear_from_queue();
    const auto ranks = ranks_of(unfinished, settings_.max_tasks);
    for (const Handed& one : handed) {
        if (ends()) return;
        const auto of = [&](const RemoteName& remote) {
            const auto found = tasks->find(remote.name);
            return found == tasks->end() ? RemoteTasks() : found->second;
        };
        const auto rank = ranks.find(one.job.id);
        const Status status = guarded(one.job, [&] {
            return follow(one, {of(one.remote), of(one.report)},
                          rank == ranks.end() ? RemoteRank() : rank->second);
        });
        note(status);
        if (status.ok()) hear_from_queue();
    }
    note(take_waiting());
    idle_ = handed.empty() && trouble.empty();
    tell();
}

Status RemoteBackend::take_waiting() {
    Status first;
    const auto note = [&](const Status& status) {
        if (!status.ok() && first.ok()) first = status;
    };
    // Running jobs that are not in the queue: new, or with frames to make again.
    ASSIGN_OR_RETURN(const auto running, store_.jobs("running", "", kMaxQueued));
    std::map<std::string, int> jobs_of;
    for (const Job& job : running) {
        if (ends()) return first;
        ++jobs_of[job.owner];
        const auto remote = store_.remote(job.id);
        if (!remote.ok() || !remote->empty()) continue;
        const auto whole = store_.job(job.id);  // with its body
        note(whole.status());
        if (!whole.ok() || !*whole) continue;
        const Status taken = guarded(**whole, [&] { return take(**whole); });
        note(taken);
        if (taken.ok()) hear_from_queue();
    }
    std::vector<std::string> full;  // users without room
    for (const auto& [owner, jobs] : jobs_of)
        if (!owner.empty() && jobs >= settings_.max_jobs_of_user) full.push_back(owner);
    for (int room = settings_.max_jobs - int(running.size()); room > 0 && !ends();) {
        ASSIGN_OR_RETURN(const auto next, store_.next(-kMaxPriority, full));
        if (!next) break;
        ASSIGN_OR_RETURN(const auto started, store_.start(next->id));
        if (started == 0) continue;  // canceled just now
        --room;
        if (!next->owner.empty() && ++jobs_of[next->owner] >= settings_.max_jobs_of_user)
            full.push_back(next->owner);
        const Status taken = guarded(*next, [&] { return take(*next); });
        note(taken);
        if (taken.ok()) hear_from_queue();
    }
    return first;
}

// An exception ends this job alone. A later poll then cancels its tasks.
Status RemoteBackend::guarded(const Job& job, const std::function<Status()>& work) {
    try {
        return work();
    } catch (...) {
        const Status why = status_of_exception("job " + job.id);
        return job.ended_ms != 0 ? why : enter_end(job, WorkEnd::failed(why));
    }
}

Status RemoteBackend::enter_end(const Job& job, const WorkEnd& end) {
    RETURN_IF_ERROR(store_.end(ended_job(job, end, readers_)));
    forget(job.id);
    return Status();
}

void RemoteBackend::forget(const std::string& id) {
    requests_.erase(id);
    failures_.erase(id);
    ranks_.erase(id);
    ended_.erase(id);
    said_.erase(id);
    const auto job = store_.job(id);
    // The messages of a job that failed stay for people.
    if (!job.ok() || (*job && (*job)->state == JobState::failed)) return;
    std::error_code error;
    fs::remove_all(folder_of(id), error);
}

void RemoteBackend::clean_up() const {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(settings_.folder, error)) {
        const std::string id = entry.path().filename().string();
        if (!std::ranges::all_of(id, [](unsigned char c) { return std::isdigit(c) != 0; }))
            continue;
        const auto job = store_.job(id);
        const auto remote = store_.remote(id);
        if (!job.ok() || !remote.ok() || !remote->empty()) continue;
        if (*job && ((*job)->ended_ms == 0 || (*job)->state == JobState::failed)) continue;
        fs::remove_all(entry.path(), error);
    }
}

Status RemoteBackend::take(const Job& job) {
    auto read = readers_.read(job);
    if (!read.ok()) return enter_end(job, WorkEnd::failed(read.status()));
    if (const Status full = check_disk(store_, readers_.owner_of(job)); !full.ok())
        return enter_end(job, WorkEnd::failed(full));
    JobRequest& request = read->request;
    ASSIGN_OR_RETURN(const auto begun, store_.has_begun(job.id));
    if (!begun && job.kind != JobKind::run) {
        const Status status = request.measurement->begin(read->reader.roots());
        if (!status.ok()) return enter_end(job, WorkEnd::failed(status));
        RETURN_IF_ERROR(store_.began(job.id));
    } else if (!begun) {
        const auto frames = begin_frames(request, read->reader.roots());
        if (!frames.ok()) return enter_end(job, WorkEnd::failed(frames.status()));
        std::error_code error;
        const std::string folder = request.run.output.folder();
        if (request.run.make_folder) (void)io::make_folder(folder);
        if (!fs::is_directory(folder, error))
            return enter_end(job, WorkEnd::failed(Status(StatusCode::output,
                                                         folder + ": folder does not exist")));
        RETURN_IF_ERROR(store_.enter_frames(job.id, *frames));
    }
    return hand_over(job, *read, "");
}

Result<TaskCommand> RemoteBackend::frame_tasks(const Job& job, const JobRequest& request) const {
    // The frames that were listed at the start, whatever comes later.
    ASSIGN_OR_RETURN(const auto frames, store_.frames(job.id));
    std::vector<int> numbers;
    for (const JobFrame& frame : frames)
        if (frame.state == FrameState::waiting) numbers.push_back(frame.frame);
    const size_t per_task = size_t(settings_.frames_per_task);
    const size_t count = std::min((numbers.size() + per_task - 1) / per_task, kMostTasks);
    TaskCommand tasks;
    for (size_t i = 0; i < count; ++i) {
        const size_t first = numbers.size() * i / count, end = numbers.size() * (i + 1) / count;
        const auto of_task = std::span(numbers).subspan(first, end - first);
        tasks.words.push_back({"--frames=" + stepped_ranges_of(of_task)});
    }
    const std::string chain = folder_of(job.id) + "/chain.yaml";
    RETURN_IF_ERROR(write_task_file(chain, write_chain(request.chain.chain)));
    tasks.command = {settings_.program,
                     "run",
                     chain,
                     "--input",
                     input_words(request.run.input),
                     "--output",
                     request.run.output.text(),
                     "--on-existing=skip",
                     "--device=" + settings_.device};
    for (std::string& word : words_of(request)) tasks.command.push_back(std::move(word));
    return tasks;
}

Result<RemoteJob> RemoteBackend::remote_job(const Job& job, const ReadJob& read,
                                            const std::string& name) const {
    const std::string folder = folder_of(job.id);
    const Roots& roots = read.reader.roots();
    std::error_code error;
    fs::create_directories(folder, error);
    ASSIGN_OR_RETURN(auto tasks, read.request.measurement ? read.request.measurement->tasks(
                                                                job, settings_, roots, folder)
                                                          : frame_tasks(job, read.request));
    RemoteJob remote;
    remote.name = name;
    remote.owner = job.owner;
    remote.comment = concat("postchain job ", job.id, job.owner.empty() ? "" : " of ", job.owner);
    remote.folder = roots.folders().front();
    remote.command = std::move(tasks.command);
    // Links are judged on the node. The folder has chains.
    for (const std::string& root : roots.entries())
        remote.command.push_back("--confine-to=" + root);
    remote.command.push_back("--also-read=" + folder);
    remote.tasks = std::move(tasks.words);
    remote.log_folder = folder;
    remote.rank = {job.priority, settings_.max_tasks > 0 ? 1 : 0};
    remote.keeps_exit_code = job.kind != JobKind::run;
    return remote;
}

// `name`: of an earlier call whose answer was lost; empty = the first call.
Status RemoteBackend::hand_over(const Job& job, const ReadJob& read, std::string name) {
    ASSIGN_OR_RETURN(auto remote, remote_job(job, read, name));
    if (remote.tasks.empty()) return enter_outputs(job, read.request, true, "");
    if (name.empty()) {
        remote.name = random_name();
        RETURN_IF_ERROR(store_.set_remote(job.id, remote.name));
    }
    // Codes of an earlier attempt.
    std::error_code error;
    for (size_t i = 1; remote.keeps_exit_code && i <= remote.tasks.size(); ++i)
        fs::remove(concat(remote.log_folder, "/", i, ".exit"), error);
    const auto id = submit(job, remote);
    if (!id.ok()) return id.status();
    ranks_[job.id] = remote.rank;
    return store_.set_remote(job.id, remote.name + " " + *id);
}

Result<std::string> RemoteBackend::submit(const Job& job, const RemoteJob& remote) {
    auto id = settings_.queue->submit(remote);
    // A queue that does not answer may have the job; a refusal stays one.
    if (!id.ok() && id.status().code() == StatusCode::usage)
        RETURN_IF_ERROR(again_or_failed(job, id.status()));
    return id;
}

// Hands the job over anew, or ends it after the last attempt.
Status RemoteBackend::again_or_failed(const Job& job, const Status& why) {
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    return ++failures_[job.id] < settings_.attempts ? Status()
                                                    : enter_end(job, WorkEnd::failed(why));
}

Result<const ReadJob*> RemoteBackend::request_of(const Job& job) {
    auto request = requests_.find(job.id);
    if (request == requests_.end()) {
        // The job was read when it was handed over: a fault now is the disk's, and may pass.
        auto read = readers_.read(job);
        if (!read.ok()) return read.status().at("job " + job.id);
        request = requests_.emplace(job.id, std::move(*read)).first;
    }
    return &request->second;
}

std::string RemoteBackend::failure_of(const std::string& id, const RemoteTasks& tasks) const {
    if (tasks.message.empty()) return "its task ended without this frame";
    const std::string line = last_line(concat(folder_of(id), "/", tasks.failed_task, ".log"));
    return tasks.message + (line.empty() ? "" : ": " + readers_.shown_in(line));
}

Status RemoteBackend::follow(const Handed& handed, const Found& found, const RemoteRank& rank) {
    const Job& job = handed.job;
    const auto id_of = [](const RemoteName& remote, const RemoteTasks& tasks) {
        return remote.id.empty() ? tasks.id : remote.id;
    };
    const std::string id = id_of(handed.remote, found.tasks);
    if (job.ended_ms != 0) {
        for (const std::string& one : {id_of(handed.report, found.report), id})
            if (!one.empty()) RETURN_IF_ERROR(settings_.queue->cancel(one));
        RETURN_IF_ERROR(store_.set_remote(job.id, ""));
        forget(job.id);
        return Status();
    }
    ASSIGN_OR_RETURN(const ReadJob* read, request_of(job));
    if (id.empty()) return hand_over(job, *read, handed.remote.name);
    if (handed.remote.id.empty())
        RETURN_IF_ERROR(store_.set_remote(job.id, handed.remote.name + " " + id));
    if (!found.tasks.ended() && ranks_[job.id] != rank) {
        RETURN_IF_ERROR(settings_.queue->change(id, rank));
        ranks_[job.id] = rank;
    }
    RETURN_IF_ERROR(job.kind == JobKind::run ? follow_frames(job, read->request, found.tasks)
                                             : follow_measurement(handed, *read, id, found));
    // The next call cancels its tasks.
    const Status full = found.tasks.ended() ? Status() : check_disk(store_, readers_.owner_of(job));
    return full.ok() ? full : enter_end(job, WorkEnd::failed(full));
}

// The files of a task are seen here some time after they were written there.
bool RemoteBackend::lag_is_over(const Job& job) {
    return Clock::now() - ended_.emplace(job.id, Clock::now()).first->second >= settings_.lag;
}

Status RemoteBackend::follow_frames(const Job& job, const JobRequest& request,
                                    const RemoteTasks& tasks) {
    bool ended = tasks.ended();
    if (ended) {
        RETURN_IF_ERROR(enter_outputs(job, request, false, ""));
        ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
        ended = waiting.empty() || lag_is_over(job);
    }
    if (ended) ended_.erase(job.id);
    return enter_outputs(job, request, ended, failure_of(job.id, tasks));
}

// As ProgressEvents on one machine.
void RemoteBackend::say_progress(const Job& job, const JobRequest& request) {
    const auto found = request.measurement->progress(folder_of(job.id));
    if (!found || std::exchange(said_[job.id], *found) == *found) return;
    (void)store_.has_written(job.id, bytes_on_disk(request.measurement->report_folder()));
    (void)store_.say(
        job.id, "progress",
        {{"what", readers_.shown_in(found->what)}, {"done", found->done}, {"total", found->total}});
}

Status RemoteBackend::follow_measurement(const Handed& handed, const ReadJob& read,
                                         const std::string& id, const Found& found) {
    const Job& job = handed.job;
    const bool is_study = !handed.report.name.empty();
    const std::string folder = folder_of(job.id) + (is_study ? "/report" : "");
    if (is_study && handed.report.id.empty()) {
        std::string report = found.report.id;
        if (report.empty()) {
            ASSIGN_OR_RETURN(auto remote, remote_job(job, read, handed.report.name));
            remote.tasks.assign(1, {});
            remote.after = id;
            remote.log_folder = folder;
            std::error_code error;
            fs::create_directories(folder, error);
            fs::remove(folder + "/1.exit", error);
            auto submitted = submit(job, remote);
            if (!submitted.ok()) {
                // Both are handed over anew.
                if (submitted.status().code() == StatusCode::usage)
                    RETURN_IF_ERROR(settings_.queue->cancel(id));
                return submitted.status();
            }
            report = std::move(*submitted);
        }
        return store_.set_remote(job.id, concat(handed.remote.name, " ", id, " ", report));
    }
    say_progress(job, read.request);
    const RemoteTasks& last = is_study ? found.report : found.tasks;
    if (!found.tasks.ended() || !last.ended()) return Status();
    int code = -1;
    std::ifstream(folder + "/1.exit") >> code;
    std::optional<WorkEnd> end;
    if (code >= 0) end = read.request.measurement->end(job, code, read.reader.roots());
    if (!end && !lag_is_over(job)) return Status();
    ended_.erase(job.id);
    const std::string line = last_line(folder + "/1.log");
    const std::string why =
        concat(last.message.empty() ? "the task ended without a report" : last.message,
               line.empty() ? "" : ": ", line);
    // These codes are of faults that another attempt does not mend.
    if (!end && code >= kExitUsage && code <= kExitOutput) {
        end = WorkEnd::failed(Status(StatusCode::input, why));
        end->exit_code = code;
    }
    if (!end) return again_or_failed(job, Status(StatusCode::output, why));
    RETURN_IF_ERROR(
        store_.has_written(job.id, bytes_on_disk(read.request.measurement->report_folder())));
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    return enter_end(job, *end);
}

// Records frames whose outputs are on disk. At the end the others have failed an attempt.
Status RemoteBackend::enter_outputs(const Job& job, const JobRequest& request, bool at_end,
                                    const std::string& why) {
    ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
    // Reading the folder makes NFS look for new files.
    std::error_code listing;
    for (fs::directory_iterator at(request.run.output.folder(), listing), end;
         !listing && at != end; at.increment(listing))
        break;
    for (const FrameToDo& frame : waiting) {
        const std::string path = request.run.output.format(frame.frame);
        std::error_code error;
        // A quick look while tasks run: the sidecar follows the whole image.
        const bool there =
            fs::exists(path, error) &&
            (!request.run.sidecar || fs::exists(sequence::sidecar_path(path), error));
        const bool changed = there && made_after(path, job.created_ms);
        if (changed || (at_end && there && is_own_output(request, frame.frame))) {
            FrameEnd end;
            end.frame = frame.frame;
            end.state = changed ? FrameState::written : FrameState::skipped;
            end.bytes = bytes_of_outputs(path, request.run);
            RETURN_IF_ERROR(store_.frame_ends(job.id, end));
        } else if (at_end) {
            RETURN_IF_ERROR(store_.frame_begins(job.id, frame.frame));
            RETURN_IF_ERROR(store_.frame_fails(job.id, frame.frame, why));
        }
    }
    if (!at_end) return Status();
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    const auto left = store_.to_do(job.id);
    if (!left.ok() || !left->empty()) return left.status();
    const auto how = end_of_frames(store_, job.id, Status(), false);
    return how.ok() ? enter_end(job, *how) : how.status();
}

}  // namespace postchain::service
