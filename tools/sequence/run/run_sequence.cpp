#include "tools/sequence/run/run_sequence.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>

#include "chain/layers.h"
#include "tools/sequence/exr/planes_writer.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/preview.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/record/record.h"
#include "tools/sequence/record/sidecar.h"
#include "tools/sequence/run/output_frame.h"
#include "tools/sequence/run/plan_warnings.h"
#include "tools/sequence/run/run_files.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/run/watch_feed.h"
#include "tools/sequence/source/clock.h"
#include "tools/sequence/source/written_window.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProvenanceAttribute = "postchain";

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

// Filtered layers, converted to the file's convention, and ranks. `images` holds their pixels; it
// is a deque so that they stay in place.
std::vector<io::FilteredLayer> layers_to_write(const SourceFrame& source, const FilteredView& view,
                                               std::deque<ImageF>& images) {
    std::vector<io::FilteredLayer> layers;
    const FrameLayers& found = source.layers;
    for (size_t i = 0; i < found.filtered.size() && !view.layers.empty(); ++i) {
        images.push_back(plane_of_stack(view.layers, int(i), view.color.height));
        layer_to_file_convention(images.back(), source.conversion, view.color);
        const RoleChannels& where = found.filtered[i].channels;
        layers.push_back({where.part, where.channels, &images.back(), false});
    }
    if (!found.fill_mask.empty())
        layers.push_back({.part = source.input.assignment.at(Role::color).part,
                          .channels = fill_mask_channels(found.fill_mask),
                          .image = &view.fill_mask,
                          .added = true});
    for (size_t i = 0; i < view.cryptomattes.size(); ++i) {
        for (size_t level = 0; level < found.cryptomattes[i].levels.size(); ++level) {
            const io::CryptoLevel& where = found.cryptomattes[i].levels[level];
            images.push_back(stored_level(view.cryptomattes[i], int(level)));
            layers.push_back(
                {where.part, {where.channels.begin(), where.channels.end()}, &images.back(), true});
        }
    }
    return layers;
}

// The images to write: all but the color of the frame's first view.
std::vector<io::FilteredLayer> all_to_write(FrameInFlight& frame, std::deque<ImageF>& images) {
    std::vector<io::FilteredLayer> all = layers_to_write(*frame.source, frame.filtered, images);
    for (size_t i = 0; i < frame.other_views.size(); ++i) {
        const SourceFrame& source = frame.source->other_views[i];
        FilteredView& view = frame.other_views[i];
        const auto layers = layers_to_write(source, view, images);
        all.insert(all.end(), layers.begin(), layers.end());
        if (source.conversion.unpremultiplied)
            to_file_convention(view.color, source.conversion, stored_color(source.input));
        const RoleChannels& where = source.input.assignment.at(Role::color);
        all.push_back({.part = where.part, .channels = where.channels, .image = &view.color});
    }
    return all;
}

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

    Result<bool> begin(const FrameTask& task, const FrameInputs& inputs,
                       FrameReport& report) override {
        RETURN_IF_ERROR(files_.check_existing(outputs_of(task, settings_)));
        report.renderer = renderer_;
        const std::string fingerprint = fingerprint_of(chain_, settings_, inputs);
        report.provenance = provenance_of(fingerprint, settings_.strict);
        if (settings_.preview)
            report.preview_provenance = preview_provenance_of(fingerprint, settings_);
        const FrameHeader& header = inputs.frame->header;
        RETURN_IF_ERROR(check_output(header, task.output, settings_, write_options(report, "")));
        std::error_code error;
        return settings_.on_existing != io::OnExisting::skip || !fs::exists(task.output, error) ||
               !is_done(task.output, fingerprint, settings_);
    }

    Status prepare(const SourceFrame& source, FrameReport& report) override {
        ASSIGN_OR_RETURN(auto plan, plan_source_frame(chain_, source, settings_.plan));
        report.resolved = resolve_values(chain_, source, plan);
        report.plan = std::move(plan);
        report.window = written_window(chain_, *report.plan, source);
        report.layers = source.layers;
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
                report.warnings.push_back(concat("view ", view.match.view, ": ", warning));
            report.window = report.window.united(written_window(chain_, plan, view));
            if (Status status = filter(plan, view, {}, report, frame.other_views.emplace_back());
                !status.ok())
                return status.at(concat(report.inputs.at(Role::color), ": view ", view.match.view));
        }
        return filter(*report.plan, *frame.source, dump, report, frame.filtered)
            .at(report.inputs.at(Role::color));
    }

    Status write(FrameInFlight& frame) override {
        const auto start = Clock::now();
        FrameReport& report = frame.report;
        report.output_nonfinite =
            count_nonfinite(frame.filtered.color) + count_nonfinite(frame.filtered.layers);
        for (const FilteredView& view : frame.other_views)
            report.output_nonfinite += count_nonfinite(view.color) + count_nonfinite(view.layers);
        if (report.output_nonfinite > 0 && settings_.strict)
            return Status(StatusCode::health,
                          concat(report.output, ": ", report.output_nonfinite,
                                 " non-finite output pixels under --strict; not written"));
        std::deque<ImageF> images;
        const auto layers = all_to_write(frame, images);
        io::WriteOptions options = write_options(report, record_text(chain_, settings_, report));
        // Image, preview and sidecar are replaced together. The old sidecar is set aside first, so
        // that no image is beside another's, even if this process is killed before it writes its
        // own.
        std::optional<io::ReplaceLock> lock;
        options.before_commit = [&]() -> Status {
            RETURN_IF_ERROR(io::check_unchanged(report.stamps));
            ASSIGN_OR_RETURN(auto taken, io::ReplaceLock::take(report.output));
            lock.emplace(std::move(taken));
            if (const std::string sidecar = sidecar_path(report.output);
                settings_.on_existing != io::OnExisting::fail && is_sidecar(sidecar))
                return lock->set_aside(sidecar);
            return Status();
        };
        ASSIGN_OR_RETURN(report.write,
                         write_output(report.output, *frame.source, frame.filtered.color, layers,
                                      settings_, files_, std::move(options)));
        if (const uint64_t clamped = report.write.overflow_pixels)
            report.warnings.push_back(concat(report.output, ": ", clamped, " pixels clamped to ",
                                             largest_text(report.output)));
        if (const uint64_t bad = report.write.nonfinite_pixels)
            report.warnings.push_back(concat(report.output, ": ", bad,
                                             " result pixels are non-finite: Inf clamped to "
                                             "the channel's largest value, NaN to 0"));
        report.write_ms = milliseconds_since(start);
        if (settings_.preview) RETURN_IF_ERROR(write_preview(report, frame.filtered.color));
        return settings_.sidecar ? write_sidecar(report) : Status();
    }

  private:
    // Frees the planes of `source`. Says in the report what ran.
    Status filter(const Plan& plan, SourceFrame& source, const StageObserver& dump,
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

    io::WriteOptions write_options(const FrameReport& report, const std::string& record) const {
        io::WriteOptions options;
        options.overflow = overflow_of(report.output, settings_);
        options.exr = settings_.exr;
        options.window = report.window;
        options.attributes[kProvenanceAttribute] = report.provenance;
        options.attributes[kRecordAttribute] = record;
        return options;
    }

    Status write_preview(const FrameReport& report, const ImageF& color) const {
        const std::string path = io::preview_path(report.output);
        ASSIGN_OR_RETURN(const auto permit, files_.permit(path));
        io::PreviewOptions options;
        options.on_existing = permit;
        options.view = settings_.view;
        options.provenance = report.preview_provenance;
        return io::write_png_preview(path, color, options);
    }

    Status write_sidecar(const FrameReport& report) const {
        const std::string path = sidecar_path(report.output);
        ASSIGN_OR_RETURN(const auto permit, files_.permit(path));
        return io::atomic_write_text(path, sidecar_json(report, settings_.version), permit)
            .status();
    }

    Status dump_stage(const PlanTexture& texture, const ImageF& pixels, FrameReport& report) const {
        static const std::vector<std::string> names = {"R", "G", "B", "A"};
        const std::string path = stage_path(settings_.dump_folder, texture.name, report.frame);
        ASSIGN_OR_RETURN(const auto permit, files_.permit(path));
        const auto written = io::write_planes_exr(
            path, pixels, {names.begin(), names.begin() + pixels.channels}, permit);
        if (written.ok()) report.stage_bytes += written->bytes;
        return written.status();
    }

    const Chain& chain_;
    const RunSettings& settings_;
    const io::OutputFiles& files_;
    Executor& executor_;
    const std::string& renderer_;
};

Status have_folder(const RunSettings& settings) {
    const std::string folder = settings.output.folder();
    std::error_code error;
    if (fs::is_directory(folder, error)) return Status();
    if (fs::exists(folder, error)) return Status(StatusCode::output, folder + ": is not a folder");
    if (!settings.make_folder)
        return Status(StatusCode::output,
                      folder + ": folder does not exist; create it or use --mkdir");
    fs::create_directories(folder, error);
    if (!error) return Status();
    return Status(StatusCode::output, folder + ": cannot be created: " + error.message());
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

Result<RunSummary> run_sequence(const Chain& chain, const RunSettings& asked, Executor& executor,
                                const std::string& renderer, const FrameObserver& observer,
                                const std::atomic<bool>* stop, const FrameStart& start,
                                const WaitObserver& waits, const StepObserver& steps) {
    RunSettings settings = settings_for(asked, {&chain});
    settings.source.all_views = true;
    std::vector<int> gaps;
    ASSIGN_OR_RETURN(auto tasks, plan_tasks(settings, true, gaps));
    const io::OutputFiles files = files_of_run(chain, settings, tasks);
    RETURN_IF_ERROR(files.check_names());
    // With ErrorPolicy::keep_going each frame is refused separately.
    if (settings.on_error == ErrorPolicy::stop) RETURN_IF_ERROR(files.check_existing());
    std::error_code error;
    RETURN_IF_ERROR(have_folder(settings));
    files.remove_left_temporaries();
    if (!settings.dump_folder.empty()) {
        fs::create_directories(settings.dump_folder, error);
        if (error || !fs::is_directory(settings.dump_folder))
            return Status(StatusCode::output,
                          settings.dump_folder +
                              ": folder of --dump-stages cannot be created: " + error.message());
    }
    RETURN_IF_ERROR(check_images(settings));
    const StopScope within_a_frame(executor, stop);
    FilterJob job(chain, settings, files, executor, renderer);
    std::unique_ptr<FrameFeed> feed;
    if (settings.watch)
        feed = std::make_unique<WatchFeed>(std::move(tasks), settings);
    else
        feed = std::make_unique<ListFeed>(std::move(tasks), settings);
    auto summary = walk_sequence(job, settings, *feed, observer, stop, start, waits, steps);
    if (!summary.ok()) return summary;
    if (frames_are_unknown(settings) && summary->total == 0 && !(stop && *stop))
        return Status(
            StatusCode::input,
            concat(settings.input.color().text(), ": ", io::why_none(settings.input.color()),
                   ", and nothing changed for ", text_of(*settings.watch->idle_s), " s (--idle)"));
    summary->gaps = std::move(gaps);
    summary->counters = executor.counters();
    return summary;
}

}  // namespace postchain::sequence
