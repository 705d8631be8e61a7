#include "tools/sequence/run/runner.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <semaphore>
#include <system_error>
#include <thread>

#include "tools/sequence/run/channel.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/neighbor_planes.h"

namespace postchain::sequence {
namespace {

constexpr auto kBetweenReports = std::chrono::milliseconds(250);

// Exceptions must not leave a stage's thread; most are a library's out of memory.
template <class Stage>
Status guarded(const std::string& place, const Stage& stage) {
    try {
        return stage();
    } catch (...) {
        return status_of_exception(place);
    }
}

// A view of the frame other than its first.
struct OpenedView {
    std::string name;
    SequenceReader* reader;
    FrameToRead opened;
};

class Runner {
  public:
    Runner(FrameJob& job, const RunSettings& settings, FrameFeed& feed,
           const RunCallbacks& callbacks)
        : job_(job),
          settings_(settings),
          feed_(feed),
          callbacks_(callbacks),
          reader_(
              settings.source, settings.input,
              [&job](const FrameHeader& header) { return job.planes(header); },
              [this](int frame) { return job_.keep() == io::Keep::all && feed_.has(frame); }),
          gate_(settings.source.max_memory) {
        reader_.try_files(callbacks.try_file);
    }

    Result<RunSummary> run() {
        start_ = Clock::now();
        std::thread reader, writer;
        try {
            writer = std::thread([this] { write_all(); });
            reader = std::thread([this] { read_all(); });
        } catch (const std::system_error& error) {
            to_write_.close();
            if (writer.joinable()) writer.join();
            return Status(StatusCode::internal,
                          concat("cannot start a thread (too little memory, or too many threads): ",
                                 error.what()));
        }
        while (!to_process_.is_over()) {
            auto next = to_process_.pop_for(kBetweenReports);
            report_finished();
            report_waiting();
            if (!next) continue;
            if (next->source && !given_up(next->index))
                finish_stage(*next, FrameStep::filter, [&] { return process(*next); });
            if (!to_write_.push(std::move(*next))) break;
        }
        to_write_.close();
        reader.join();
        writer.join();
        report_finished();
        summary_.total = feed_.total();
        summary_.elapsed_s = milliseconds_since(start_) * 1e-3;
        summary_.frames_in_flight = in_flight_peak_;
        summary_.frames_decoded = reader_.decoded();
        if (!failed_feed_.ok()) return failed_feed_;
        return summary_;
    }

  private:
    // After a failure under ErrorPolicy::stop the frames before it are finished, so that the
    // outputs do not depend on how far ahead the reader was.
    bool given_up(size_t index) const {
        return index > first_failed_ || (callbacks_.stop && *callbacks_.stop);
    }

    // ------------------------------------------------------------------- reader thread
    void read_all() {
        for (size_t index = 0;; ++index) {
            free_places_.acquire();
            std::optional<FrameFeed::Fed> fed;
            const auto is_over = [&] { return given_up(index); };
            const Status status = guarded("the frames on disk", [&] {
                if (!is_over()) fed = feed_.next(reader_, is_over);
                return Status();
            });
            if (!fed || given_up(index)) {
                if (!status.ok()) failed_feed_ = status;
                free_places_.release();
                break;
            }
            const FrameTask& task = fed->task;
            const int alive = ++in_flight_;
            in_flight_peak_ = std::max(in_flight_peak_.load(), alive);
            FrameInFlight next;
            next.index = index;
            next.report.frame = task.frame;
            next.report.output = task.output;
            next.report.inputs = task.files;
            finish_stage(next, FrameStep::read, [&] { return read(*fed, next); });
            if (!to_process_.push(std::move(next))) break;
        }
        to_process_.close();
    }

    Status read(const FrameFeed::Fed& fed, FrameInFlight& next) {
        const FrameTask& task = fed.task;
        FrameReport& report = next.report;
        if (callbacks_.start) RETURN_IF_ERROR(callbacks_.start(task));
        if (!fed.missing.ok()) {
            report.outcome = Outcome::missing;
            report.status = fed.missing;
            return Status();
        }
        ASSIGN_OR_RETURN(auto opened, reader_.open(task.source, task.files));
        report.profile = opened.frame->match.profile;
        report.stamps = opened.stamps();
        ASSIGN_OR_RETURN(const auto begun, job_.begin(task, opened, report));
        if (!begun) {
            report.outcome = Outcome::skipped;
            return Status();
        }
        ASSIGN_OR_RETURN(auto views, open_views(task, opened));
        RETURN_IF_ERROR(wait_for_memory(opened, views, next));
        ASSIGN_OR_RETURN(auto source, read_views(opened, views));
        note_read(opened, source, report);
        if (settings_.strict && !source.strict_fault.ok()) return source.strict_fault;
        RETURN_IF_ERROR(job_.prepare(source, report));
        report.outcome = task.source == task.frame ? Outcome::written : Outcome::held;
        report.held_from = task.source;
        next.source = std::move(source);
        return Status();
    }

    static void note_read(const FrameToRead& opened, const SourceFrame& source,
                          FrameReport& report) {
        for (const auto& [neighbor, other] : opened.neighbors)
            for (const auto& [role, file] : other->files.stamps)
                if (!source.description.missing_neighbors.count(neighbor))
                    report.inputs[role_of(neighbor, role)] = file.path;
        report.warnings = source.warnings;
        report.findings = source.findings;
        if (source.other_views.empty()) return;
        report.views.push_back(source.header.match.view);
        for (const SourceFrame& view : source.other_views)
            report.views.push_back(view.header.match.view);
    }

    // ProfileMatch::other_views, each read as a sequence of its own.
    Result<std::vector<OpenedView>> open_views(const FrameTask& task, const FrameToRead& first) {
        std::vector<OpenedView> views;
        const FrameHeader& header = *first.frame;
        for (const std::string& name : header.match.other_views) {
            SourceSettings settings = settings_.source;
            settings.view = name;
            SequenceReader& reader =
                view_readers_
                    .try_emplace(
                        name, settings, settings_.input,
                        [this](const FrameHeader& of) { return job_.planes(of); },
                        [this](int frame) { return feed_.has(frame); })
                    .first->second;
            reader.try_files(callbacks_.try_file);
            ASSIGN_OR_RETURN(auto opened, reader.open(task.source, task.files).at("view " + name));
            const io::Window &its = color_part(*opened.frame).data_window,
                             &own = color_part(header).data_window;
            if (its != own)
                return Status(
                    StatusCode::input,
                    concat(task.files.at(Role::color), ": view ", name, " has the data window ",
                           its.text(), ", view ", header.match.view, " ", own.text(),
                           "; filter one after the other (", setting("view", name), ")"));
            views.push_back({name, &reader, std::move(opened)});
        }
        return views;
    }

    // Reads the frame, and its other views into SourceFrame::other_views.
    Result<SourceFrame> read_views(const FrameToRead& opened,
                                   const std::vector<OpenedView>& views) {
        ASSIGN_OR_RETURN(auto source, reader_.read(opened));
        for (const OpenedView& view : views) {
            ASSIGN_OR_RETURN(auto other, view.reader->read(view.opened));
            if (source.strict_fault.ok()) source.strict_fault = other.strict_fault;
            for (std::string& warning : other.warnings)
                source.warnings.push_back(concat("view ", view.name, ": ", warning));
            source.other_views.push_back(std::move(other));
        }
        return source;
    }

    // Waits until the frame fits beside those in flight; it leaves the gate when it is written.
    Status wait_for_memory(const FrameToRead& opened, const std::vector<OpenedView>& views,
                           FrameInFlight& next) {
        uint64_t bytes = bytes_of(opened);
        for (const OpenedView& view : views) bytes += bytes_of(view.opened);
        RETURN_IF_ERROR(
            check_memory(color_path(*opened.frame), bytes, settings_.source.max_memory));
        const int frame = next.report.frame;
        step(FrameStep::read, frame, false);
        gate_.enter(bytes);
        step(FrameStep::read, frame, true);
        next.bytes = bytes;
        return Status();
    }

    // Memory of the frame in flight and of the neighbors kept for it, which may later be filtered
    // and written too.
    uint64_t bytes_of(const FrameToRead& opened) const {
        const auto bytes_of = [&](const FrameHeader& frame) {
            return frame_bytes(frame, frame.to_read, job_.keep(), frame.window.height());
        };
        uint64_t bytes = bytes_of(*opened.frame);
        for (const auto& [neighbor, other] : opened.neighbors) bytes += bytes_of(*other);
        if (opened.behind) bytes += behind_bytes(*opened.behind);
        return bytes;
    }

    // ------------------------------------------------------------------- caller's thread
    Status process(FrameInFlight& frame) {
        const auto start = Clock::now();
        const Status status = job_.process(frame, [this] {
            const FrameInFlight* next = to_process_.front();
            return next && next->source ? next : nullptr;
        });
        frame.report.filter_ms = milliseconds_since(start);
        return status;
    }

    // ------------------------------------------------------------------- writer thread
    void write_all() {
        while (auto next = to_write_.pop()) {
            FrameReport& report = next->report;
            if (next->source && !given_up(next->index)) {
                report.frames_in_flight = in_flight_peak_;
                finish_stage(*next, FrameStep::write, [&] { return job_.write(*next); });
            } else if (next->source) {
                report.status = Status(StatusCode::canceled, "stopped before it was written");
                report.outcome = Outcome::failed;
            }
            FrameReport finished = std::move(report);
            const uint64_t bytes = next->bytes;
            next.reset();
            gate_.leave(bytes);
            --in_flight_;
            free_places_.release();
            finished_.push(std::move(finished));
        }
        finished_.close();
    }

    // --------------------------------------------------------------------- any thread
    void step(FrameStep step, int frame, bool begins) const {
        if (callbacks_.steps) callbacks_.steps(step, frame, begins);
    }

    template <class Stage>
    void finish_stage(FrameInFlight& at, FrameStep of, const Stage& stage) {
        FrameReport& report = at.report;
        const auto color = report.inputs.find(Role::color);
        step(of, report.frame, true);
        const Status status =
            guarded(color == report.inputs.end() ? report.output : color->second, stage);
        step(of, report.frame, false);
        if (status.ok()) return;
        report.outcome = Outcome::failed;
        report.status = status;
        at.source.reset();
        if (settings_.on_error == ErrorPolicy::keep_going) return;
        size_t first = first_failed_;
        while (at.index < first && !first_failed_.compare_exchange_weak(first, at.index)) {
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
                    // Giving up a frame because of a stop is not a failure.
                    if (report->status.code() == StatusCode::canceled) continue;
                    ++summary_.failed;
                    break;
            }
            if (!report->status.ok() && summary_.first_failure.ok())
                summary_.first_failure = report->status;
            if (report->status.code() == StatusCode::health) summary_.unhealthy = true;
            ++done_;
            RunProgress progress = progress_so_far();
            progress.remaining_s =
                progress.elapsed_s / double(done_) * double(progress.total - done_);
            if (!callbacks_.finished) continue;
            const Status status = guarded(concat("frame ", report->frame), [&] {
                callbacks_.finished(*report, progress);
                return Status();
            });
            if (!status.ok() && summary_.first_failure.ok()) {
                ++summary_.failed;
                summary_.first_failure = status;
                first_failed_ = 0;
            }
        }
    }

    RunProgress progress_so_far() const {
        return {done_, feed_.total(), milliseconds_since(start_) * 1e-3, 0};
    }

    void report_waiting() {
        if (!callbacks_.waits) return;
        if (const std::string text = feed_.waits_for(); !text.empty())
            callbacks_.waits(text, progress_so_far());
    }

    FrameJob& job_;
    const RunSettings& settings_;
    FrameFeed& feed_;
    const RunCallbacks& callbacks_;
    SequenceReader reader_;                               // used by the reader thread
    std::map<std::string, SequenceReader> view_readers_;  // readers of the other views
    MemoryGate gate_;

    Channel<FrameInFlight> to_process_{1};
    Channel<FrameInFlight> to_write_{1};
    Channel<FrameReport> finished_{std::numeric_limits<size_t>::max()};
    std::counting_semaphore<kFramesInFlight> free_places_{kFramesInFlight};
    static constexpr size_t kNone = std::numeric_limits<size_t>::max();
    std::atomic<size_t> first_failed_ = kNone;  // task index; kNone = continue
    std::atomic<int> in_flight_ = 0;
    std::atomic<int> in_flight_peak_ = 0;
    Clock::time_point start_;
    size_t done_ = 0;
    Status failed_feed_;  // written by the reader thread; read after it has ended
    RunSummary summary_;
};

class VisitJob final : public FrameJob {
  public:
    VisitJob(RoleSet wanted, const FrameVisitor& visitor) : wanted_(wanted), visitor_(visitor) {}

    io::Keep keep() const override { return io::Keep::nothing; }
    RoleSet planes(const FrameHeader&) const override { return wanted_; }
    Result<bool> begin(const FrameTask&, const FrameToRead&, FrameReport&) override { return true; }
    Status prepare(const SourceFrame&, FrameReport&) override { return Status(); }
    Status process(FrameInFlight& frame, const Upcoming&) override {
        return visitor_(*frame.source, frame.report);
    }
    Status write(FrameInFlight&) override { return Status(); }

  private:
    RoleSet wanted_;
    const FrameVisitor& visitor_;
};

}  // namespace

Result<RunSummary> walk_sequence(FrameJob& job, const RunSettings& settings, FrameFeed& feed,
                                 const RunCallbacks& callbacks) {
    return Runner(job, settings, feed, callbacks).run();
}

Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop) {
    std::vector<int> gaps;
    ASSIGN_OR_RETURN(auto tasks, plan_tasks(settings, false, gaps));
    ListFeed feed(std::move(tasks), settings);
    VisitJob job(wanted, visitor);
    auto summary = walk_sequence(job, settings, feed, {observer, stop});
    if (summary.ok()) summary->gaps = std::move(gaps);
    return summary;
}

}  // namespace postchain::sequence
