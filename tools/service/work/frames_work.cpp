#include "tools/service/work/frames_work.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "config/text_tree.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/run/run_sequence.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using sequence::FrameTask;
using sequence::RunSettings;

constexpr size_t kFramesToCompare = 16;

class FramesWork {
  public:
    FramesWork(const Job& job, JobRequest& request, const WorkContext& context)
        : id_(job.id),
          body_(job.body),
          started_ms_(job.started_ms),
          request_(request),
          chain_(request.chain.chain),
          settings_(request.run),
          stops_on_error_(request.run.on_error == sequence::ErrorPolicy::stop),
          missing_(request.run.missing),
          context_(context) {
        // A failed frame is tried again while the others continue.
        settings_.on_error = sequence::ErrorPolicy::keep_going;
    }

    WorkEnd work() {
        const auto begun = context_.store.has_begun(id_);
        if (!begun.ok()) return store_failed(begun.status());
        if (!*begun) {
            if (auto end = begin()) return *end;
        } else {
            context_.progress.does("the frames that are done were not read");
            const Status status = same_look();
            context_.progress.does("");
            if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
            if (!status.ok()) return WorkEnd::failed(status);
        }
        // Frames missing at the beginning are in the store by now. Without `skip`, a frame that
        // goes missing later fails.
        if (missing_ == sequence::MissingPolicy::error)
            settings_.missing = sequence::MissingPolicy::skip;
        for (;;) {
            const auto waiting = context_.store.to_do(id_);
            if (!waiting.ok()) return store_failed(waiting.status());
            if (waiting->empty()) return ending();
            if (context_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
            const Status status = work_on(next_of(*waiting));
            if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
            // Frames that were begun and interrupted wait again without a counted attempt.
            const Status released = context_.store.release(id_);
            if (!store_.ok()) return store_failed(store_);
            if (!released.ok()) return store_failed(released);
            if (gl_failed_) return WorkEnd::of(WorkEnd::How::gl_failed, gl_message_);
            if (!status.ok()) {
                if (context_.stop) return WorkEnd::of(WorkEnd::How::stopped, "");
                return rest_left(WorkEnd::failed(status));
            }
            if (quarantined_ && stops_on_error_) return rest_left(stopped_by_error());
        }
    }

  private:
    struct Batch {
        std::vector<int> frames;
        bool judged = false;  // one frame, whose existing output may be this job's
        std::set<int> begun;
        std::set<int> suspects;  // frames in flight when a process died, and those beside them
    };

    // --------------------------------------------------------------------------- beginning
    // The checks that the command makes before its first frame. Enters the frames in the store.
    std::optional<WorkEnd> begin() {
        context_.progress.does("the input's folder was not listed");
        const auto frames = begin_frames(request_, context_.reader.roots());
        context_.progress.does("");
        if (!frames.ok()) return WorkEnd::failed(frames.status());
        if (context_.lost) return WorkEnd::of(WorkEnd::How::stopped, "");
        if (Status status = context_.store.enter_frames(id_, *frames); !status.ok())
            return store_failed(status);
        for (const JobFrame& frame : *frames) {
            sequence::FrameReport report;
            report.outcome = frame.state == FrameState::missing ? sequence::Outcome::missing
                                                                : sequence::Outcome::failed;
            if (frame.state != FrameState::waiting) context_.counters.add(report);
        }
        const auto refused = std::ranges::find(*frames, FrameState::quarantined, &JobFrame::state);
        if (refused != frames->end()) first_failure_ = Status(StatusCode::output, refused->message);
        return std::nullopt;
    }

    // A job that goes on reads its files again. With an edited one the frames to do would look
    // otherwise than those that are done. Errors (input).
    Status same_look() const {
        const auto& files = settings_.other_inputs;
        const auto edited = std::ranges::find_if(
            files, [&](const io::InputFile& file) { return made_after(file.path, started_ms_); });
        if (edited == files.end()) return Status();
        const auto frames = context_.store.frames(id_);
        if (!frames.ok()) return Status();  // the work needs the store too, and says why
        std::vector<int> others;            // done, and not what this request makes
        for (const JobFrame& frame : *frames) {
            std::error_code error;
            if (frame.state != FrameState::written ||
                !fs::exists(settings_.output.format(frame.frame), error))
                continue;
            if (is_own_output(request_, frame.frame)) return Status();
            // A frame that is held, or whose input was rendered again, is among them too.
            others.push_back(frame.frame);
            if (others.size() == kFramesToCompare) break;
        }
        if (others.empty()) return Status();
        return Status(StatusCode::input,
                      concat(context_.reader.roots().shown(edited->path), ": ", edited->what,
                             " was changed after frame ", others[0],
                             " was made with it; submit the job again, with on_existing: skip"));
    }

    // ----------------------------------------------------------------------------- batches
    // Frames that were in flight when a process died come last and alone: if one of them kills the
    // process again, all other frames are done. The others run together, fewest attempts first.
    Batch next_of(const std::vector<FrameToDo>& waiting) const {
        const auto less = [](const FrameToDo& a, const FrameToDo& b) {
            return std::pair(a.alone, a.attempts) < std::pair(b.alone, b.attempts);
        };
        const FrameToDo& first = *std::ranges::min_element(waiting, less);
        Batch batch;
        batch.judged = is_judged(first);
        for (const FrameToDo& frame : waiting)
            if (frame.alone) batch.suspects.insert({frame.frame - 1, frame.frame, frame.frame + 1});
        for (const FrameToDo& frame : waiting) {
            const bool alike = frame.alone == first.alone && frame.attempts == first.attempts &&
                               frame.begun == first.begun && is_judged(frame) == batch.judged;
            if (!alike) continue;
            batch.frames.push_back(frame.frame);
            if (frame.begun) batch.begun.insert(frame.frame);
            if (first.alone || batch.judged) break;
        }
        return batch;
    }

    // With `on_existing: fail`, the existing output of a begun frame may be from this job or not.
    bool is_judged(const FrameToDo& frame) const {
        std::error_code error;
        return frame.begun && settings_.on_existing == io::OnExisting::fail &&
               fs::exists(fs::symlink_status(settings_.output.format(frame.frame), error));
    }

    Status work_on(const Batch& batch) {
        context_.progress.does("the input's folder was not listed");
        RETURN_IF_ERROR(check_run_paths(settings_, context_.reader.roots()));
        if (context_.lost) return Status();
        RunSettings settings = sequence::settings_for(settings_, {&chain_});
        settings.frames = io::FrameRange{batch.frames};
        settings.chunk = {};  // the job's frames are already those of its chunk
        batch_ = &batch;
        if (batch.judged) {
            // Recorded first, because is_own() opens the frame's files.
            if (!entered(context_.store.frame_begins(id_, batch.frames[0]))) return store_;
            if (is_own_output(request_, batch.frames[0]))
                settings.on_existing = io::OnExisting::skip;
        } else if (!batch.begun.empty() && settings.on_existing != io::OnExisting::fail) {
            // Keeps this job's own outputs. Others are replaced as the job requests.
            settings.on_existing = io::OnExisting::skip;
        }
        context_.progress.does("");
        const Status status =
            sequence::run_sequence(
                chain_, settings, context_.gl.executor(), context_.gl.renderer(),
                {.finished =
                     [&](const sequence::FrameReport& report,
                         const sequence::RunProgress& progress) {
                         if (!context_.lost) finish(report, progress);
                     },
                 .stop = &context_.stop,
                 .start = [&](const FrameTask& task) { return start(task); },
                 .steps = [&](sequence::FrameStep step, int frame,
                              bool begins) { context_.progress.step(step, frame, begins); },
                 .try_file = [&](const std::string& path,
                                 int frame) { return tried(batch, path, frame); }})
                .status();
        context_.progress.does("the job did not go on");
        return status;
    }

    // ---------------------------------------------------------------------------- one frame
    // Called on the reader thread.
    Status start(const FrameTask& task) {
        if (context_.lost) return Status(StatusCode::canceled, "the job has ended");
        if (!batch_->judged)
            if (Status status = context_.store.frame_begins(id_, task.frame); !status.ok()) {
                context_.stop = true;
                return status;
            }
        const Roots& roots = context_.reader.roots();
        for (const auto& [role, path] : task.files)
            if (!roots.resolve(path).ok())
                return Status(StatusCode::input,
                              path + ": links outside the folders of this service");
        return check_folder(settings_.output.folder(), roots);
    }

    // Called on the reader thread. A file that kills the process that decodes it kills another one.
    Status tried(const Batch& batch, const std::string& path, int frame) const {
        if (!context_.try_file || !batch.suspects.contains(frame)) return Status();
        return context_.try_file({path, frame, settings_.source, body_}, context_.reader.roots());
    }

    void finish(const sequence::FrameReport& report, const sequence::RunProgress& progress) {
        context_.counters.add(report);
        switch (report.outcome) {
            case sequence::Outcome::written:
            case sequence::Outcome::held:
            case sequence::Outcome::skipped:
                entered(context_.store.frame_ends(id_, end_of(report)));
                break;
            case sequence::Outcome::missing:
                // The job was tried again.
                if (missing_ == sequence::MissingPolicy::skip)
                    entered(context_.store.frame_ends(id_, end_of(report)));
                else
                    failed(report);
                break;
            case sequence::Outcome::failed:
                failed(report);
                break;
        }
        context_.remaining(progress.remaining_s);
        context_.between();
    }

    FrameEnd end_of(const sequence::FrameReport& report) const {
        const Roots& roots = context_.reader.roots();
        FrameEnd end;
        end.frame = report.frame;
        end.filter_ms = report.filter_ms;
        // A begun frame that is found done was written by this job in a process that died.
        const bool own = batch_->begun.count(report.frame) > 0;
        if (report.outcome == sequence::Outcome::missing) {
            end.state = FrameState::missing;
            end.message = roots.shown_in(report.status.message());
            return end;
        }
        if (report.outcome == sequence::Outcome::skipped) {
            end.state = own ? FrameState::written : FrameState::skipped;
            if (own) end.bytes = bytes_of_outputs(report.output, settings_);
            return end;
        }
        end.state = FrameState::written;
        end.bytes = int64_t(report.written_bytes);
        for (const std::string& warning : report.warnings)
            end.message += (end.message.empty() ? "" : "; ") + roots.shown_in(warning);
        end.held = report.outcome == sequence::Outcome::held;
        if (end.held)
            end.message = concat("frame ", report.held_from, " is written in its place",
                                 end.message.empty() ? "" : "; ", end.message);
        return end;
    }

    void failed(const sequence::FrameReport& report) {
        const Status& status = report.status;
        if (first_failure_.ok()) first_failure_ = status;
        if (status.code() == StatusCode::health) unhealthy_ = true;
        if (status.code() == StatusCode::gl) {
            gl_failed_ = true;
            gl_message_ = status.message();
            context_.stop = true;
        }
        entered(context_.store.frame_fails(id_, report.frame,
                                           context_.reader.roots().shown_in(status.message())));
        const auto now = context_.store.frame(id_, report.frame);
        if (now.ok() && *now && (*now)->state == FrameState::quarantined) {
            quarantined_ = true;
            if (stops_on_error_) context_.stop = true;
        }
    }

    bool entered(const Status& status) {
        if (status.ok()) return true;
        store_ = status;
        context_.stop = true;
        return false;
    }

    // ------------------------------------------------------------------------------- ending
    WorkEnd store_failed(const Status& status) const {
        return WorkEnd::of(WorkEnd::How::store_failed, status.message());
    }

    WorkEnd rest_left(WorkEnd end) const {
        const auto tally = context_.store.tally(id_);
        if (tally.ok() && tally->waiting > 0)
            end.message += concat("; ", tally->waiting, tally->waiting == 1 ? " frame" : " frames",
                                  " left; a retry continues with them");
        return end;
    }

    WorkEnd stopped_by_error() const {
        WorkEnd end = WorkEnd::failed(first_failure_);
        const auto job = context_.store.job(id_);
        if (job.ok() && *job)
            end.exit_code = exit_code_of_frames((*job)->done, first_failure_, unhealthy_);
        return end;
    }

    WorkEnd ending() const {
        const auto end = end_of_frames(context_.store, id_, first_failure_, unhealthy_);
        return end.ok() ? *end : store_failed(end.status());
    }

    const std::string id_, body_;
    const int64_t started_ms_;
    const JobRequest& request_;
    const Chain& chain_;
    RunSettings settings_;
    const bool stops_on_error_;
    const sequence::MissingPolicy missing_;
    const WorkContext& context_;
    const Batch* batch_ = nullptr;
    Status first_failure_;
    Status store_;  // why the store could not record a frame
    bool quarantined_ = false;
    bool unhealthy_ = false;  // --strict refused a frame
    bool gl_failed_ = false;
    std::string gl_message_;
};

}  // namespace

Result<std::vector<FrameTask>> tasks_of(const RunSettings& settings, bool writes) {
    std::vector<int> gaps;
    auto tasks = sequence::plan_tasks(settings, writes, gaps);
    if (tasks.ok() && tasks->size() > kMaxFramesOfJob)
        return Status(StatusCode::usage, concat("frames: ", tasks->size(), " are more than ",
                                                kMaxFramesOfJob, "; submit several jobs"));
    return tasks;
}

Status check_run_paths(const RunSettings& settings, const Roots& roots) {
    RETURN_IF_ERROR(check_inputs(settings.input, roots));
    RETURN_IF_ERROR(check_folder(settings.output.folder(), roots));
    return settings.dump_folder.empty() ? Status() : check_folder(settings.dump_folder, roots);
}

Result<std::vector<JobFrame>> begin_frames(const JobRequest& request, const Roots& roots) {
    ASSIGN_OR_RETURN(const auto tasks, tasks_of(request.run));
    const io::OutputFiles files = sequence::files_of_run(request.chain.chain, request.run, tasks);
    RETURN_IF_ERROR(files.check_names());
    // With `on_error: continue` each frame is refused separately.
    const bool stops = request.run.on_error == sequence::ErrorPolicy::stop;
    if (stops) RETURN_IF_ERROR(files.check_existing());
    RETURN_IF_ERROR(check_run_paths(request.run, roots));
    std::vector<JobFrame> frames;
    for (const FrameTask& task : tasks) {
        JobFrame frame;
        frame.frame = task.frame;
        frame.output = task.output;
        if (task.files.empty()) {
            frame.state = FrameState::missing;
            frame.message = roots.shown_in(sequence::absent_files(task.frame, request.run) +
                                           ": frame is not on disk");
        } else if (!stops) {
            if (const Status status = files.check_existing(sequence::outputs_of(task, request.run));
                !status.ok()) {
                frame.state = FrameState::quarantined;
                frame.message = roots.shown_in(status.message());
            }
        }
        frames.push_back(std::move(frame));
    }
    return frames;
}

bool is_own_output(const JobRequest& request, int frame) {
    const Chain& chain = request.chain.chain;
    RunSettings settings = sequence::settings_for(request.run, {&chain});
    settings.frames = io::FrameRange{{frame}};
    settings.chunk = {};
    settings.missing = sequence::MissingPolicy::skip;
    std::vector<int> gaps;
    const auto tasks = sequence::plan_tasks(settings, true, gaps);
    std::error_code error;
    if (!tasks.ok() || tasks->size() != 1 || !fs::exists((*tasks)[0].output, error)) return false;
    const FrameTask& task = (*tasks)[0];
    if (task.files.empty()) return false;
    sequence::SequenceReader reader(
        settings.source, settings.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.source, header, settings.plan);
        });
    const auto opened = reader.open(task.source, task.files);
    if (!opened.ok()) return false;
    RunSettings image_alone = settings;
    image_alone.sidecar = image_alone.preview = false;
    return sequence::is_done(task.output, sequence::fingerprint_of(chain, settings, *opened),
                             image_alone);
}

bool made_after(const std::string& path, int64_t ms) {
    std::error_code error;
    const auto time = fs::last_write_time(path, error);
    const auto since = std::chrono::file_clock::to_sys(time).time_since_epoch();
    return !error && std::chrono::duration_cast<std::chrono::milliseconds>(since).count() >= ms;
}

int64_t bytes_of_outputs(const std::string& output, const RunSettings& settings) {
    FrameTask task;
    task.output = output;
    int64_t sum = 0;
    for (const std::string& path : sequence::outputs_of(task, settings)) {
        std::error_code error;
        if (const auto bytes = fs::file_size(path, error); !error) sum += int64_t(bytes);
    }
    return sum;
}

int exit_code_of_frames(int done, const Status& first_failure, bool unhealthy) {
    if (unhealthy) return kExitHealth;
    return done > 0 || first_failure.ok() ? kExitSomeFailed : exit_code(first_failure);
}

Result<WorkEnd> end_of_frames(const JobStore& store, const std::string& id,
                              const Status& first_failure, bool unhealthy) {
    const auto tally = store.tally(id);
    const auto job = store.job(id);
    if (!tally.ok()) return tally.status();
    if (!job.ok()) return job.status();
    if (!*job) return WorkEnd::of(WorkEnd::How::stopped, "");  // removed meanwhile
    WorkEnd end;
    if (!tally->quarantined.empty())
        end.say(concat(tally->quarantined.size(), " of ", (*job)->frames,
                       " frames quarantined: ", sequence::frames_text(tally->quarantined),
                       "; frame ", tally->quarantined.front(), ": ", tally->reason));
    const auto say = [&](int count, const char* how) {
        if (count > 0) end.say(concat(count, count == 1 ? " frame is " : " frames are ", how));
    };
    say(tally->missing, "not on disk");
    say(tally->held, "held");
    if (!end.message.empty()) end.exit_code = kExitSomeFailed;
    if (!tally->quarantined.empty()) {
        end.state = JobState::failed;
        end.exit_code = exit_code_of_frames((*job)->done, first_failure, unhealthy);
    }
    return end;
}

WorkEnd work_on_frames(const Job& job, JobRequest& request, const WorkContext& context) {
    return FramesWork(job, request, context).work();
}

}  // namespace postchain::service
