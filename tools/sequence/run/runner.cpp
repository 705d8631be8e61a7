#include "tools/sequence/run/runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>
#include <semaphore>
#include <system_error>
#include <thread>

#include "tools/sequence/io/atomic_file.h"
#include "tools/sequence/run/channel.h"
#include "tools/sequence/run/sidecar.h"
#include "tools/sequence/run/task.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A frame on its way. Without `source` the report is final.
struct Job {
    size_t index = 0;  // into the tasks
    FrameReport report;
    std::optional<SourceFrame> source;
    std::string work;
    ImageF result;
};

// What `work` throws must not leave its thread: memory runs out in a library, mostly.
template <class Work>
Status guarded(const std::string& place, const Work& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Status(StatusCode::internal, place + ": not enough memory");
    } catch (const std::exception& error) {
        return Status(StatusCode::internal, concat(place, ": unexpected failure: ", error.what()));
    }
}

uint64_t count_nonfinite(const ImageF& image) {
    uint64_t count = 0;
    for (size_t pixel = 0; pixel < image.pixels(); ++pixel) {
        bool bad = false;
        for (int c = 0; c < image.channels; ++c)
            bad |= !std::isfinite(image.data[pixel * size_t(image.channels) + size_t(c)]);
        count += bad;
    }
    return count;
}

// What is done with each frame: a chain's output is written, or a visitor has a look.
struct Work {
    const Chain* chain = nullptr;  // with executor and renderer; null: the visitor's
    Executor* executor = nullptr;
    std::string renderer;
    RoleSet wanted;  // by the visitor
    FrameVisitor visitor;
};

class Run {
  public:
    Run(const Work& work, const RunSettings& settings, const FrameObserver& observer,
        const std::atomic<bool>* stop, std::vector<Task> tasks)
        : work_(work),
          settings_(settings),
          observer_(observer),
          stop_(stop),
          tasks_(std::move(tasks)) {}

    Result<RunSummary> walk() {
        start_ = Clock::now();
        summary_.total = tasks_.size();
        std::thread reader, writer;
        try {
            writer = std::thread([this] { write_all(); });
            reader = std::thread([this] { read_all(); });
        } catch (const std::system_error& error) {
            to_write_.close();
            if (writer.joinable()) writer.join();
            return Status(
                StatusCode::internal,
                concat("no thread could be started (too little memory, or too many threads): ",
                       error.what()));
        }
        while (auto job = to_filter_.pop()) {
            if (job->source && !given_up(*job))
                if (Status status = guarded(job->report.output, [&] { return filter(*job); });
                    !status.ok())
                    fail(*job, status);
            if (!to_write_.push(std::move(*job))) break;
            report_finished();
        }
        to_write_.close();
        reader.join();
        writer.join();
        report_finished();
        summary_.elapsed_s = milliseconds_since(start_) * 1e-3;
        if (work_.executor) summary_.counters = work_.executor->counters();
        summary_.frames_in_flight = in_flight_peak_;
        return summary_;
    }

  private:
    // After a failure under ErrorPolicy::stop the frames before it are still finished: what is
    // written must not depend on how far ahead the reader was.
    bool given_up(size_t index) const { return index > first_failed_ || (stop_ && *stop_); }
    bool given_up(const Job& job) const { return given_up(job.index); }

    // ------------------------------------------------------------------- reader thread
    void read_all() {
        for (size_t index = 0; index < tasks_.size(); ++index) {
            const Task& task = tasks_[index];
            room_.acquire();
            if (given_up(index)) {
                room_.release();
                break;
            }
            const int alive = ++in_flight_;
            in_flight_peak_ = std::max(in_flight_peak_.load(), alive);
            Job job;
            job.index = index;
            job.report.frame = task.frame;
            job.report.output = task.output;
            job.report.inputs = task.files;
            job.report.renderer = work_.renderer;
            if (Status status = guarded(task.output, [&] { return read(task, job); }); !status.ok())
                fail(job, status);
            if (!to_filter_.push(std::move(job))) break;
        }
        to_filter_.close();
    }

    Status read(const Task& task, Job& job) {
        if (task.files.empty()) {
            job.report.outcome = Outcome::missing;
            job.report.status = Status(
                StatusCode::input, absent_files(task.frame, settings_) + ": frame is not on disk");
            return Status();
        }
        if (work_.chain && settings_.on_existing == io::OnExisting::fail)
            if (Status status = check_none_exists({task}, settings_); !status.ok()) return status;
        std::error_code error;
        const bool exists = work_.chain && fs::exists(task.output, error);
        auto header = open_source_frame(settings_.source, task.files, task.source);
        if (!header.ok()) return header.status();
        if (work_.chain)
            job.work = work_text(*work_.chain, settings_, *header, task.files, task.source);
        job.report.profile = header->match.profile;
        if (exists && settings_.on_existing == io::OnExisting::skip &&
            same_work_done(task, job.work, settings_)) {
            job.report.outcome = Outcome::skipped;
            return Status();
        }
        const RoleSet wanted =
            work_.chain ? planes_needed(*work_.chain, settings_.source, *header, settings_.plan)
                        : work_.wanted;
        auto source = read_source_frame(settings_.source, std::move(*header), wanted,
                                        work_.chain ? io::Keep::all : io::Keep::nothing);
        if (!source.ok()) return source.status();
        job.report.warnings = source->warnings;
        job.report.work = job.work;
        job.report.facts = source->description.facts;
        job.report.first_nonfinite = source->first_nonfinite;
        job.report.read_ms = source->read_ms;
        job.report.convert_ms = source->convert_ms;
        const auto& facts = source->description.facts;
        const uint64_t bad = facts.nonfinite_color + facts.nonfinite_depth + facts.nonfinite_motion;
        if (settings_.strict && bad > 0)
            return Status(StatusCode::health,
                          concat(task.files.at(Role::color), ": ", bad,
                                 " non-finite pixels under --strict, the first at ",
                                 source->first_nonfinite_text(), "; nothing written"));
        source->description.frame_number = task.source;
        if (work_.chain) {
            auto plan = plan_source_frame(*work_.chain, *source, settings_.plan);
            if (!plan.ok()) return plan.status();
            job.report.plan = std::move(*plan);
        }
        job.report.outcome = task.source == task.frame ? Outcome::written : Outcome::held;
        job.report.held_from = task.source;
        job.source = std::move(*source);
        return Status();
    }

    // --------------------------------------------------------------- caller's thread, GL
    Status filter(Job& job) {
        const auto start = Clock::now();
        if (!work_.chain) {
            const Status status = work_.visitor(*job.source, job.report);
            job.report.filter_ms = milliseconds_since(start);
            return status;
        }
        Executor& executor = *work_.executor;
        executor.set_timing(true);
        StageObserver dump;
        if (!settings_.dump_folder.empty())
            dump = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                return dump_stage(job.report.frame, texture, pixels);
            };
        auto result = executor.filter(*job.report.plan, job.source->planes, dump);
        if (!result.ok()) return result.status().at(job.report.inputs.at(Role::color));
        job.result = std::move(result->at(Role::color));
        job.source->planes.clear();
        job.report.filter_ms = milliseconds_since(start);
        job.report.pass_times = executor.pass_times();
        job.report.work_done = executor.work_done();
        job.report.timing_source = executor.timing_source();
        job.report.counters = executor.counters();
        return Status();
    }

    Status dump_stage(int frame, const PlanTexture& texture, const ImageF& pixels) {
        static const std::vector<std::string> names = {"R", "G", "B", "A"};
        char number[16];
        std::snprintf(number, sizeof(number), ".%04d.exr", frame);
        return io::write_planes_exr(settings_.dump_folder + "/" + texture.name + number, pixels,
                                    {names.begin(), names.begin() + pixels.channels})
            .status();
    }

    // ------------------------------------------------------------------- writer thread
    void write_all() {
        while (auto job = to_write_.pop()) {
            if (job->source && !given_up(*job)) {
                const std::string& place = job->report.output;
                if (Status status = guarded(place, [&] { return write(*job); }); !status.ok())
                    fail(*job, status);
            } else if (job->source) {
                job->report.status = Status(StatusCode::canceled, "stopped before it was written");
                job->report.outcome = Outcome::failed;
            }
            job->source.reset();
            job->result = {};
            --in_flight_;
            room_.release();
            finished_.push(std::move(job->report));
        }
        finished_.close();
    }

    Status write(Job& job) {
        if (!work_.chain) return Status();
        const auto start = Clock::now();
        FrameReport& report = job.report;
        report.output_nonfinite = count_nonfinite(job.result);
        if (report.output_nonfinite > 0 && settings_.strict)
            return Status(StatusCode::health,
                          concat(report.output, ": ", report.output_nonfinite,
                                 " non-finite output pixels under --strict; not written"));
        to_file_convention(job.result, job.source->conversion);
        io::WriteOptions options;
        options.on_existing = settings_.on_existing == io::OnExisting::fail
                                  ? io::OnExisting::fail
                                  : io::OnExisting::overwrite;
        options.overflow = settings_.overflow;
        options.attributes["postchain"] = job.work;
        auto written = io::write_filtered(report.output, job.source->input, job.result, options);
        if (!written.ok()) return written.status();
        report.write = std::move(*written);
        report.write_ms = milliseconds_since(start);
        report.frames_in_flight = in_flight_peak_;
        if (settings_.preview) {
            io::PreviewOptions preview;
            preview.on_existing = options.on_existing;
            if (Status status =
                    io::write_png_preview(preview_path(report.output), job.result, preview);
                !status.ok())
                return status;
        }
        if (!settings_.sidecar) return Status();
        return io::atomic_write_text(report.output + ".json",
                                     sidecar_json(report, settings_.version))
            .status();
    }

    // --------------------------------------------------------------------- any thread
    void fail(Job& job, const Status& status) {
        job.report.outcome = Outcome::failed;
        job.report.status = status;
        job.source.reset();
        if (settings_.on_error == ErrorPolicy::keep_going) return;
        size_t first = first_failed_;
        while (job.index < first && !first_failed_.compare_exchange_weak(first, job.index)) {
        }
    }

    void report_finished() {
        while (auto report = finished_.try_pop()) {
            switch (report->outcome) {
                case Outcome::written:
                    ++summary_.written;
                    break;
                case Outcome::skipped:
                    ++summary_.skipped;
                    break;
                case Outcome::held:
                    ++summary_.held;
                    break;
                case Outcome::missing:
                    ++summary_.missing;
                    break;
                case Outcome::failed:
                    // A frame given up because of a stop is not a failure of its own.
                    if (report->status.code() == StatusCode::canceled) continue;
                    ++summary_.failed;
                    break;
            }
            if (!report->status.ok() && summary_.first_failure.ok())
                summary_.first_failure = report->status;
            ++done_;
            RunProgress progress{done_, tasks_.size(), milliseconds_since(start_) * 1e-3, 0};
            progress.remaining_s =
                progress.elapsed_s / double(done_) * double(tasks_.size() - done_);
            if (!observer_) continue;
            const Status status = guarded(concat("frame ", report->frame), [&] {
                observer_(*report, progress);
                return Status();
            });
            if (!status.ok() && summary_.first_failure.ok()) {
                ++summary_.failed;
                summary_.first_failure = status;
                first_failed_ = 0;
            }
        }
    }

    const Work& work_;
    const RunSettings& settings_;
    const FrameObserver& observer_;
    const std::atomic<bool>* stop_;
    const std::vector<Task> tasks_;

    Channel<Job> to_filter_{1};
    Channel<Job> to_write_{1};
    Channel<FrameReport> finished_{std::numeric_limits<size_t>::max()};
    std::counting_semaphore<kFramesInFlight> room_{kFramesInFlight};
    static constexpr size_t kNone = std::numeric_limits<size_t>::max();
    std::atomic<size_t> first_failed_ = kNone;  // index of the task; kNone = go on
    std::atomic<int> in_flight_ = 0;
    std::atomic<int> in_flight_peak_ = 0;
    Clock::time_point start_;
    size_t done_ = 0;
    RunSummary summary_;
};

}  // namespace

const char* name_of(Outcome outcome) {
    switch (outcome) {
        case Outcome::written:
            return "written";
        case Outcome::skipped:
            return "skipped";
        case Outcome::held:
            return "held";
        case Outcome::missing:
            return "missing";
        case Outcome::failed:
            return "failed";
    }
    return "unknown";
}

Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop) {
    std::vector<int> gaps;
    auto tasks = plan_tasks(settings, true, gaps);
    if (!tasks.ok()) return tasks.status();
    std::error_code error;
    const std::string folder = settings.output.folder();
    if (!fs::is_directory(folder, error))
        return Status(
            StatusCode::output,
            folder + (fs::exists(folder, error) ? ": is not a folder"
                                                : ": folder does not exist; make it first"));
    if (!settings.dump_folder.empty() && !fs::is_directory(settings.dump_folder, error))
        return Status(StatusCode::output,
                      settings.dump_folder + ": folder of --dump-stages does not exist");
    const Work work{&chain, &executor, renderer, {}, {}};
    auto summary = Run(work, settings, observer, stop, std::move(*tasks)).walk();
    if (summary.ok()) summary->gaps = std::move(gaps);
    return summary;
}

Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop) {
    std::vector<int> gaps;
    auto tasks = plan_tasks(settings, false, gaps);
    if (!tasks.ok()) return tasks.status();
    const Work work{nullptr, nullptr, {}, wanted, visitor};
    auto summary = Run(work, settings, observer, stop, std::move(*tasks)).walk();
    if (summary.ok()) summary->gaps = std::move(gaps);
    return summary;
}

}  // namespace postchain::sequence
