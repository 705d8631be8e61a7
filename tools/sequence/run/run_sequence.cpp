#include "tools/sequence/run/run_sequence.h"

#include <chrono>
#include <cmath>
#include <filesystem>

#include "tools/sequence/io/atomic_file.h"
#include "tools/sequence/io/preview.h"
#include "tools/sequence/run/fingerprint.h"
#include "tools/sequence/run/plan_warnings.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/run/sidecar.h"
#include "tools/sequence/run/written_window.h"

namespace postchain::sequence {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kFingerprintAttribute = "postchain";

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

class FilterJob final : public FrameJob {
  public:
    FilterJob(const Chain& chain, const RunSettings& settings, Executor& executor,
              const std::string& renderer)
        : chain_(chain), settings_(settings), executor_(executor), renderer_(renderer) {}

    io::Keep keep() const override { return io::Keep::all; }

    RoleSet planes(const FrameHeader& header) const override {
        return planes_needed(chain_, settings_.source, header, settings_.plan);
    }

    Result<bool> begin(const FrameTask& task, const FrameInputs& inputs,
                       FrameReport& report) override {
        if (settings_.on_existing == io::OnExisting::fail)
            if (Status status = check_none_exists({task}, settings_); !status.ok()) return status;
        report.renderer = renderer_;
        report.fingerprint = fingerprint_of(chain_, settings_, inputs);
        const FrameHeader& header = inputs.frame->header;
        if (Status status = io::check_rewritable(header.files.color_file(),
                                                 header.assignment.at(Role::color).part,
                                                 {{kFingerprintAttribute, report.fingerprint}});
            !status.ok())
            return status;
        std::error_code error;
        return settings_.on_existing != io::OnExisting::skip || !fs::exists(task.output, error) ||
               !is_done(task.output, report.fingerprint, settings_);
    }

    Status prepare(const SourceFrame& source, FrameReport& report) override {
        auto plan = plan_source_frame(chain_, source, settings_.plan);
        if (!plan.ok()) return plan.status();
        report.plan = std::move(*plan);
        report.window = written_window(chain_, *report.plan, source);
        for (auto& warning : plan_warnings(chain_, *report.plan, source))
            report.warnings.push_back(std::move(warning));
        return Status();
    }

    Status process(FrameInFlight& frame) override {
        FrameReport& report = frame.report;
        executor_.set_timing(true);
        StageObserver dump;
        if (!settings_.dump_folder.empty())
            dump = [&](const Step&, const PlanTexture& texture, const ImageF& pixels) {
                return dump_stage(report.frame, texture, pixels);
            };
        auto result = executor_.filter(*report.plan, frame.source->planes, dump);
        if (!result.ok()) return result.status().at(report.inputs.at(Role::color));
        frame.result = std::move(result->at(Role::color));
        frame.source->planes.clear();
        report.pass_times = executor_.pass_times();
        report.work_done = executor_.work_done();
        report.timing_source = executor_.timing_source();
        report.counters = executor_.counters();
        return Status();
    }

    Status write(FrameInFlight& frame) override {
        const auto start = Clock::now();
        FrameReport& report = frame.report;
        report.output_nonfinite = count_nonfinite(frame.result);
        if (report.output_nonfinite > 0 && settings_.strict)
            return Status(StatusCode::health,
                          concat(report.output, ": ", report.output_nonfinite,
                                 " non-finite output pixels under --strict; not written"));
        if (frame.source->conversion.unpremultiplied)
            to_file_convention(frame.result, frame.source->conversion,
                               stored_color(frame.source->input));
        io::WriteOptions options;
        options.on_existing = settings_.on_existing == io::OnExisting::fail
                                  ? io::OnExisting::fail
                                  : io::OnExisting::overwrite;
        options.overflow = settings_.overflow;
        options.window = report.window;
        options.attributes[kFingerprintAttribute] = report.fingerprint;
        auto written =
            io::write_filtered(report.output, frame.source->input, frame.result, options);
        if (!written.ok()) return written.status();
        report.write = std::move(*written);
        if (const uint64_t half = report.write.overflow_pixels)
            report.warnings.push_back(
                concat(report.output, ": ", half, " pixels clamped to the largest half, 65504"));
        if (const uint64_t bad = report.write.nonfinite_pixels)
            report.warnings.push_back(concat(report.output, ": ", bad,
                                             " pixels of the result are not finite: Inf clamped to "
                                             "the largest value of its channel, NaN to 0"));
        report.write_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        if (settings_.preview) {
            io::PreviewOptions preview;
            preview.on_existing = options.on_existing;
            if (Status status =
                    io::write_png_preview(io::preview_path(report.output), frame.result, preview);
                !status.ok())
                return status;
        }
        if (!settings_.sidecar) return Status();
        return io::atomic_write_text(report.output + ".json",
                                     sidecar_json(report, settings_.version))
            .status();
    }

  private:
    Status dump_stage(int frame, const PlanTexture& texture, const ImageF& pixels) {
        static const std::vector<std::string> names = {"R", "G", "B", "A"};
        char number[16];
        std::snprintf(number, sizeof(number), ".%04d.exr", frame);
        return io::write_planes_exr(settings_.dump_folder + "/" + texture.name + number, pixels,
                                    {names.begin(), names.begin() + pixels.channels})
            .status();
    }

    const Chain& chain_;
    const RunSettings& settings_;
    Executor& executor_;
    const std::string& renderer_;
};

}  // namespace

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
    FilterJob job(chain, settings, executor, renderer);
    auto summary = walk_sequence(job, settings, std::move(*tasks), observer, stop);
    if (!summary.ok()) return summary;
    summary->gaps = std::move(gaps);
    summary->counters = executor.counters();
    return summary;
}

}  // namespace postchain::sequence
