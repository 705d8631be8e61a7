#include "tools/service/lab/measurement.h"

#include <filesystem>

#include "config/camera_file.h"
#include "config/text_tree.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

// Checks that every path of an experiment is under the roots, with links resolved. Errors (input),
// (output).
Status check_paths(const experiment::ExperimentSettings& settings, const Roots& roots) {
    RETURN_IF_ERROR(check_inputs(settings.run.input, roots));
    if (!settings.truth.empty()) {
        ASSIGN_OR_RETURN(auto truth, io::InputSpec::parse(settings.truth));
        RETURN_IF_ERROR(check_inputs(truth, roots));
    }
    if (!settings.assets.empty()) RETURN_IF_ERROR(check_folder(settings.assets, roots));
    // The camera file beside a generated scene is read to find its truth.
    const std::string beside = settings.run.input.color().folder() + "/camera.json";
    auto camera = load_camera(beside);
    if (camera.ok() && camera->camera.aperture_image &&
        !roots.resolve(camera->camera.aperture_image.file()).ok())
        return Status(StatusCode::input,
                      beside + ": names an aperture image outside the folders of this service");
    return check_folder(settings.folder, roots);
}

int frames_of(const sequence::RunSettings& run) {
    const auto list = io::find_frames(run.input, run.frames);
    return list.ok() ? int(list->frames.size()) : 0;
}

experiment::ProgressCallback MeasurementRun::progress() {
    return [this](const experiment::ExperimentProgress& progress) {
        if (!events_.say(progress.what, progress.done, progress.total)) return;
        context_.remaining(progress.remaining_s);
        context_.between();
    };
}

WorkEnd MeasurementRun::end(const Result<WorkEnd>& worked) const {
    if (worked.ok()) return *worked;
    if (context_.stop) return stopped();
    return worked.status().code() == StatusCode::gl
               ? WorkEnd::of(WorkEnd::How::gl_failed, worked.status().message())
               : WorkEnd::failed(worked.status());
}

std::optional<io::Json> report_of(const std::string& folder, const Job& job) {
    // 300 MB of memory at most. A report of 1000 frames and two chains has 400'000 values.
    constexpr TextLimits kLimits = {
        .bytes = io::kReportLimits.bytes, .depth = 64, .nodes = 1'000'000, .frame_keys = true};
    const std::string path = folder + "/report.json";
    if (!made_after(path, job.created_ms)) return std::nullopt;
    auto json = io::read_json(text_of_file(path), path, kLimits);
    return json.ok() ? std::move(*json) : io::Json();
}

}  // namespace postchain::service
