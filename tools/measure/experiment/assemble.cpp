#include "tools/measure/experiment/assemble.h"

#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/truth.h"
#include "tools/measure/report/page/page.h"
#include "tools/measure/report/report_csv.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/report_text.h"
#include "tools/sequence/record/frame_report.h"

namespace postchain::experiment {

Status find_truth(BenchSettings& settings, const io::OutputFiles& files,
                  const egl::ContextOptions& context,
                  const std::function<bool(const std::string&)>& progress) {
    if (!settings.truth.empty()) return Status();
    ASSIGN_OR_RETURN(auto survey, survey_input(settings.run, settings.flip.tone_mapper, false));
    const SceneOfInput scene = find_scene(settings.run, survey);
    if (!scene.request) {
        settings.no_truth = scene.why_not;
        return Status();
    }
    auto pattern =
        generate_truth(*scene.request, settings.folder + "/truth", settings.truth_samples, files,
                       context, [&](int frame, double share) {
                           return progress(concat("truth of ", scene.request->name, ", frame ",
                                                  frame, ", ", int(100 * share), " %"));
                       });
    if (!pattern.ok()) return pattern.status();
    ASSIGN_OR_RETURN(const auto model, scenes::model_for(*scene.request));
    for (int frame : scene.request->frames)
        settings.truth_cameras[frame] = scenes::camera_at(model, frame);
    settings.truth = *pattern;
    settings.truth_is = concat("generated: ", scene.request->name, ", ", settings.truth_samples,
                               " samples per pixel");
    return Status();
}

std::string page_path(const report::Report& report) {
    return report.folder + "/index.html";
}

Status write_report_files(const report::Report& report, const std::string& assets) {
    Status status = report::write_report_json(report);
    if (status.ok()) status = report::write_report_csv(report);
    if (status.ok()) status = report::write_report_markdown(report);
    if (status.ok()) status = report::write_page(report, page_path(report), {assets});
    return status;
}

int exit_code_of(const report::Report& report, const std::vector<report::MetricLimit>& limits,
                 bool met, std::vector<std::string>& broken) {
    broken = report::exceeding(report, limits);
    if (!broken.empty()) return sequence::kExitThreshold;
    for (const auto& variant : report.variants)
        if (!variant.failure.empty()) return sequence::kExitSomeFailed;
    return met ? sequence::kExitOk : sequence::kExitThreshold;
}

Result<std::vector<report::MetricLimit>> limits_of(const std::string& option,
                                                   const std::vector<std::string>& texts,
                                                   report::Kind kind, bool with_truth) {
    std::vector<report::MetricLimit> limits;
    for (const auto& text : texts) {
        ASSIGN_OR_RETURN(auto limit,
                         report::parse_limit(option, text, metric_columns(kind, with_truth)));
        limits.push_back(std::move(limit));
    }
    return limits;
}

}  // namespace postchain::experiment
