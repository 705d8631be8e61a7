#include "tools/measure/study/task.h"

#include <filesystem>
#include <set>

#include "tools/measure/experiment/assemble.h"
#include "tools/measure/experiment/bench.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/report/json_parts.h"
#include "tools/measure/study/revision.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/files/json.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;
using io::Json;

void add_stamp(std::vector<std::string>& lines, const std::string& what, const std::string& path) {
    const auto stamp = io::FileStamp::of(path);
    lines.push_back(concat(what, " ", fs::path(path).filename().string(), ": ", stamp.bytes,
                           " bytes, changed ", stamp.time));
}

// The requested frames and, because chains may read neighbors, those beside them.
void add_frames(std::vector<std::string>& lines, const Scene& scene) {
    const auto& run = scene.measured.run;
    const auto list = io::find_frames(run.input, run.frames);
    if (!list.ok()) {
        lines.push_back("no frames");
        return;
    }
    std::set<int> near;
    for (const int frame : list->frames) near.insert({frame - 1, frame, frame + 1});
    for (const auto& [role, pattern] : run.input.patterns)
        for (const auto& [frame, path] : pattern.discover())
            if (near.contains(frame) || !pattern.has_token()) add_stamp(lines, "frame", path);
    if (scene.measured.truth.empty()) return;
    const auto truth = io::PathPattern::parse(scene.measured.truth);
    if (!truth.ok()) return;
    std::error_code error;
    for (const int frame : list->frames)
        if (const std::string path = truth->format(frame); fs::exists(path, error))
            add_stamp(lines, "truth", path);
}

void take(const report::Report& report, TaskResult& result) {
    result.truth = report.truth.value_or("");
    result.frames = report.frames;
    result.width = report.width;
    result.height = report.height;
    for (const auto& variant : report.variants) {
        if (!variant.failure.empty()) {
            result.failure = variant.name + ": " + variant.failure;
            result.variants.clear();
            return;
        }
        TaskResult::Figures figures{variant.name, {}, std::nullopt};
        if (variant.timing) figures.time_ms = variant.timing->total.median_ms;
        for (const auto& [metric, series] : variant.metrics) {
            // Ground truth may exist for some of the frames only.
            figures.metrics[metric] = series.frames;
        }
        result.variants.push_back(std::move(figures));
    }
}

bool ends_the_study(const Status& status) {
    return status.code() == StatusCode::output || status.code() == StatusCode::gl ||
           status.code() == StatusCode::canceled || status.code() == StatusCode::internal;
}

Result<report::Report> measured_ab(const Study& study, const Task& task,
                                   const experiment::ExperimentSettings& settings,
                                   const Machine& machine,
                                   const experiment::ProgressCallback& progress,
                                   const std::atomic<bool>* stop) {
    const auto& [a, b] = study.pairs[*task.pair];
    return experiment::run_ab(study.chains[a], study.chains[b], settings, machine.executor,
                              progress, stop);
}

Result<report::Report> measured_bench(const Study& study, experiment::BenchSettings& settings,
                                      const Machine& machine,
                                      const experiment::ProgressCallback& progress,
                                      const std::atomic<bool>* stop) {
    ASSIGN_OR_RETURN(const auto files, experiment::prepare_folder(settings));
    const Status found =
        experiment::find_truth(settings, files, machine.options, [&](const std::string& what) {
            if (progress) progress({what, 0, 0, 0, 0});
            return !(stop && *stop);
        });
    RETURN_IF_ERROR(machine.make_current());
    if (stop && *stop) return Status(StatusCode::canceled, "stopped");
    if (!found.ok()) return found;
    if (settings.truth.empty())
        return Status(StatusCode::input, "has no ground truth: " + settings.no_truth);
    return experiment::run_bench(study.variants, settings, files, machine.executor, progress, stop);
}

}  // namespace

std::vector<std::string> made_from(const Study& study, const Task& task) {
    const Scene& scene = study.scenes[task.scene];
    std::vector<std::string> lines = {"postchain " + scene.measured.run.version,
                                      std::string("kind ") + report::name_of(study.kind)};
    const auto add_chain = [&](const std::string& name, const Chain& chain) {
        lines.push_back("chain " + name + ": " + chain.text());
    };
    if (task.pair) {
        const auto& [a, b] = study.pairs[*task.pair];
        for (const size_t index : {a, b})
            add_chain(study.chains[index].name, study.chains[index].chain);
    } else {
        for (const auto& variant : study.variants) add_chain(variant.name, variant.chain);
    }
    lines.push_back("settings " + scene.settings);
    for (const auto& file : scene.measured.run.other_inputs) add_stamp(lines, file.what, file.path);
    add_frames(lines, scene);
    return lines;
}

std::string result_path(const Task& task) {
    return "tasks/" + task.name + ".json";
}

std::string claim_path(const Task& task) {
    return "tasks/" + task.name + ".claim";
}

std::string report_folder_of(const Study& study, const Task& task) {
    const std::string& scene = study.scenes[task.scene].name;
    return "scenes/" + scene + (task.pair ? "/" + task.name.substr(scene.size() + 1) : "");
}

std::string text_of(const TaskResult& result) {
    Json variants = Json::array();
    for (const auto& variant : result.variants) {
        Json metrics = Json::object();
        for (const auto& [name, values] : variant.metrics) metrics[name] = report::json_of(values);
        variants.push_back({{"name", variant.name},
                            {"metrics", metrics},
                            {"time_ms", report::json_of(variant.time_ms)}});
    }
    return io::json_text({{"postchain_task", 1},
                          {"made_from", result.made_from},
                          {"failure", result.failure},
                          {"renderer", result.renderer},
                          {"revision", result.revision},
                          {"truth", result.truth},
                          {"frames", result.frames},
                          {"width", result.width},
                          {"height", result.height},
                          {"variants", variants}},
                         1) +
           "\n";
}

std::optional<TaskResult> task_result_from(const std::string& text) {
    try {
        const Json json = Json::parse(text);
        if (json.at("postchain_task") != 1) return std::nullopt;
        TaskResult result;
        result.made_from = json.at("made_from").get<std::vector<std::string>>();
        result.failure = json.at("failure").get<std::string>();
        result.renderer = json.at("renderer").get<std::string>();
        // Results of earlier versions lack the commit and times.
        result.revision = json.value("revision", "unknown");
        result.truth = json.at("truth").get<std::string>();
        result.frames = json.at("frames").get<std::vector<int>>();
        result.width = json.at("width").get<int>();
        result.height = json.at("height").get<int>();
        for (const Json& one : json.at("variants")) {
            TaskResult::Figures figures{one.at("name").get<std::string>(), {}, std::nullopt};
            if (const auto time = one.find("time_ms"); time != one.end() && !time->is_null())
                figures.time_ms = time->get<double>();
            for (const auto& [name, list] : one.at("metrics").items())
                for (const Json& value : list)
                    figures.metrics[name].push_back(
                        value.is_null() ? std::nullopt : std::optional(value.get<double>()));
            result.variants.push_back(std::move(figures));
        }
        return result;
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

Result<TaskResult> measure_task(const Study& study, const Task& task, const std::string& folder,
                                const Machine& machine,
                                const experiment::ProgressCallback& progress,
                                const std::atomic<bool>* stop) {
    const Scene& scene = study.scenes[task.scene];
    TaskResult result;
    result.made_from = made_from(study, task);
    result.renderer = machine.renderer;
    result.revision = kSourceRevision;
    experiment::BenchSettings settings = scene.measured;
    settings.folder = folder + "/" + report_folder_of(study, task);
    settings.renderer = machine.renderer;
    settings.software = machine.software;
    settings.chain_name = study.chains.size() > 1 ? study.title : study.chains.front().name;
    std::vector<Camera> cameras;
    if (task.pair) {
        const auto& [a, b] = study.pairs[*task.pair];
        cameras = {study.chain(a).camera, study.chain(b).camera};
        // An existing report belongs to this study, because the folder has the study's mark.
        settings.on_existing = io::OnExisting::overwrite;
        settings.resumes = false;
    } else {
        for (const auto& variant : study.variants) cameras.push_back(variant.chain.camera);
    }
    experiment::complete(settings, {settings.run, scene.input, study.chain_files, cameras,
                                    machine.command, machine.threads});
    auto report = task.pair ? measured_ab(study, task, settings, machine, progress, stop)
                            : measured_bench(study, settings, machine, progress, stop);
    if (stop && *stop) return Status(StatusCode::canceled, "stopped");
    if (report.ok()) {
        if (Status status = experiment::write_report_files(*report, {}); !status.ok())
            return status.at("scene " + scene.name);
        take(*report, result);
    } else if (ends_the_study(report.status())) {
        return report.status().at("scene " + scene.name);
    } else {
        result.failure = report.status().message();
    }
    return result;
}

}  // namespace postchain::study
