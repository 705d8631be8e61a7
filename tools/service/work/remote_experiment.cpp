#include "tools/service/work/remote_experiment.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "chain/base/printable.h"
#include "chain/base/readable_file.h"
#include "config/chain_file.h"
#include "config/text_tree.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/study/study_folder.h"
#include "tools/measure/study/study_report.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/record/frame_report.h"
#include "tools/service/work/experiment_work.h"
#include "tools/service/work/frames_work.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

// Keys of a body that are not options of the command, or that are given otherwise.
constexpr std::array kOtherKeys = {"kind",    "priority",   "frame_timeout", "chain",
                                   "chain_b", "chain_text", "chain_b_text",  "set",
                                   "output",  "on_existing"};

// Each key is the option of its name.
std::vector<std::string> options_of(const std::string& body, const Roots& roots) {
    const RequestBody text(body, roots);
    std::vector<std::string> words;
    for (const auto& [key, value] : text.root().entries) {
        if (std::ranges::find(kOtherKeys, key.text) != kOtherKeys.end()) continue;
        const std::string option = sequence::option_name(key.text);
        if (value.is_list()) {
            for (const TextNode& item : value.items) words.push_back(option + "=" + item.text);
        } else if (!is_string(value) && (value.text == "true" || value.text == "false")) {
            words.push_back(value.text == "true" ? option : "--no-" + option.substr(2));
        } else {
            words.push_back(option + "=" + value.text);
        }
    }
    return words;
}

// A chain as a file of its name, which the report shows.
Result<std::string> chain_file(const experiment::NamedChain& chain, const std::string& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    const std::string path = folder + "/" + fs::path(chain.name).filename().string() + ".yaml";
    RETURN_IF_ERROR(write_task_file(path, write_chain(chain.chain)));
    return path;
}

// The last "3/12, frame 7, paper, 0:10 elapsed" of a task's messages, which
// progress_printer() of the command logs.
std::optional<TaskProgress> logged_progress(const std::string& path) {
    constexpr std::streamoff kMost = 4096;  // bytes
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file ? std::streamoff(file.tellg()) : 0;
    file.seekg(std::max<std::streamoff>(0, size - kMost));
    std::optional<TaskProgress> last;
    std::string line;
    if (size > kMost) std::getline(file, line);  // a part of one
    while (std::getline(file, line) && !file.eof()) {
        TaskProgress found;
        int at = 0;
        if (std::sscanf(line.c_str(), "%zu/%zu, %n", &found.done, &found.total, &at) != 2 ||
            at == 0)
            continue;
        const size_t end = line.rfind(", ", line.rfind(" elapsed"));
        if (end == std::string::npos || end < size_t(at)) continue;
        found.what = printable(line.substr(size_t(at), end - size_t(at)));
        last = std::move(found);
    }
    return last;
}

// Whether every variant of a report.json failed.
bool has_failed(const io::Json& json) {
    const auto variants = json.find("variants");
    return variants != json.end() && variants->is_array() && !variants->empty() &&
           std::ranges::all_of(*variants, [](const io::Json& one) {
               const auto failure = one.find("failure");
               return failure != one.end() && failure->is_string();
           });
}

// {"verdict": ...} of a report.json, wherever it is.
std::string verdict_of(const io::Json& json) {
    const auto comparison = json.find("comparison");
    if (comparison != json.end() && comparison->is_object())
        return comparison->value("verdict", "");
    const auto variants = json.find("variants");
    if (variants == json.end() || !variants->is_array()) return "";
    const auto best = std::ranges::count_if(
        *variants, [](const io::Json& one) { return one.value("pareto", false); });
    return concat(variants->size(), " variants, ", best, " in the Pareto set");
}

}  // namespace

Status write_task_file(const std::string& path, const std::string& text) {
    std::ofstream out(path);
    out << text;
    out.close();
    return out ? Status()
               : Status(StatusCode::output, path + ": cannot be written; see --farm-folder");
}

Status begin_experiment(JobRequest& request, const Roots& roots) {
    RETURN_IF_ERROR(check_experiment_paths(request, roots));
    if (request.kind != JobKind::study)
        return experiment::prepare_folder(request.measured).status();
    return study::StudyFolder::open(request.study, request.study_settings.folder,
                                    request.study_settings.on_existing)
        .status();
}

Result<ExperimentTasks> experiment_tasks(const Job& job, const JobRequest& request,
                                         const RemoteSettings& settings, const Roots& roots,
                                         const std::string& folder) {
    ExperimentTasks tasks;
    tasks.command = {settings.program, name_of(job.kind)};
    if (job.kind == JobKind::study) {
        tasks.command.push_back(request.study_file);
        tasks.command.push_back("--output=" + request.study_settings.folder);
    } else {
        ASSIGN_OR_RETURN(auto a, chain_file(request.chain, folder + "/a"));
        tasks.command.push_back(std::move(a));
        if (job.kind == JobKind::ab) {
            ASSIGN_OR_RETURN(auto b, chain_file(request.chain_b, folder + "/b"));
            tasks.command.push_back(std::move(b));
        }
        for (std::string& word : options_of(job.body, roots))
            tasks.command.push_back(std::move(word));
        tasks.command.push_back("--output=" + request.measured.folder);
    }
    // The folder was checked before the first task, which may run again.
    tasks.command.push_back(job.kind == JobKind::ab ? "--on-existing=overwrite"
                                                    : "--on-existing=skip");
    tasks.command.push_back("--device=" + settings.device);
    if (job.kind != JobKind::study) {
        tasks.words.emplace_back();
        return tasks;
    }
    const size_t count = std::min(study::tasks_of(request.study).size(), kMaxTasks);
    for (size_t i = 1; i <= count; ++i) tasks.words.push_back({concat("--chunk=", i, "/", count)});
    return tasks;
}

std::optional<TaskProgress> progress_of_experiment(const Job& job, const JobRequest& request,
                                                   const std::string& folder) {
    if (job.kind != JobKind::study) return logged_progress(folder + "/1.log");
    // Reading the folder makes NFS look for new files.
    std::set<std::string> names;
    std::error_code error;
    for (fs::directory_iterator at(request.study_settings.folder + "/tasks", error), end;
         !error && at != end; at.increment(error))
        names.insert(at->path().filename());
    TaskProgress progress;
    for (const study::Task& task : study::tasks_of(request.study)) {
        ++progress.total;
        if (!names.contains(fs::path(study::result_path(task)).filename())) continue;
        ++progress.done;
        progress.what = task.name + ": measured";
    }
    return progress.done > 0 ? std::optional(progress) : std::nullopt;
}

std::optional<WorkEnd> end_of_experiment(const Job& job, const JobRequest& request, int exit_code,
                                         const Roots& roots) {
    const std::string path = request.report_folder() + "/report.json";
    if (!made_after(path, job.created_ms)) return std::nullopt;
    const auto json = io::read_json(text_of_file(path), path, io::kReportLimits);
    if (!json.ok() || !json->is_object()) return std::nullopt;
    WorkEnd end;
    end.exit_code = exit_code;
    if (job.kind != JobKind::study) {
        if (has_failed(*json)) end.state = JobState::failed;
        end.verdict = verdict_of(*json);
        std::ranges::replace(end.verdict, '\n', ' ');
        return end;
    }
    study::StudySettings settings = request.study_settings;
    const auto folder =
        study::StudyFolder::open(request.study, settings.folder, io::OnExisting::skip);
    if (!folder.ok()) return WorkEnd::failed(folder.status());
    const auto report = study::read_report(request.study, *folder);
    if (!report.ok()) return std::nullopt;
    for (const study::SceneEntry& scene : report->scenes)
        if (!scene.failure.empty())
            end.say(concat("scene ", scene.name, ": ", roots.shown_in(scene.failure)));
    end.verdict = joined(report->verdict(), " ");
    return end;
}

}  // namespace postchain::service
