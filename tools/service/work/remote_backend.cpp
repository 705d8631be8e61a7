#include "tools/service/work/remote_backend.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "chain/base/text.h"
#include "config/chain_file.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/memory.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/helper_threads.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// An array of Slurm has at most 1000 tasks unless MaxArraySize is raised.
constexpr int kMaxTasks = 1000;

// Words of `postchain run` for the settings that the job gives, other than its files and frames.
std::vector<std::string> words_of(const JobRequest& request) {
    std::vector<std::string> words = {"--on-error=continue"};
    for (const auto& [key, value] : request.run.given) {
        if (key == "input" || key == "behind") continue;
        const std::string option = sequence::option_name(key);
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
std::string stepped_ranges_of(const std::vector<int>& frames) {
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

std::string input_words(const io::InputSpec& input) {
    if (!input.separate_files()) return input.color().text();
    std::string text;
    for (const auto& [role, pattern] : input.patterns)
        text += concat(text.empty() ? "" : ",", io::InputSpec::word_of(role), "=", pattern.text());
    return text;
}

}  // namespace

RemoteBackend::RemoteBackend(JobStore& store, const Readers& readers,
                             const RemoteSettings& settings)
    : store_(store), readers_(readers), settings_(settings) {}

RemoteBackend::~RemoteBackend() {
    end();
}

Status RemoteBackend::begin() {
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
    state.works = true;
    state.renderer = settings_.queue->name();
    state.trouble = trouble_;
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
        try {
            poll_queue();
        } catch (...) {
            // Out of memory at a place without a Status; a later poll may succeed.
        }
        lock.lock();
        began_.reset();
        changed_.notify_all();
        changed_.wait_for(lock, settings_.poll, [&] { return ends_ || awake_; });
    }
}

bool RemoteBackend::ends() const {
    const std::lock_guard lock(mutex_);
    return ends_;
}

void RemoteBackend::poll_queue() {
    std::string trouble;
    const auto note = [&](const Status& status) {
        if (!status.ok() && trouble.empty()) trouble = status.message();
    };
    const auto known = store_.remotes();
    note(known.status());
    if (known.ok()) {
        for (const auto& [job, remote] : *known) {
            if (ends()) return;
            note(follow(job, remote));
        }
    }
    // Running jobs without a remote one: new, or with frames to make again.
    const auto running = store_.jobs("running", "", 10'000);
    note(running.status());
    if (running.ok()) {
        for (const Job& job : *running) {
            if (ends()) return;
            const auto remote = store_.remote(job.id);
            if (!remote.ok() || !remote->empty()) continue;
            const auto whole = store_.job(job.id);  // with its body
            note(whole.status());
            if (whole.ok() && *whole) note(take(**whole));
        }
    }
    while (!ends()) {
        const auto next = store_.next(-kMaxPriority);
        note(next.status());
        if (!next.ok() || !*next) break;
        const auto started = store_.start((*next)->id);
        note(started.status());
        if (!started.ok()) break;
        if (*started == 0) continue;  // canceled just now
        const auto remote = store_.remote((*next)->id);
        // With a remote job it was handed over by an earlier process.
        if (remote.ok() && remote->empty()) note(take(**next));
    }
    const std::lock_guard lock(mutex_);
    trouble_ = trouble;
}

Status RemoteBackend::enter_end(const Job& job, const WorkEnd& end) {
    forget(job.id);
    return store_.end(ended_job(job, end, readers_));
}

void RemoteBackend::forget(const std::string& id) {
    requests_.erase(id);
    refusals_.erase(id);
}

Status RemoteBackend::take(const Job& job) {
    auto read = readers_.read(job);
    if (!read.ok()) return enter_end(job, WorkEnd::failed(read.status()));
    JobRequest& request = read->request;
    ASSIGN_OR_RETURN(const auto begun, store_.has_begun(job.id));
    if (!begun) {
        const auto frames = begin_frames(request, read->reader.roots());
        if (!frames.ok()) return enter_end(job, WorkEnd::failed(frames.status()));
        std::error_code error;
        const std::string folder = request.run.output.folder();
        if (request.run.make_folder) fs::create_directories(folder, error);
        if (!fs::is_directory(folder, error))
            return enter_end(job, WorkEnd::failed(Status(StatusCode::output,
                                                         folder + ": folder does not exist")));
        RETURN_IF_ERROR(store_.enter_frames(job.id, *frames));
    }
    return hand_over(job, request);
}

Status RemoteBackend::hand_over(const Job& job, JobRequest& request) {
    ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
    if (waiting.empty()) return enter_outputs(job, request, true, "");
    // Another round has another name: the queue may still know the earlier one.
    const std::string name = concat("postchain-", hex_of(hash_text(settings_.folder)).substr(0, 8),
                                    "-", job.id, "-", waiting.front().attempts);
    auto remote = settings_.queue->find(name);
    if (!remote.ok()) return remote.status();
    if (remote->empty()) {
        const std::string folder = settings_.folder + "/" + job.id;
        std::error_code error;
        fs::create_directories(folder, error);
        const std::string chain = folder + "/chain.yaml";
        std::ofstream out(chain);
        out << write_chain(request.chain.chain);
        out.close();
        if (!out)
            return Status(StatusCode::output, chain + ": cannot be written; see --farm-folder");
        std::vector<std::string> command = {settings_.program,
                                            "run",
                                            chain,
                                            "--input",
                                            input_words(request.run.input),
                                            "--output",
                                            request.run.output.text(),
                                            "--on-existing=skip",
                                            "--device=" + settings_.device};
        // The frames that were listed at the start, whatever comes later.
        ASSIGN_OR_RETURN(const auto frames, store_.frames(job.id));
        std::vector<int> numbers;
        for (const JobFrame& frame : frames)
            if (frame.state == FrameState::waiting) numbers.push_back(frame.frame);
        for (std::string& word : words_of(request)) command.push_back(std::move(word));
        command.push_back("--frames=" + stepped_ranges_of(numbers));
        const int per_task = settings_.frames_per_task;
        const int tasks = std::min((int(numbers.size()) + per_task - 1) / per_task, kMaxTasks);
        remote = settings_.queue->submit({name, command, tasks, folder, settings_.max_memory});
        if (!remote.ok()) {
            // A refusal stays one; a queue that does not answer is asked again.
            if (remote.status().code() != StatusCode::usage ||
                ++refusals_[job.id] < settings_.attempts)
                return remote.status();
            return enter_end(job, WorkEnd::failed(remote.status()));
        }
        refusals_.erase(job.id);
    }
    return store_.set_remote(job.id, *remote);
}

Status RemoteBackend::follow(const Job& job, const std::string& remote) {
    if (job.ended_ms != 0) {
        RETURN_IF_ERROR(settings_.queue->cancel(remote));
        forget(job.id);
        return store_.set_remote(job.id, "");
    }
    // Before the outputs: what is not there afterward was not made.
    ASSIGN_OR_RETURN(const auto tasks, settings_.queue->look(remote));
    auto request = requests_.find(job.id);
    if (request == requests_.end()) {
        // The job was read when it was handed over: a fault now is the disk's, and may pass.
        auto read = readers_.read(job);
        if (!read.ok()) return read.status().at("job " + job.id);
        request = requests_.emplace(job.id, std::move(read->request)).first;
    }
    const bool ended = !tasks.known || tasks.ended();
    const std::string why =
        tasks.message.empty() ? "the task ended without this frame" : tasks.message;
    return enter_outputs(job, request->second, ended, why);
}

// Records frames whose outputs are on disk. At the end the others have failed an attempt.
Status RemoteBackend::enter_outputs(const Job& job, const JobRequest& request, bool at_end,
                                    const std::string& why) {
    ASSIGN_OR_RETURN(const auto waiting, store_.to_do(job.id));
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
            RETURN_IF_ERROR(
                store_.frame_fails(job.id, frame.frame,
                                   concat(why, "; see ", settings_.folder, "/", job.id, "/*.log")));
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
