#include "tools/sequence/run/run_sequence.h"

#include <algorithm>
#include <filesystem>

#include "chain/base/stop.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/run/output_frame.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;

class FilterJob final : public FrameJob {
  public:
    FilterJob(const Chain& chain, const RunSettings& settings, const io::OutputFiles& files,
              Executor& executor, const std::string& renderer)
        : chain_(chain),
          settings_(settings),
          files_(files),
          executor_(executor),
          renderer_(renderer) {}

    ~FilterJob() override { executor_.forget_expected(); }

    io::Keep keep() const override { return io::Keep::all; }

    RoleSet planes(const FrameHeader& header) const override {
        return planes_needed(chain_, settings_.source, header, settings_.plan);
    }

    Result<bool> begin(const FrameTask& task, const FrameToRead& opened,
                       FrameReport& report) override {
        RETURN_IF_ERROR(files_.check_existing(outputs_of(task, settings_)));
        report.renderer = renderer_;
        const std::string fingerprint = fingerprint_of(chain_, settings_, opened);
        report.provenance = provenance_of(fingerprint, settings_.strict);
        if (settings_.preview)
            report.preview_provenance = preview_provenance_of(fingerprint, settings_);
        RETURN_IF_ERROR(check_output(*opened.frame, report, settings_));
        std::error_code error;
        const bool keeps = settings_.on_existing == io::OnExisting::skip ||
                           settings_.on_existing == io::OnExisting::resume;
        if (!keeps || !fs::exists(task.output, error)) return true;
        if (is_done(task.output, fingerprint, settings_)) return false;
        // A run that died may have left the image without its sidecar and preview.
        RunSettings image_alone = settings_;
        image_alone.sidecar = image_alone.preview = false;
        if (settings_.on_existing == io::OnExisting::resume &&
            !is_done(task.output, fingerprint, image_alone))
            return Status(StatusCode::output,
                          task.output +
                              ": exists, and this run would make another; name another "
                              "output, or use {on_existing=overwrite}"_keyed);
        return true;
    }

    Status prepare(const SourceFrame& source, FrameReport& report) override {
        ASSIGN_OR_RETURN(auto plan, plan_source_frame(chain_, source, settings_.plan));
        report.resolved = resolve_values(chain_, source, plan);
        report.plan = std::move(plan);
        report.window = written_window(chain_, *report.plan, source);
        for (auto& warning : plan_warnings(chain_, *report.plan, source))
            report.warnings.push_back(std::move(warning));
        return Status();
    }

    Status process(FrameInFlight& frame, const Upcoming& upcoming) override {
        FrameReport& report = frame.report;
        const ExpectScope expects(executor_, [&]() -> NextRun {
            const FrameInFlight* next = upcoming();
            if (!next || !next->source->other_views.empty()) return {};
            return {&*next->report.plan, &next->source->planes};
        });
        executor_.set_timing(true);
        StageObserver dump;
        if (!settings_.dump_folder.empty())
            dump = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                return dump_stage(texture, pixels, report);
            };
        // The first view last: what the report says of the run is its.
        for (SourceFrame& view : frame.source->other_views) {
            ASSIGN_OR_RETURN(auto plan, plan_source_frame(chain_, view, settings_.plan));
            for (const std::string& warning : plan_warnings(chain_, plan, view))
                report.warnings.push_back(concat("view ", view.header.match.view, ": ", warning));
            report.window = report.window.united(written_window(chain_, plan, view));
            if (Status status = filter(plan, view, {}, report, frame.other_views.emplace_back());
                !status.ok())
                return status.at(
                    concat(report.inputs.at(Role::color), ": view ", view.header.match.view));
        }
        return filter(*report.plan, *frame.source, dump, report, frame.filtered)
            .at(report.inputs.at(Role::color));
    }

    Status write(FrameInFlight& frame) override {
        return write_frame(chain_, settings_, files_, frame);
    }

  private:
    // Frees the planes of `source`. Says in the report what ran.
    Status filter(const FramePlan& plan, SourceFrame& source, const StageObserver& dump,
                  FrameReport& report, FilteredView& view) {
        auto filtered = filter_view(chain_, plan, source, settings_.plan, executor_, dump, [&] {
            report.pass_times = executor_.pass_times();
            report.work_done = executor_.work_done();
            report.timing_source = executor_.timing_source();
            report.counters = executor_.counters();
        });
        if (!filtered.ok()) return filtered.status();
        view = std::move(*filtered);
        for (auto& line : lost_coverage(view.reports, report.inputs.at(Role::color)))
            report.warnings.push_back(std::move(line));
        for (auto& one : view.reports) report.cryptomattes.push_back(std::move(one));
        source.planes.clear();
        return Status();
    }

    Status dump_stage(const PlanTexture& texture, const ImageF& pixels, FrameReport& report) const {
        static const std::vector<std::string> names = {"R", "G", "B", "A"};
        const std::string path = stage_path(settings_.dump_folder, texture.name, report.frame);
        ASSIGN_OR_RETURN(const auto permit, files_.permit(path));
        const auto written = io::write_planes_exr(
            path, pixels, {names.begin(), names.begin() + pixels.channels}, permit);
        if (written.ok()) report.written_bytes += written->bytes;
        return written.status();
    }

    const Chain& chain_;
    const RunSettings& settings_;
    const io::OutputFiles& files_;
    Executor& executor_;
    const std::string& renderer_;
};

Status check_folder(const RunSettings& settings) {
    const std::string folder = settings.output.folder();
    std::error_code error;
    if (fs::is_directory(folder, error)) return Status();
    if (fs::exists(folder, error))
        return Status(StatusCode::output, folder + ": is not a folder; choose another name");
    if (!settings.make_folder)
        return Status(StatusCode::output,
                      folder + ": folder does not exist; create it or use {mkdir=true}"_keyed);
    return Status();
}

// Finds an unusable configuration before any frame is filtered.
Status check_images(const RunSettings& settings) {
    const auto& stored = settings.picture.transfer;
    if (!settings.view && !(stored && !io::config_of(*stored).empty())) return Status();
    ASSIGN_OR_RETURN(const auto module, io::image_module(StatusCode::output));
    ImageF pixel(1, 1, 3);
    const auto show = [&](const io::DisplayView& view) { return module->to_view(pixel, view); };
    if (settings.view) RETURN_IF_ERROR(show(*settings.view));
    if (!stored) return Status();
    if (const auto* view = std::get_if<io::DisplayView>(&*stored)) return show(*view);
    if (const auto* space = std::get_if<io::OcioSpace>(&*stored))
        return module->to_space(pixel, *space);
    return Status();
}

}  // namespace

RunCheck check_run(const Chain& chain, const RunSettings& asked) {
    RunCheck found;
    const auto take = [&](const char* key, const Status& status) {
        if (!status.ok()) found.faults.emplace_back(key, status);
        return status.ok();
    };
    const RunSettings settings = settings_for(asked, {&chain});
    std::vector<int> gaps;
    auto tasks = plan_tasks(settings, true, gaps);
    if (!tasks.ok()) {
        const bool of_output = plan_tasks(settings, false, gaps).ok();
        take(of_output ? "output" : settings.frames ? "frames" : "input", tasks.status());
        return found;
    }
    found.tasks = std::move(*tasks);
    const io::OutputFiles files = files_of_run(chain, settings, found.tasks);
    if (take("output", files.check_names())) {
        if (settings.on_error == ErrorPolicy::stop) {
            take("on_existing", files.check_existing());
        } else {
            for (const FrameTask& task : found.tasks)
                if (const Status status = files.check_existing(outputs_of(task, settings));
                    !status.ok() && !task.files.empty())
                    found.refused[task.frame] = status.message();
        }
    }
    take("output", check_folder(settings));
    take("ocio", check_images(settings));
    return found;
}

Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& asked, Executor& executor,
                                const std::string& renderer, const RunCallbacks& callbacks) {
    RunSettings settings = settings_for(asked, {&chain});
    settings.source.all_views = true;
    settings.plan.device = executor.device_class();
    std::vector<int> gaps;
    ASSIGN_OR_RETURN(auto tasks, plan_tasks(settings, true, gaps));
    const StopFlag within_the_files(callbacks.stop);
    const io::OutputFiles files = files_of_run(chain, settings, tasks);
    Status checked = files.check_names();
    // With ErrorPolicy::keep_going each frame is refused separately.
    if (checked.ok() && settings.on_error == ErrorPolicy::stop) checked = files.check_existing();
    if (is_stopped()) return RunSummary{.total = tasks.size()};
    RETURN_IF_ERROR(checked);
    RETURN_IF_ERROR(check_folder(settings));
    RETURN_IF_ERROR(io::make_folder(settings.output.folder()));
    files.remove_left_temporaries();
    if (!settings.dump_folder.empty())
        if (Status s = io::make_folder(settings.dump_folder); !s.ok())
            return s.at("{dump_stages}"_keyed);
    RETURN_IF_ERROR(check_images(settings));
    const StopScope within_a_frame(executor, callbacks.stop);
    FilterJob job(chain, settings, files, executor, renderer);
    std::unique_ptr<FrameFeed> feed;
    if (settings.watch)
        feed = std::make_unique<WatchFeed>(std::move(tasks), settings);
    else
        feed = std::make_unique<ListFeed>(std::move(tasks), settings);
    auto summary = walk_sequence(job, settings, *feed, callbacks);
    if (!summary.ok()) return summary;
    if (frames_are_unknown(settings) && summary->total == 0 && !(callbacks.stop && *callbacks.stop))
        return Status(StatusCode::input,
                      concat(settings.input.color().text(), ": ",
                             io::why_none(settings.input.color()), ", and nothing changed for ",
                             text_of(*settings.watch->idle_s), " s ({idle})"_keyed));
    summary->gaps = std::move(gaps);
    summary->counters = executor.counters();
    return summary;
}

}  // namespace postchain::sequence
