#include "tools/offline/runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <semaphore>
#include <thread>

#include "tools/io/atomic_file.h"
#include "tools/offline/channel.h"
#include "tools/offline/sidecar.h"

namespace postchain::offline {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// What is to be made: one output, from the files of one (possibly other) frame.
struct Task {
    int frame = 0;                      // of the output
    int source = 0;                     // of the input; differs where a frame is held
    std::map<Role, std::string> files;  // empty: missing
    std::string output;
};

// A frame on its way. Without `source` the report is final.
struct Job {
    FrameReport report;
    std::optional<SourceFrame> source;
    std::string work;
    ImageF result;
};

std::string missing_text(const std::vector<int>& frames, const RunSettings& settings) {
    std::string list;
    for (size_t i = 0; i < frames.size() && i < 20; ++i)
        list += (i ? ", " : "") + std::to_string(frames[i]);
    if (frames.size() > 20) list += ", ...";
    return concat(settings.input.color().text(), ": ", frames.size(),
                  " of the requested frames are not on disk: ", list,
                  " (--missing skip or hold goes on without them)");
}

Result<std::vector<Task>> plan_tasks(const RunSettings& settings) {
    auto list = io::find_frames(settings.input, settings.frames);
    if (!list.ok()) return list.status();
    if (!list->missing.empty() && settings.missing == MissingPolicy::error)
        return Status(StatusCode::input, missing_text(list->missing, settings));
    if (list->frames.size() > 1 && !settings.output.has_token())
        return Status(StatusCode::usage, concat(settings.output.text(), ": one output name for ",
                                                list->frames.size(), " frames; put #### into it"));
    std::vector<Task> tasks;
    for (int frame : list->frames) {
        Task task;
        task.frame = task.source = frame;
        task.output = settings.output.format(frame);
        auto found = list->files.find(frame);
        if (found == list->files.end() && settings.missing == MissingPolicy::hold &&
            !list->files.empty()) {
            found = list->files.upper_bound(frame);
            if (found != list->files.begin()) --found;
        }
        if (found != list->files.end()) {
            task.source = found->first;
            task.files = found->second;
        }
        for (const auto& [role, path] : task.files) {
            std::error_code error;
            if (fs::equivalent(path, task.output, error))
                return Status(StatusCode::usage,
                              task.output +
                                  ": the output would replace its own input; name "
                                  "another file");
        }
        tasks.push_back(std::move(task));
    }
    return tasks;
}

bool same_work_done(const Task& task, const std::string& work, bool sidecar) {
    std::error_code error;
    if (sidecar && !fs::exists(task.output + ".json", error)) return false;
    auto existing = io::ExrFile::open(task.output);
    if (!existing.ok()) return false;
    for (const auto& part : existing->parts()) {
        const auto found = part.attributes.find("postchain");
        if (found != part.attributes.end() && found->second == work) return true;
    }
    return false;
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

class Run {
  public:
    Run(const Chain& chain, const RunSettings& settings, Executor& executor,
        const std::string& renderer, const FrameObserver& observer, const std::atomic<bool>* stop,
        std::vector<Task> tasks)
        : chain_(chain),
          settings_(settings),
          executor_(executor),
          renderer_(renderer),
          observer_(observer),
          stop_(stop),
          tasks_(std::move(tasks)) {}

    RunSummary walk() {
        start_ = Clock::now();
        summary_.total = tasks_.size();
        std::thread reader([this] { read_all(); });
        std::thread writer([this] { write_all(); });
        while (auto job = to_filter_.pop()) {
            if (job->source && !halted()) filter(*job);
            if (!to_write_.push(std::move(*job))) break;
            report_finished();
        }
        to_write_.close();
        reader.join();
        writer.join();
        report_finished();
        summary_.elapsed_s = milliseconds_since(start_) * 1e-3;
        summary_.counters = executor_.counters();
        summary_.frames_in_flight = in_flight_peak_;
        return summary_;
    }

  private:
    bool halted() const { return failed_ || (stop_ && *stop_); }

    // ------------------------------------------------------------------- reader thread
    void read_all() {
        for (const Task& task : tasks_) {
            room_.acquire();
            if (halted()) {
                room_.release();
                break;
            }
            const int alive = ++in_flight_;
            in_flight_peak_ = std::max(in_flight_peak_.load(), alive);
            Job job;
            job.report.frame = task.frame;
            job.report.output = task.output;
            job.report.inputs = task.files;
            job.report.renderer = renderer_;
            if (Status status = read(task, job); !status.ok()) fail(job, status);
            if (!to_filter_.push(std::move(job))) break;
        }
        to_filter_.close();
    }

    Status read(const Task& task, Job& job) {
        if (task.files.empty()) {
            job.report.outcome = Outcome::missing;
            job.report.status =
                Status(StatusCode::input,
                       settings_.input.color().format(task.frame) + ": frame is not on disk");
            return Status();
        }
        std::error_code error;
        const bool exists = fs::exists(task.output, error);
        if (exists && settings_.on_existing == io::OnExisting::fail)
            return Status(StatusCode::output,
                          task.output + ": exists (--on-existing skip or overwrite)");
        auto header = open_source_frame(settings_.source, task.files, task.source);
        if (!header.ok()) return header.status();
        job.work = work_text(chain_, settings_, *header, task.files, task.source);
        job.report.profile = header->match.profile;
        if (exists && settings_.on_existing == io::OnExisting::skip &&
            same_work_done(task, job.work, settings_.sidecar)) {
            job.report.outcome = Outcome::skipped;
            return Status();
        }
        const RoleSet wanted = chain_.required() | chain_.optional();
        const auto missing = header->match.missing;
        auto source =
            read_source_frame(settings_.source, std::move(*header), wanted, io::Keep::all);
        if (!source.ok()) return source.status();
        job.report.warnings = source->warnings;
        job.report.facts = source->description.facts;
        job.report.read_ms = source->read_ms;
        job.report.convert_ms = source->convert_ms;
        const auto& facts = source->description.facts;
        const uint64_t bad = facts.nonfinite_color + facts.nonfinite_depth + facts.nonfinite_motion;
        if (settings_.strict && bad > 0)
            return Status(StatusCode::health, concat(task.files.at(Role::color), ": ", bad,
                                                     " non-finite pixels under --strict"));
        source->description.frame_number = task.source;
        auto plan = make_plan(chain_, source->description, settings_.plan);
        if (!plan.ok()) {
            std::string looked_for;
            for (const auto& [role, names] : missing)
                if (chain_.required().has(role))
                    looked_for += concat("; ", name_of(role), " was looked for as ", names);
            const Status status = plan.status();
            return Status(status.code(),
                          task.files.at(Role::color) + ": " + status.message() +
                              (status.code() == StatusCode::input ? looked_for : ""));
        }
        job.report.plan = std::move(*plan);
        job.report.outcome = task.source == task.frame ? Outcome::written : Outcome::held;
        job.report.held_from = task.source;
        job.source = std::move(*source);
        return Status();
    }

    // --------------------------------------------------------------- caller's thread, GL
    void filter(Job& job) {
        const auto start = Clock::now();
        executor_.set_timing(true);
        StageObserver dump;
        if (!settings_.dump_folder.empty())
            dump = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                return dump_stage(job.report.frame, texture, pixels);
            };
        auto result = executor_.filter(*job.report.plan, job.source->planes, dump);
        if (!result.ok()) {
            fail(job, result.status().at(job.report.inputs.at(Role::color)));
            return;
        }
        job.result = std::move(result->at(Role::color));
        job.source->planes.clear();
        job.report.filter_ms = milliseconds_since(start);
        job.report.pass_times = executor_.pass_times();
        job.report.timing_source = executor_.timing_source();
        job.report.counters = executor_.counters();
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
            if (job->source && !halted()) {
                if (Status status = write(*job); !status.ok()) fail(*job, status);
            } else if (job->source) {
                job->report.status = Status(StatusCode::cancelled, "stopped before it was written");
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
            const auto name = fs::path(report.output).replace_extension(".png").string();
            if (Status status = io::write_png_preview(name, job.result); !status.ok())
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
        if (settings_.on_error == ErrorPolicy::stop) failed_ = true;
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
                    if (report->status.code() == StatusCode::cancelled) continue;
                    ++summary_.failed;
                    break;
            }
            if (!report->status.ok() && summary_.first_failure.ok())
                summary_.first_failure = report->status;
            ++done_;
            RunProgress progress{done_, tasks_.size(), milliseconds_since(start_) * 1e-3, 0};
            progress.remaining_s =
                progress.elapsed_s / double(done_) * double(tasks_.size() - done_);
            if (observer_) observer_(*report, progress);
        }
    }

    const Chain& chain_;
    const RunSettings& settings_;
    Executor& executor_;
    const std::string& renderer_;
    const FrameObserver& observer_;
    const std::atomic<bool>* stop_;
    const std::vector<Task> tasks_;

    Channel<Job> to_filter_{1};
    Channel<Job> to_write_{1};
    Channel<FrameReport> finished_{std::numeric_limits<size_t>::max()};
    std::counting_semaphore<kFramesInFlight> room_{kFramesInFlight};
    std::atomic<bool> failed_ = false;
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

std::string work_text(const Chain& chain, const RunSettings& settings, const FrameHeader& header,
                      const std::map<Role, std::string>& files, int frame) {
    std::string text = concat(chain.text(), camera_parameters().text(&header.camera), "\n",
                              name_of(settings.plan.precision), " frame ", frame, "\n");
    const auto& options = header.match.options;
    for (const auto* motion : {&options.motion, &options.motion_back})
        text += concat(int(motion->unit), " ", motion->scale_x, " ", motion->scale_y, " ",
                       motion->bias, " ", motion->sentinel, "\n");
    text += concat(int(options.depth), " ", options.unpremultiplied, " ",
                   int(settings.source.nonfinite_color), " ", int(settings.overflow), "\n");
    for (const auto& [role, where] : header.assignment) {
        text += concat(postchain::name_of(role), " ", where.part);
        for (const auto& channel : where.channels) text += " " + channel;
        text += "\n";
    }
    for (const auto& [role, path] : files) {
        std::error_code error;
        const auto size = fs::file_size(path, error);
        const auto time = fs::last_write_time(path, error).time_since_epoch().count();
        text += concat(fs::path(path).filename().string(), " ", size, " ", time, "\n");
    }
    return concat("postchain ", settings.version, " chain ", hex_of(chain.hash()), " work ",
                  hex_of(hash_text(text)));
}

Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& settings, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop) {
    auto tasks = plan_tasks(settings);
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
    return Run(chain, settings, executor, renderer, observer, stop, std::move(*tasks)).walk();
}

}  // namespace postchain::offline
