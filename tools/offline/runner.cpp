#include "tools/offline/runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <semaphore>
#include <system_error>
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

std::string preview_path(const std::string& output) {
    return fs::path(output).replace_extension(".png").string();
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

// The files that one frame lacks: of one pattern, or of those planes that have files of their own.
std::string absent_files(int frame, const RunSettings& settings) {
    std::string list;
    for (const auto& [role, pattern] : settings.input.patterns) {
        const std::string path = pattern.format(frame);
        std::error_code error;
        if (!settings.input.separate_files() || !fs::exists(path, error))
            list += (list.empty() ? "" : ", ") + path;
    }
    return list;
}

std::string missing_text(const std::vector<int>& frames, const RunSettings& settings) {
    return concat(absent_files(frames[0], settings), ": ", frames.size(),
                  " of the requested frames are not on disk: ", frames_text(frames),
                  " (--missing skip or hold goes on without them)");
}

// Existing outputs that OnExisting::fail would find one by one.
Status check_none_exists(const std::vector<Task>& tasks, const RunSettings& settings) {
    size_t count = 0;
    std::string first;
    for (const Task& task : tasks) {
        for (const auto& path : {task.output, settings.preview ? preview_path(task.output) : ""}) {
            std::error_code error;
            if (path.empty() || !fs::exists(path, error)) continue;
            if (count++ == 0) first = path;
        }
    }
    if (count == 0) return Status();
    return Status(StatusCode::output,
                  concat(first, ": exists", count > 1 ? concat(", and ", count - 1, " more") : "",
                         " (--on-existing skip or overwrite says what to do)"));
}

Status check_output_name(const RunSettings& settings) {
    std::string extension = fs::path(settings.output.text()).extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    if (extension == ".exr") return Status();
    return Status(StatusCode::usage,
                  settings.output.text() + ": outputs are OpenEXR files; let the name end in .exr");
}

// `writes`: outputs are to be made, so that their names matter.
Result<std::vector<Task>> plan_tasks(const RunSettings& settings, bool writes,
                                     std::vector<int>& gaps) {
    if (writes)
        if (Status status = check_output_name(settings); !status.ok()) return status;
    auto list = io::find_frames(settings.input, settings.frames);
    if (!list.ok()) return list.status();
    gaps = list->gaps;
    if (!list->missing.empty() && settings.missing == MissingPolicy::error)
        return Status(StatusCode::input, missing_text(list->missing, settings));
    if (writes && list->frames.size() > 1 && !settings.output.has_token())
        return Status(StatusCode::usage, concat(settings.output.text(), ": one output name for ",
                                                list->frames.size(), " frames; put #### into it"));
    // A frame is held from what is on disk, asked for or not: a part of a sequence must give what
    // the whole gives.
    decltype(list->files) on_disk;
    if (!list->missing.empty() && settings.missing == MissingPolicy::hold)
        if (auto all = io::find_frames(settings.input, std::nullopt); all.ok())
            on_disk = std::move(all->files);
    std::vector<Task> tasks;
    for (int frame : list->frames) {
        Task task;
        task.frame = task.source = frame;
        if (writes) task.output = settings.output.format(frame);
        auto found = list->files.find(frame);
        if (found != list->files.end()) {
            task.files = found->second;
        } else if (!on_disk.empty()) {
            found = on_disk.upper_bound(frame);
            if (found != on_disk.begin()) --found;
            task.source = found->first;
            task.files = found->second;
        }
        for (const auto& [role, path] : task.files) {
            std::error_code error;
            if (writes && fs::equivalent(path, task.output, error))
                return Status(StatusCode::usage,
                              task.output +
                                  ": the output would replace its own input; name "
                                  "another file");
        }
        tasks.push_back(std::move(task));
    }
    if (writes && settings.on_existing == io::OnExisting::fail &&
        settings.on_error == ErrorPolicy::stop)
        if (Status status = check_none_exists(tasks, settings); !status.ok()) return status;
    return tasks;
}

// A file cut off by a few bytes may still have a header whose chunks all begin inside it.
bool whole(io::ExrFile& file) {
    for (size_t part = 0; part < file.parts().size(); ++part)
        if (!file.parts()[part].deep && !file.read_part(int(part)).ok()) return false;
    return true;
}

// Output, sidecar and preview are there, whole and of this very work.
bool same_work_done(const Task& task, const std::string& work, const RunSettings& settings) {
    std::error_code error;
    if (settings.preview && !fs::exists(preview_path(task.output), error)) return false;
    auto existing = io::ExrFile::open(task.output);
    if (!existing.ok()) return false;
    bool same = false;
    for (const auto& part : existing->parts()) {
        const auto found = part.attributes.find("postchain");
        same |= found != part.attributes.end() && found->second == work;
    }
    if (!same || !settings.sidecar) return same && whole(*existing);
    std::ifstream file(task.output + ".json");
    const auto json = nlohmann::json::parse(file, nullptr, false);
    return json.is_object() && json.value("work", nlohmann::json()) == work &&
           json.value("output_bytes", nlohmann::json()) == existing->file_bytes();
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
    RoleSet wanted;
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
            return Status(StatusCode::internal,
                          concat("no thread could be started: ", error.what()));
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
        auto source = read_source_frame(settings_.source, std::move(*header), work_.wanted,
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

std::string frames_text(const std::vector<int>& frames) {
    constexpr size_t kShown = 20;
    std::string list;
    for (size_t i = 0; i < frames.size() && i < kShown; ++i)
        list += (i ? ", " : "") + std::to_string(frames[i]);
    return frames.size() > kShown ? list + ", ..." : list;
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
    const Work work{&chain, &executor, renderer, chain.required() | chain.optional(), {}};
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

}  // namespace postchain::offline
