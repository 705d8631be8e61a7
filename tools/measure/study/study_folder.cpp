#include "tools/measure/study/study_folder.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "config/text_tree.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/measure/report/report_json.h"
#include "tools/sequence/files/file_stamp.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/run_files.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;
using io::Json;

constexpr TextLimits kResultLimits = {size_t(64) << 20, 32};

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

// Shortened to the text around the first difference.
std::string shown(const std::string& line, size_t from) {
    constexpr size_t kMax = 120;
    const size_t begin = from > 40 ? from - 40 : 0;
    std::string text = line.substr(begin, kMax);
    if (begin > 0) text = "..." + text;
    if (begin + kMax < line.size()) text += "...";
    return text;
}

std::string difference(const std::vector<std::string>& was, const std::vector<std::string>& is) {
    for (size_t i = 0; i < std::max(was.size(), is.size()); ++i) {
        const std::string a = i < was.size() ? was[i] : "nothing";
        const std::string b = i < is.size() ? is[i] : "nothing";
        if (a == b) continue;
        const size_t at = size_t(
            std::mismatch(a.begin(), a.begin() + long(std::min(a.size(), b.size())), b.begin())
                .first -
            a.begin());
        return concat("was made from \"", shown(a, at), "\", and that is \"", shown(b, at),
                      "\" now");
    }
    return "";
}

bool is_result(const std::string& path) {
    const auto text = read_text_file(path, StatusCode::input, kResultLimits);
    return text.ok() && task_result_from(*text);
}

// Removes the report in a folder of its own, and its mark if no other file remains.
Status remove_scene(const std::string& folder) {
    const std::string mark = experiment::kFolderMark;
    std::error_code error;
    if (!fs::exists(folder + "/" + mark, error)) return Status();
    RETURN_IF_ERROR(experiment::remove_report(folder));
    size_t others = 0;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        others += it->path().filename() != mark;
    if (error || others > 0) return Status();
    return experiment::remove_files(folder, [&](const std::string& name) { return name == mark; });
}

// Removes the files of a study, and no others.
Status remove_study(const Study& study, const std::string& path) {
    std::set<std::string> known;
    for (const Task& task : tasks_of(study)) known.insert(fs::path(result_path(task)).filename());
    const std::string tasks = path + "/tasks", scenes = path + "/scenes";
    RETURN_IF_ERROR(experiment::remove_files(tasks, [&](const std::string& name) {
        const std::string extension = fs::path(name).extension();
        return extension == ".claim" || known.contains(name) ||
               (extension == ".json" && is_result(tasks + "/" + name));
    }));
    const auto nothing = [](const std::string&) { return false; };
    for (const std::string& scene : experiment::folders_in(scenes)) {
        for (const std::string& pair : experiment::folders_in(scene))
            RETURN_IF_ERROR(remove_scene(pair));
        RETURN_IF_ERROR(remove_scene(scene));
        RETURN_IF_ERROR(experiment::remove_files(scene, nothing));
    }
    RETURN_IF_ERROR(experiment::remove_files(scenes, nothing));
    return experiment::remove_files(path, [](const std::string& name) {
        return name == "report.json" || name == "report.csv" || name == "report.md" ||
               name == "index.html";
    });
}

}  // namespace

std::vector<const experiment::NamedChain*> chains_of(const Study& study, const Task& task) {
    if (task.pair) {
        const auto& [a, b] = study.pairs[*task.pair];
        return {&study.chains[a], &study.chains[b]};
    }
    std::vector<const experiment::NamedChain*> all;
    for (const auto& chain : study.chains) all.push_back(&chain);
    return all;
}

std::vector<std::string> made_from(const Study& study, const Task& task) {
    const Scene& scene = study.scenes[task.scene];
    std::vector<std::string> lines = {"postchain " + scene.measured.run.version,
                                      std::string("kind ") + report::name_of(study.kind)};
    for (const experiment::NamedChain* one : chains_of(study, task))
        lines.push_back("chain " + one->name + ": " + one->chain.text());
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
    for (const auto& variant : result.variants)
        variants.push_back(
            {{"name", variant.name}, {"metrics", variant.metrics}, {"time_ms", variant.time_ms}});
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
        const auto read = io::read_json(text, "", io::kReportLimits);
        const Json json = read.ok() ? *read : Json();
        if (json.at("postchain_task") != 1) return std::nullopt;
        TaskResult result;
        result.made_from = json.at("made_from").get<std::vector<std::string>>();
        result.failure = json.at("failure").get<std::string>();
        result.renderer = json.at("renderer").get<std::string>();
        result.revision = json.at("revision").get<std::string>();
        result.truth = json.at("truth").get<std::string>();
        result.frames = json.at("frames").get<std::vector<int>>();
        result.width = json.at("width").get<int>();
        result.height = json.at("height").get<int>();
        for (const Json& one : json.at("variants")) {
            TaskResult::Figures figures{one.at("name").get<std::string>(), {}, std::nullopt};
            one.at("time_ms").get_to(figures.time_ms);
            one.at("metrics").get_to(figures.metrics);
            result.variants.push_back(std::move(figures));
        }
        return result;
    } catch (const nlohmann::json::exception&) {
        return std::nullopt;
    }
}

namespace {

Result<io::OutputFiles> files_of(const Study& study, const std::string& path,
                                 io::OnExisting on_existing) {
    io::OutputFiles files(on_existing, "skip or overwrite");
    for (const Scene& scene : study.scenes) {
        sequence::read_inputs(scene.measured.run, files);
        if (scene.measured.truth.empty()) continue;
        ASSIGN_OR_RETURN(const auto truth, io::PathPattern::parse(scene.measured.truth));
        files.read(truth, "the truth of " + scene.name);
    }
    files.read(io::InputFile{study.file, "the study's file"});
    files.write(io::OutputFolder{path, "a study", kStudyMark,
                                 "This folder is a study of postchain.\n",
                                 "name another folder with {output}"_keyed});
    RETURN_IF_ERROR(files.check());
    return files;
}

}  // namespace

Status StudyFolder::check(const Study& study, const std::string& path, io::OnExisting on_existing) {
    ASSIGN_OR_RETURN(auto files, files_of(study, path, on_existing));
    if (on_existing == io::OnExisting::overwrite) return Status();
    return StudyFolder(path, std::move(files)).check_results(study);
}

Result<StudyFolder> StudyFolder::open(const Study& study, const std::string& path,
                                      io::OnExisting on_existing) {
    ASSIGN_OR_RETURN(auto files, files_of(study, path, on_existing));
    files.remove_left_temporaries();
    if (on_existing == io::OnExisting::overwrite) RETURN_IF_ERROR(remove_study(study, path));
    RETURN_IF_ERROR(files.make_folders());
    RETURN_IF_ERROR(io::make_folder(path + "/tasks"));
    io::remove_dead_temporaries(path + "/tasks", [](const std::string&) { return true; });
    StudyFolder folder(path, std::move(files));
    RETURN_IF_ERROR(folder.check_results(study));
    return folder;
}

// Existing results belong to this study as it is now.
Status StudyFolder::check_results(const Study& study) const {
    std::set<std::string> known;
    for (const Task& task : tasks_of(study)) {
        known.insert(task.name + ".json");
        RETURN_IF_ERROR(result(study, task).status());
    }
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_ + "/tasks", error)) {
        const std::string name = entry.path().filename().string();
        if (entry.path().extension() == ".json" && name[0] != '.' && !known.contains(name) &&
            is_result(entry.path().string()))
            return Status(
                StatusCode::usage,
                concat(path_, "/tasks/", name,
                       ": belongs to another study: this one has no such scene or question; "
                       "name another folder with {output}, or {on_existing=overwrite}"_keyed));
    }
    return Status();
}

Result<std::optional<TaskResult>> StudyFolder::result(const Study& study, const Task& task) const {
    const std::string path = path_ + "/" + result_path(task);
    std::error_code error;
    if (!fs::exists(path, error)) return std::optional<TaskResult>();
    ASSIGN_OR_RETURN(const auto text, read_text_file(path, StatusCode::input, kResultLimits));
    auto result = task_result_from(text);
    if (!result ||
        (result->failure.empty() && result->variants.size() != chains_of(study, task).size()))
        return Status(StatusCode::input,
                      path + ": is not a result of a study; remove it, and it is made again");
    // A scene that failed is tried again, whatever has changed since.
    if (!result->failure.empty()) return result;
    const std::string differs = difference(result->made_from, made_from(study, task));
    if (!differs.empty())
        return Status(StatusCode::usage,
                      concat(path, ": ", differs,
                             "; remove this file to measure the scene again, name another folder "
                             "with {output}, or {on_existing=overwrite}"_keyed));
    return result;
}

Status StudyFolder::keep(const Task& task, const TaskResult& result) const {
    return write(result_path(task), text_of(result));
}

Status StudyFolder::write(const std::string& name, std::string_view text) const {
    return files_.put(path_ + "/" + name, text);
}

}  // namespace postchain::study
