#include "tools/service/work/job_runner.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <utility>

#include "chain/base/readable_file.h"
#include "chain/base/text.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/settings/job_settings.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/service/work/helper_threads.h"
#include "tools/service/work/job_files.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using io::Json;

constexpr size_t kMaxQueued = 1'000'000;  // as of --max-queue
// An array of Slurm has at most 1000 tasks unless MaxArraySize is raised.
constexpr size_t kMostTasks = 1000;
constexpr int64_t kMostOfPoll = int64_t(1) << 22;      // bytes of a task's lines, read in one poll
constexpr auto kRetry = std::chrono::seconds(1);       // longer after each failure
constexpr auto kWait = std::chrono::milliseconds(20);  // between looks at tasks that shall end

// Settings of a run that the runner gives itself.
constexpr std::array<std::string_view, 5> kOwnSettings = {"frames", "chunk", "on_existing",
                                                          "on_error", "missing"};

// The end of a file of messages.
std::string end_of(const std::string& path) {
    constexpr std::streamoff kMost = 600;  // bytes
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? std::streamoff(file.tellg()) : 0;
    file.seekg(std::max<std::streamoff>(0, size - kMost));
    std::ostringstream text;
    text << file.rdbuf();
    return last_line(text.str());
}

// The exit code of a task; -1 = it is not known, or not yet.
int exit_code_at(const std::string& folder, int task) {
    int code = -1;
    std::ifstream(concat(folder, "/", task, ".exit")) >> code;
    return code;
}

struct Line {
    Json json;
    int64_t end = 0;  // in the file
};

// Whole lines of a file from a place on; null if a line is no object.
std::vector<Line> lines_at(const std::string& path, int64_t from) {
    std::vector<Line> lines;
    std::ifstream file(path, std::ios::binary);
    if (!file) return lines;
    file.seekg(0, std::ios::end);
    const int64_t left = int64_t(file.tellg()) - from;
    if (left <= 0 || !file.seekg(from)) return lines;
    std::string text(size_t(std::min(left, kMostOfPoll)), '\0');
    file.read(text.data(), std::streamsize(text.size()));
    text.resize(size_t(file.gcount()));
    const size_t end = text.rfind('\n');
    if (end == std::string::npos) {
        // No line of a program is so long.
        if (int64_t(text.size()) == kMostOfPoll) lines.push_back({Json(), from + kMostOfPoll});
        return lines;
    }
    std::istringstream whole(text.substr(0, end + 1));
    for (std::string line; std::getline(whole, line);) {
        from += int64_t(line.size() + 1);
        auto json = io::read_json(line, path, io::kReportLimits);
        lines.push_back({json.ok() && json->is_object() ? std::move(*json) : Json(), from});
    }
    return lines;
}

bool made_after(const std::string& path, int64_t ms) {
    std::error_code error;
    const auto time = fs::last_write_time(path, error);
    const auto since = std::chrono::file_clock::to_sys(time).time_since_epoch();
    return !error && std::chrono::duration_cast<std::chrono::milliseconds>(since).count() >= ms;
}

int exit_code_named(const std::string& name) {
    for (const StatusCode code :
         {StatusCode::usage, StatusCode::chain, StatusCode::input, StatusCode::output,
          StatusCode::gl, StatusCode::memory, StatusCode::health})
        if (name == name_of(code)) return exit_code(Status(code, name));
    return kExitSomeFailed;
}

// The exit code of a job with frames that failed.
int exit_code_of(const Job& job, int first_code, bool unhealthy) {
    if (unhealthy) return kExitHealth;
    return job.done > 0 || first_code == 0 ? kExitSomeFailed : first_code;
}

Job ended_job(Job job, const WorkEnd& end, const Readers& readers) {
    job.state = end.state;
    job.exit_code = end.exit_code;
    job.message = readers.shown_in(end.message);
    job.verdict = end.verdict;
    return job;
}

// Each user has an equal part of the tasks that may run, and so has each job of a user.
std::map<std::string, TaskRank> ranks_of(const std::vector<Job>& jobs, int most_tasks) {
    std::map<std::string, int> jobs_of;  // by owner
    for (const Job& job : jobs) ++jobs_of[job.owner];
    std::map<std::string, TaskRank> ranks;
    for (const Job& job : jobs) {
        const int share = most_tasks / int(jobs_of.size()) / jobs_of[job.owner];
        ranks[job.id] = {job.priority, most_tasks > 0 ? std::max(1, share) : 0};
    }
    return ranks;
}

}  // namespace

WorkEnd WorkEnd::failed(const Status& status) {
    return {JobState::failed, postchain::exit_code(status), status.message(), {}};
}

void WorkEnd::say(const std::string& text) {
    message += (message.empty() ? "" : "; ") + text;
}

Status take_private_folder(const std::string& folder, const std::vector<std::string>& roots) {
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

JobRunner::JobRunner(JobStore& store, const Readers& readers, const Programs& programs,
                     Counters& counters, std::shared_ptr<TaskQueue> queue,
                     const QueueSettings& settings)
    : store_(store),
      readers_(readers),
      programs_(programs),
      counters_(counters),
      queue_(std::move(queue)),
      settings_(settings) {}

JobRunner::~JobRunner() {
    end();
}

Status JobRunner::begin() {
    // Arrays that outlive a service are followed, whatever has room. The others are gone.
    ASSIGN_OR_RETURN(const auto queued, store_.jobs("queued", "", kMaxQueued));
    for (const Job& job : queued) {
        if (job.remote.empty()) continue;
        if (queue_->outlives())
            RETURN_IF_ERROR(store_.start(job.id).status());
        else
            RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    }
    if (!queue_->outlives()) {
        ASSIGN_OR_RETURN(const auto others, store_.remotes());
        for (const Job& job : others) RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    }
    clean_up();
    loops_ = true;
    auto thread = start_thread([this, lost = lost_] {
        loop();
        *lost = 0;
    });
    if (thread.ok())
        thread_ = std::move(*thread);
    else
        loops_ = false;
    return thread.status();
}

void JobRunner::wake() {
    const std::lock_guard lock(mutex_);
    awake_ = true;
    changed_.notify_all();
}

// Tasks of another queue go on; the next process follows them. A queue or a disk that hangs is not
// waited for.
void JobRunner::drain() {
    std::unique_lock lock(mutex_);
    ends_ = true;
    if (queue_->outlives()) queue_->stop();
    changed_.notify_all();
    if (*lost_ > 0) return;
    // The tasks of this machine have the time of `drain`, then they are killed.
    const auto patience = settings_.drain + std::chrono::seconds(queue_->outlives() ? 0 : 3);
    if (changed_.wait_for(lock, patience, [&] { return !loops_; })) return;
    *lost_ = 1;
    thread_.detach();
}

size_t JobRunner::end() {
    drain();
    if (thread_.joinable()) thread_.join();
    return *lost_;
}

double JobRunner::remaining_s(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    const auto found = remaining_s_.find(id);
    return found == remaining_s_.end() ? 0 : found->second;
}

RunnerState JobRunner::state() const {
    const std::lock_guard lock(mutex_);
    RunnerState state;
    const auto silence = Clock::now() - heard_;
    state.works = silence <= settings_.silence;
    state.trouble = trouble_;
    if (!state.works)
        state.trouble = concat(queue_->name(), " has not answered for ",
                               std::chrono::duration_cast<std::chrono::seconds>(silence).count(),
                               " s", trouble_.empty() ? "" : ": ", trouble_);
    state.lost = *lost_;
    return state;
}

// ---------------------------------------------------------------------------------- the thread
void JobRunner::loop() {
    std::unique_lock lock(mutex_);
    std::optional<Clock::time_point> until;  // tasks that end with us are killed
    for (;;) {
        awake_ = false;
        const bool ends = ends_;
        lock.unlock();
        std::string trouble;
        try {
            poll_queue();
        } catch (...) {
            // Out of memory at a place without a Status; a later poll may succeed.
            trouble = status_of_exception("the queue").message();
        }
        lock.lock();
        if (!trouble.empty()) trouble_ = trouble;
        changed_.notify_all();
        if (ends && !until) until = Clock::now() + settings_.drain;
        if (ends && (queue_->outlives() || in_queue_ == 0 || Clock::now() > *until)) break;
        changed_.wait_for(lock,
                          ends    ? kWait
                          : idle_ ? settings_.idle_poll
                                  : settings_.poll,
                          [&] { return (ends_ && !ends) || awake_; });
    }
    // What is left was killed. The next process finds its jobs running and queues them again.
    loops_ = false;
    changed_.notify_all();
}

bool JobRunner::ends() const {
    const std::lock_guard lock(mutex_);
    return ends_;
}

JobRunner::Handed JobRunner::handed_of(const Job& job) {
    Handed handed;
    handed.job = job;
    std::istringstream words(job.remote);
    words >> handed.array.name >> handed.array.id >> handed.report.id;
    if (job.kind == JobKind::study) handed.report.name = handed.array.name + "-report";
    return handed;
}

void JobRunner::hear_from_queue() {
    const std::lock_guard lock(mutex_);
    heard_ = Clock::now();
}

// An exception ends its job alone, and a failure is told to the caller: the other jobs go on.
Status JobRunner::guarded(const Job& job, const std::function<Status()>& work) {
    Status status;
    try {
        status = work();
    } catch (...) {
        status = enter_end(job, WorkEnd::failed(status_of_exception("job " + job.id)));
    }
    if (status.ok()) hear_from_queue();
    return status;
}

void JobRunner::poll_queue() {
    std::string trouble;
    const auto note = [&](const Status& status) {
        if (!status.ok() && trouble.empty()) trouble = status.message();
        return status.ok();
    };
    const auto tell = [&] {
        const std::lock_guard lock(mutex_);
        trouble_ = trouble;
    };
    std::vector<Handed> handed;
    std::vector<ArrayName> names;
    std::vector<Job> unfinished;
    const auto known = store_.remotes();
    if (!note(known.status())) return tell();
    for (const Job& job : *known) {
        handed.push_back(handed_of(job));
        names.push_back(handed.back().array);
        if (!handed.back().report.name.empty()) names.push_back(handed.back().report);
        if (job.ended_ms == 0) unfinished.push_back(job);
    }
    in_queue_ = handed.size();
    // One call for all jobs. Before their lines are read: what is missing afterward was not made.
    const auto states = queue_->look(names);
    if (!note(states.status())) return tell();
    hear_from_queue();
    const auto ranks = ranks_of(unfinished, settings_.max_tasks);
    for (const Handed& one : handed) {
        if (ends() && queue_->outlives()) return;
        const auto of = [&](const ArrayName& array) {
            const auto found = states->find(array.name);
            return found == states->end() ? ArrayState() : found->second;
        };
        const auto rank = ranks.find(one.job.id);
        note(guarded(one.job, [&] {
            return follow(one, {of(one.array), of(one.report)},
                          rank == ranks.end() ? TaskRank() : rank->second);
        }));
    }
    if (!ends()) note(take_waiting(handed.size()));
    const auto running = store_.jobs("running", "", 1);
    idle_ = trouble.empty() && handed.empty() && running.ok() && running->empty();
    tell();
}

// Jobs that have room in the queue, in their order.
Status JobRunner::take_waiting(size_t in_queue) {
    Status first;
    const auto taken = [&](const Job& job) {
        const Status status = guarded(job, [&] { return take(job); });
        if (first.ok()) first = status;
    };
    // Running jobs that are not in the queue: with frames to make again, or of a process that died.
    ASSIGN_OR_RETURN(const auto running, store_.jobs("running", "", kMaxQueued));
    std::map<std::string, int> jobs_of;
    for (const Job& job : running) {
        if (ends()) return first;
        ++jobs_of[job.owner];
        if (!job.remote.empty()) continue;
        if (Clock::now() >= followed_[job.id].not_before) taken(job);
    }
    std::vector<std::string> full;  // users without room
    for (const auto& [owner, jobs] : jobs_of)
        if (!owner.empty() && jobs >= settings_.max_jobs_of_user) full.push_back(owner);
    // A canceled job is in the queue until its tasks have ended.
    const int in_use = int(std::max(running.size(), in_queue));
    for (int room = settings_.max_jobs - in_use; room > 0 && !ends();) {
        ASSIGN_OR_RETURN(const auto next, store_.next(-kMaxPriority, full));
        if (!next) break;
        ASSIGN_OR_RETURN(const auto started, store_.start(next->id));
        if (!started) continue;  // canceled just now
        --room;
        if (!next->owner.empty() && ++jobs_of[next->owner] >= settings_.max_jobs_of_user)
            full.push_back(next->owner);
        taken(*next);
    }
    return first;
}

// ------------------------------------------------------------------------------- handing it over
Status JobRunner::take(const Job& listed) {
    ASSIGN_OR_RETURN(const auto whole, store_.job(listed.id));  // with its body
    if (!whole) return Status();                                // removed meanwhile
    const Job& job = *whole;
    auto read = readers_.read(job);
    if (!read.ok()) return enter_end(job, WorkEnd::failed(read.status()));
    if (const Status full = check_disk(store_, readers_.owner_of(job)); !full.ok())
        return enter_end(job, WorkEnd::failed(full));
    if (!job.begun)
        RETURN_IF_ERROR(begin_job(job, *read));
    else if (const Status edited = check_edits(job, *read); !edited.ok())
        return enter_end(job, WorkEnd::failed(edited));
    ASSIGN_OR_RETURN(const auto now, store_.listed(job.id));
    if (!now || now->state != JobState::running) return Status();  // it could not begin
    Followed& followed = followed_[job.id];
    followed.read = std::move(*read);
    return hand_over(job, *followed.read, "", !job.begun);
}

// The checks that the command makes before its first frame. Enters the frames in the store.
Status JobRunner::begin_job(const Job& job, const ReadJob& read) {
    const auto checked = programs_.check(job.body, read.request, read.reader.roots());
    if (!checked.ok()) {
        const Problem& why = checked.status();
        if (why.kind == Problem::Kind::unavailable) return Status(StatusCode::output, why.detail);
        const Status status = status_of(why.diagnostics);
        return enter_end(job, WorkEnd::failed(Status(
                                  status.ok() ? StatusCode::input : status.code(), why.detail)));
    }
    if (job.kind != JobKind::run) return store_.began(job.id);
    const auto& frames = checked->of_run;
    const auto refused = std::ranges::find(frames, FrameState::quarantined, &JobFrame::state);
    if (refused != frames.end() && read.request.value("on_error", "continue") == "stop")
        return enter_end(job, WorkEnd::failed(Status(StatusCode::output, refused->message)));
    return store_.enter_frames(job.id, frames);
}

// A job that goes on reads its files again. With an edited one the frames to do would look
// otherwise than those that are done. Errors (input).
Status JobRunner::check_edits(const Job& job, const ReadJob& read) const {
    if (job.kind != JobKind::run || job.done == 0) return Status();
    const JobRequest& request = read.request;
    const auto edited = [&](const std::string& path, const char* what) {
        return made_after(path, job.started_ms)
                   ? Status(StatusCode::input,
                            concat(read.reader.roots().shown(path), ": ", what,
                                   " was changed after frames were made with it; submit the job "
                                   "again, with on_existing: skip"))
                   : Status();
    };
    for (const NamedText& subject : request.subjects)
        if (!subject.written && subject.word.starts_with('/'))
            RETURN_IF_ERROR(edited(subject.word, "the chain file"));
    for (const auto& [key, what] :
         {std::pair("camera", "the camera file"), std::pair("profile", "the profile")})
        if (const std::string path = request.value(key, ""); path.starts_with('/'))
            RETURN_IF_ERROR(edited(path, what));
    return Status();
}

// `first`: nothing of the job has run yet.
Result<TaskArray> JobRunner::array_of(const Job& job, const ReadJob& read, bool first) const {
    const std::string folder = folder_of(job.id);
    const JobRequest& request = read.request;
    std::error_code error;
    fs::create_directories(folder, error);
    RETURN_IF_ERROR(write_texts(request, folder));
    TaskArray array;
    array.owner = job.owner;
    array.comment = concat("postchain job ", job.id, job.owner.empty() ? "" : " of ", job.owner);
    array.folder = read.reader.roots().folders().front();
    array.rank = {job.priority, settings_.max_tasks > 0 ? 1 : 0};
    array.silence_s =
        request.frame_timeout_s > 0 ? request.frame_timeout_s : settings_.frame_timeout_s;
    array.command = {settings_.program};
    const auto add = [&](const std::vector<std::string>& words) {
        array.command.insert(array.command.end(), words.begin(), words.end());
    };
    const std::vector<std::string> common = {"--json", "--device=" + settings_.device};
    if (job.kind != JobKind::run) {
        add(words_of(request, folder, {"on_existing"}));
        // The folder was checked before the first task, which may run again. An ab begins anew.
        array.command.push_back(job.kind == JobKind::ab ? "--on-existing=overwrite"
                                                        : "--on-existing=skip");
    } else {
        add(words_of(request, folder, {kOwnSettings.begin(), kOwnSettings.end()}));
        // The service tries a failed frame again while the others go on. Frames that are missing at
        // the beginning are not asked for; one that goes missing later fails.
        const bool held = request.value("missing", "error") == "hold";
        add({"--on-error=continue", held ? "--missing=hold" : "--missing=skip"});
    }
    add(common);
    if (settings_.max_memory > 0 && job.kind != JobKind::study) {
        const auto asked = sequence::memory_limit_of(request.value("max_memory", "0"));
        const uint64_t most = asked.ok() && *asked > 0 ? std::min(*asked, settings_.max_memory)
                                                       : settings_.max_memory;
        std::erase_if(array.command,
                      [](const std::string& word) { return word.starts_with("--max-memory="); });
        array.command.push_back(concat("--max-memory=", most));
    }
    if (settings_.threads > 0) array.command.push_back(concat("--threads=", settings_.threads));
    add(confining_words(read.reader.roots(), folder));

    if (job.kind == JobKind::study && queue_->outlives()) {
        const size_t chunks = std::min(size_t(std::max(job.frames, 1)), kMostTasks);
        for (size_t i = 1; i <= chunks; ++i)
            array.tasks.push_back({concat("--chunk=", i, "/", chunks)});
        return array;
    }
    if (job.kind != JobKind::run) {
        array.tasks.emplace_back();
        return array;
    }
    // The frames that were listed at the start, whatever comes later. Those that were under way
    // when a process died come last and alone: if one of them kills its process again, all others
    // are done.
    ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
    std::vector<int> together;
    std::vector<int> alone;
    for (const FrameToDo& frame : waiting) (frame.alone ? alone : together).push_back(frame.frame);
    const size_t per_task = settings_.frames_per_task > 0 ? size_t(settings_.frames_per_task)
                                                          : std::max<size_t>(together.size(), 1);
    const size_t count = std::min((together.size() + per_task - 1) / per_task, kMostTasks);
    const std::string on_existing = request.value("on_existing", "fail");
    // Later a whole output is this job's, or as good. A farm may run a task twice.
    const bool dumps = !request.value("dump_stages", "").empty();
    const bool twice = queue_->outlives();
    const std::string later = on_existing == "fail"                           ? "resume"
                              : on_existing == "overwrite" && twice && !dumps ? "skip"
                                                                              : on_existing;
    const std::string policy = "--on-existing=" + (first && !twice ? on_existing : later);
    for (size_t i = 0; i < count; ++i) {
        const size_t from = together.size() * i / count, end = together.size() * (i + 1) / count;
        array.tasks.push_back(
            {policy, "--frames=" + io::range_text(std::span(together).subspan(from, end - from))});
    }
    for (const int frame : alone)
        if (array.tasks.size() < kMostTasks)
            array.tasks.push_back({policy, concat("--frames=", frame)});
    return array;
}

// `name`: of an earlier call whose answer was lost; empty = a new array.
Status JobRunner::hand_over(const Job& job, const ReadJob& read, std::string name, bool first) {
    ASSIGN_OR_RETURN(auto array, array_of(job, read, first));
    if (array.tasks.empty()) return end_with_rest(job, WorkEnd());
    array.name = name.empty() ? random_name("postchain-") : name;
    array.log_folder = concat(folder_of(job.id), "/", array.name);
    std::error_code error;
    if (name.empty()) {
        // What earlier arrays said is in the store.
        for (const auto& entry : fs::directory_iterator(folder_of(job.id), error))
            if (entry.is_directory()) fs::remove_all(entry.path(), error);
        RETURN_IF_ERROR(store_.set_remote(job.id, array.name));
    }
    fs::create_directories(array.log_folder, error);
    Followed& followed = followed_[job.id];
    followed.tasks.clear();
    followed.seen = true;
    followed.told.clear();
    followed.progressed = false;
    followed.ended.reset();
    followed.began = Clock::now();
    const auto id = submit(job, array);
    if (!id.ok()) return id.status();
    followed.rank = array.rank;
    return store_.set_remote(job.id, array.name + " " + *id);
}

Result<std::string> JobRunner::submit(const Job& job, const TaskArray& array) {
    auto id = queue_->submit(array);
    // A queue that does not answer may have the array; a refusal stays one. A process that cannot
    // be started is one too.
    if (!id.ok() && (id.status().code() == StatusCode::usage || !queue_->outlives()))
        RETURN_IF_ERROR(again_or_failed(job, WorkEnd::failed(id.status())));
    return id;
}

// Hands the job over anew, or ends it after the last attempt.
Status JobRunner::again_or_failed(const Job& job, const WorkEnd& end) {
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    Followed& followed = followed_[job.id];
    if (++followed.failures >= settings_.attempts) return enter_end(job, end);
    followed.not_before = Clock::now() + kRetry * followed.failures;
    return Status();
}

// ---------------------------------------------------------------------------------- following it
Result<const ReadJob*> JobRunner::read_of(const Job& job) {
    Followed& followed = followed_[job.id];
    if (!followed.read) {
        ASSIGN_OR_RETURN(const auto whole, store_.job(job.id));  // with its body
        auto read = readers_.read(whole.value_or(job));
        if (!read.ok()) {
            RETURN_IF_ERROR(enter_end(job, WorkEnd::failed(read.status())));
            return nullptr;
        }
        followed.read = std::move(*read);
    }
    return &*followed.read;
}

std::string JobRunner::failure_of(const std::string& folder, const ArrayState& array) const {
    if (array.message.empty()) return "its task ended without this frame";
    const std::string line = end_of(concat(folder, "/", array.failed_task, ".log"));
    return array.message + (line.empty() ? "" : ": " + readers_.shown_in(line));
}

Status JobRunner::follow(const Handed& handed, const Found& found, const TaskRank& rank) {
    const Job& job = handed.job;
    const auto id_of = [](const ArrayName& array, const ArrayState& state) {
        return array.id.empty() ? state.id : array.id;
    };
    const std::string id = id_of(handed.array, found.array);
    if (job.ended_ms != 0) {
        for (const std::string& one : {id_of(handed.report, found.report), id})
            if (!one.empty()) RETURN_IF_ERROR(queue_->cancel(one));
        // Tasks of this machine may end their frame.
        if (!queue_->outlives() && !found.array.ended()) return Status();
        RETURN_IF_ERROR(store_.release(job.id));
        RETURN_IF_ERROR(store_.set_remote(job.id, ""));
        forget(job.id);
        return Status();
    }
    ASSIGN_OR_RETURN(const ReadJob* read, read_of(job));
    if (read == nullptr) return Status();
    if (id.empty()) return hand_over(job, *read, handed.array.name, false);
    Followed& followed = followed_[job.id];
    if (handed.array.id.empty())
        RETURN_IF_ERROR(store_.set_remote(job.id, handed.array.name + " " + id));
    if (!found.array.ended() && followed.rank != rank) {
        RETURN_IF_ERROR(queue_->change(id, rank));
        followed.rank = rank;
    }
    ASSIGN_OR_RETURN(const bool more, read_lines(handed, *read));
    if (found.array.ended() && more) return Status();
    if (found.array.ended() && followed.canceled) {
        // Interrupted frames wait again, without a counted attempt.
        RETURN_IF_ERROR(store_.release(job.id));
        RETURN_IF_ERROR(store_.set_remote(job.id, ""));
        if (followed.failed) return end_with_rest(job, *followed.failed);
        RETURN_IF_ERROR(store_.requeue(job.id, followed.makes_way));
        forget(job.id);
        return Status();
    }
    if (const Status full = check_disk(store_, readers_.owner_of(job));
        !full.ok() && !followed.failed) {
        // The last frame of a run may be the one that fills it.
        ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
        if (job.kind != JobKind::run || !waiting.empty()) followed.failed = WorkEnd::failed(full);
    }
    make_way(job, followed);
    if (!found.array.ended() && !followed.canceled &&
        (followed.failed || !followed.makes_way.empty())) {
        RETURN_IF_ERROR(queue_->cancel(id));
        followed.canceled = true;
    }
    return job.kind == JobKind::run ? follow_frames(handed, found.array)
                                    : follow_measurement(handed, *read, id, found);
}

// On this machine: for a job of larger priority, after a slice of time for one of another user, and
// for the end of the service.
void JobRunner::make_way(const Job& job, Followed& followed) {
    if (queue_->outlives()) return;
    if (ends()) followed.makes_way = "stopped";
    const auto next = store_.next(job.priority);
    if (!followed.makes_way.empty() || !next.ok() || !*next) return;
    // ab and bench would lose what they have measured.
    const bool in_parts = job.kind == JobKind::run || job.kind == JobKind::study;
    const double seconds = std::chrono::duration<double>(Clock::now() - followed.began).count();
    const bool slice_over = in_parts && followed.progressed && seconds > settings_.slice_s;
    if ((*next)->priority > job.priority || ((*next)->owner != job.owner && slice_over))
        followed.makes_way = "another job goes first";
}

// Reads what the tasks have printed since the last time. True: there is more.
Result<bool> JobRunner::read_lines(const Handed& handed, const ReadJob& read) {
    Followed& followed = followed_[handed.job.id];
    // Of lines that an earlier process of the service may have read, only the ends of frames count.
    const bool again = !followed.seen;
    bool more = false;
    std::error_code error;
    for (fs::directory_iterator at(folder_of(handed), error), end; !error && at != end;
         at.increment(error)) {
        if (at->path().extension() != ".events") continue;
        const int number = std::atoi(at->path().stem().c_str());
        TaskLines& task = followed.tasks[number];
        // If the store is away, the next poll goes on with this line.
        const auto lines = lines_at(at->path(), task.read);
        for (const Line& line : lines) {
            if (line.json.is_object())
                RETURN_IF_ERROR(enter_line(handed.job, read, task, line.json, again));
            task.read = line.end;
        }
        std::error_code unknown;
        more = more || (!lines.empty() && int64_t(at->file_size(unknown)) > task.read);
    }
    followed.seen = followed.seen || !more;
    return more;
}

Status JobRunner::enter_line(const Job& job, const ReadJob& read, TaskLines& task,
                             const io::Json& line, bool again) {
    if (const double left = value_of(line, "remaining_s", 0.0); left > 0) {
        const std::lock_guard lock(mutex_);
        remaining_s_[job.id] = left;
    }
    Followed& followed = followed_[job.id];
    if (job.kind != JobKind::run) {
        const int done = value_of(task.progress, "done", 0);
        followed.progressed =
            followed.progressed || (task.progress.is_object() && value_of(line, "done", 0) > done);
        (line.contains("verdict") ? task.last : task.progress) = line;
        return Status();
    }
    const auto number = line.find("frame");
    if (number == line.end() || !number->is_number_integer()) return Status();
    const int frame = number->get<int>();
    followed.told.insert(frame);
    if (value_of(line, "begins", false)) {
        task.in_flight.insert(frame);
        return again ? Status() : store_.frame_begins(job.id, frame);
    }
    followed.progressed = true;
    // An end without a beginning is an attempt too.
    if (task.in_flight.erase(frame) == 0 && !again)
        RETURN_IF_ERROR(store_.frame_begins(job.id, frame));
    return enter_frame(job, read, frame, line, again);
}

Status JobRunner::enter_frame(const Job& job, const ReadJob& read, int frame, const io::Json& line,
                              bool again) {
    const Roots& roots = read.reader.roots();
    const JobRequest& request = read.request;
    const std::string outcome = value_of(line, "outcome", std::string());
    if (!again) counters_.add(line);
    FrameEnd end;
    end.frame = frame;
    const std::string error = roots.shown_in(value_of(line, "error", std::string()));
    if (outcome == "written" || outcome == "held") {
        end.state = FrameState::written;
        end.bytes = value_of(line, "bytes", int64_t(0));
        if (const auto times = line.find("times_ms"); times != line.end() && times->is_object())
            end.filter_ms = value_of(*times, "filter", 0.0);
        end.held = outcome == "held";
        if (end.held)
            end.message =
                concat("frame ", value_of(line, "held_from", 0), " is written in its place");
        for (const std::string& warning : value_of(line, "warnings", std::vector<std::string>()))
            end.message += (end.message.empty() ? "" : "; ") + roots.shown_in(warning);
    } else if (outcome == "skipped") {
        // One that was made since the job's start was begun before, by a process that died.
        const std::string output = value_of(line, "output", std::string());
        const bool own = made_after(output, job.started_ms);
        end.state = own ? FrameState::written : FrameState::skipped;
        if (own) end.bytes = bytes_on_disk(output);
    } else if (outcome == "missing" && request.value("missing", "error") == "skip") {
        end.state = FrameState::missing;
        end.message = error;
    } else if (again) {
        return Status();  // a failure that an earlier process may have counted
    } else {
        Followed& followed = followed_[job.id];
        const std::string code = value_of(line, "error_code", std::string());
        if (followed.first_code == 0) followed.first_code = exit_code_named(code);
        followed.unhealthy = followed.unhealthy || code == name_of(StatusCode::health);
        RETURN_IF_ERROR(store_.frame_fails(job.id, frame, error));
        ASSIGN_OR_RETURN(const auto now, store_.frame(job.id, frame));
        if (now && now->state == FrameState::quarantined &&
            request.value("on_error", "continue") == "stop" && !followed.failed) {
            followed.failed = WorkEnd::failed(Status(StatusCode::input, error));
            ASSIGN_OR_RETURN(const auto counted, store_.listed(job.id));
            followed.failed->exit_code =
                exit_code_of(counted.value_or(job), followed.first_code, followed.unhealthy);
        }
        return Status();
    }
    return store_.frame_ends(job.id, end);
}

// The files of a task are seen here some time after they were written there.
bool JobRunner::lag_is_over(const Job& job) {
    Followed& followed = followed_[job.id];
    if (!followed.ended) followed.ended = Clock::now();
    return !queue_->outlives() || Clock::now() - *followed.ended >= settings_.lag;
}

Status JobRunner::follow_frames(const Handed& handed, const ArrayState& array) {
    const Job& job = handed.job;
    if (!array.ended()) return Status();
    ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
    if (!waiting.empty() && !lag_is_over(job)) return Status();
    if (!waiting.empty()) RETURN_IF_ERROR(end_of_array(handed, array));
    ASSIGN_OR_RETURN(const auto now, store_.listed(job.id));
    if (!now || now->state != JobState::running) return Status();
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    ASSIGN_OR_RETURN(const auto left, store_.to_do(job.id));
    return left.empty() ? end_with_rest(job, WorkEnd()) : take(job);
}

// What the frames that the tasks did not end are blamed for.
Status JobRunner::end_of_array(const Handed& handed, const ArrayState& array) {
    const Job& job = handed.job;
    Followed& followed = followed_[job.id];
    const std::string folder = folder_of(handed);
    const std::string why = failure_of(folder, array);
    bool blamed = false;
    for (auto& [number, task] : followed.tasks) {
        if (task.in_flight.empty()) continue;
        blamed = true;
        ArrayState one = array;
        if (queue_->outlives() || exit_code_at(folder, number) >= 0) one.failed_task = number;
        RETURN_IF_ERROR(store_.interrupted(job.id, {task.in_flight.begin(), task.in_flight.end()},
                                           failure_of(folder, one)));
        task.in_flight.clear();
    }
    // These codes are of faults that another attempt does not mend.
    const int code = exit_code_at(folder, std::max(array.failed_task, 1));
    WorkEnd end = WorkEnd::failed(Status(StatusCode::input, why));
    if (code > 0 && code < 128) end.exit_code = code;
    if (!blamed && followed.told.empty() && code >= kExitUsage && code <= kExitOutput)
        return enter_end(job, end);
    // A farm's task may fail before its first line.
    if (!blamed && queue_->outlives() && array.failed > 0) {
        ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
        for (const FrameToDo& frame : waiting) {
            if (followed.told.contains(frame.frame)) continue;
            RETURN_IF_ERROR(store_.frame_begins(job.id, frame.frame));
            RETURN_IF_ERROR(store_.frame_fails(job.id, frame.frame, why));
            blamed = true;
        }
    }
    if (blamed || !followed.told.empty()) {
        followed.failures = 0;
        return Status();
    }
    return again_or_failed(job, end);
}

// ---------------------------------------------------------------------- ab, bench and study
Status JobRunner::submit_report(const Handed& handed, const ReadJob& read, const std::string& id) {
    ASSIGN_OR_RETURN(auto array, array_of(handed.job, read, false));
    array.name = handed.report.name;
    array.tasks.assign(1, {});
    array.after = id;
    array.log_folder = folder_of(handed) + "/report";
    std::error_code error;
    fs::create_directories(array.log_folder, error);
    auto submitted = submit(handed.job, array);
    if (!submitted.ok()) {
        // Both are handed over anew.
        if (submitted.status().code() == StatusCode::usage) RETURN_IF_ERROR(queue_->cancel(id));
        return submitted.status();
    }
    return store_.set_remote(handed.job.id, concat(handed.array.name, " ", id, " ", *submitted));
}

Status JobRunner::follow_measurement(const Handed& handed, const ReadJob& read,
                                     const std::string& id, const Found& found) {
    const Job& job = handed.job;
    Followed& followed = followed_[job.id];
    const bool has_report = job.kind == JobKind::study && queue_->outlives();
    if (has_report && handed.report.id.empty()) {
        if (found.report.id.empty()) return submit_report(handed, read, id);
        return store_.set_remote(job.id, concat(handed.array.name, " ", id, " ", found.report.id));
    }
    const std::string folder = folder_of(handed) + (has_report ? "/report" : "");
    Json last = followed.tasks.empty() ? Json() : followed.tasks.rbegin()->second.last;
    if (has_report) {
        const auto lines = lines_at(folder + "/1.events", 0);
        if (!lines.empty()) last = lines.back().json;
    }
    // The parts of a study say how far each is.
    std::string what;
    int done = 0, total = 0;
    for (const auto& [number, task] : followed.tasks) {
        if (!task.progress.is_object()) continue;
        what = readers_.shown_in(value_of(task.progress, "what", std::string()));
        done += value_of(task.progress, "done", 0);
        total += value_of(task.progress, "total", 0);
    }
    if (const std::string said = concat(done, "/", total, " ", what);
        !what.empty() && std::exchange(followed.said, said) != said) {
        (void)store_.say(job.id, "progress", {{"what", what}, {"done", done}, {"total", total}});
        RETURN_IF_ERROR(store_.has_written(job.id, bytes_on_disk(read.request.output)));
    }
    const ArrayState& end_of_work = has_report ? found.report : found.array;
    if (!found.array.ended() || !end_of_work.ended()) return Status();
    const int code = exit_code_at(folder, 1);
    const bool told = last.is_object() && last.contains("verdict");
    if (!told && !lag_is_over(job)) return Status();
    RETURN_IF_ERROR(store_.has_written(job.id, bytes_on_disk(read.request.output)));
    WorkEnd end;
    if (told) {
        end.exit_code = value_of(last, "exit_code", 0);
        end.message = value_of(last, "message", std::string());
        end.verdict = value_of(last, "verdict", std::string());
        if (value_of(last, "failed", false)) end.state = JobState::failed;
    } else {
        const std::string line = end_of(folder + "/1.log");
        end = WorkEnd::failed(
            Status(StatusCode::output,
                   concat(end_of_work.message.empty() ? "the task ended without a report"
                                                      : end_of_work.message,
                          line.empty() ? "" : ": ", line)));
        if (code > 0 && code < 128) end.exit_code = code;
        // The others are of faults that another attempt does not mend.
        if (code < kExitUsage || code > kExitOutput) return again_or_failed(job, end);
    }
    RETURN_IF_ERROR(store_.set_remote(job.id, ""));
    return enter_end(job, end);
}

// -------------------------------------------------------------------------------------- its end
Status JobRunner::enter_end(const Job& job, const WorkEnd& end) {
    RETURN_IF_ERROR(store_.end(ended_job(job, end, readers_)));
    const auto now = store_.listed(job.id);
    if (now.ok() && *now && !(*now)->remote.empty()) return Status();  // its tasks end first
    forget(job.id);
    return Status();
}

// Ends a run: with `end` if that is a failure, otherwise as its frames have ended.
Status JobRunner::end_with_rest(const Job& job, WorkEnd end) {
    ASSIGN_OR_RETURN(const auto tally, store_.tally(job.id));
    ASSIGN_OR_RETURN(const auto now, store_.listed(job.id));
    if (!now) return Status();  // removed meanwhile
    if (end.state == JobState::failed) {
        if (tally.waiting > 0)
            end.message += concat("; ", tally.waiting, tally.waiting == 1 ? " frame" : " frames",
                                  " left; a retry continues with them");
        return enter_end(job, end);
    }
    if (!tally.quarantined.empty())
        end.say(concat(tally.quarantined.size(), " of ", now->frames,
                       " frames quarantined: ", sequence::frames_text(tally.quarantined),
                       "; frame ", tally.quarantined.front(), ": ", tally.reason));
    const auto say = [&](int count, const char* how) {
        if (count > 0) end.say(concat(count, count == 1 ? " frame is " : " frames are ", how));
    };
    say(tally.missing, "not on disk");
    say(tally.held, "held");
    if (!end.message.empty()) end.exit_code = kExitSomeFailed;
    if (!tally.quarantined.empty()) {
        end.state = JobState::failed;
        const Followed& followed = followed_[job.id];
        end.exit_code = exit_code_of(*now, followed.first_code, followed.unhealthy);
    }
    return enter_end(job, end);
}

void JobRunner::forget(const std::string& id) {
    followed_.erase(id);
    {
        const std::lock_guard lock(mutex_);
        remaining_s_.erase(id);
    }
    const auto job = store_.listed(id);
    // The messages of a job that failed stay for people.
    if (!job.ok() || (*job && ((*job)->state == JobState::failed || (*job)->ended_ms == 0))) return;
    std::error_code error;
    fs::remove_all(folder_of(id), error);
}

void JobRunner::clean_up() const {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(settings_.folder, error)) {
        const std::string id = entry.path().filename().string();
        if (!std::ranges::all_of(id, [](unsigned char c) { return std::isdigit(c) != 0; }))
            continue;
        const auto job = store_.listed(id);
        if (!job.ok()) continue;
        if (*job &&
            ((*job)->ended_ms == 0 || (*job)->state == JobState::failed || !(*job)->remote.empty()))
            continue;
        fs::remove_all(entry.path(), error);
    }
}

}  // namespace postchain::service
