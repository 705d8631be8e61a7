#include "tools/measure/experiment/report_folder.h"

#include <filesystem>
#include <optional>
#include <set>
#include <string_view>

#include "chain/base/readable_file.h"
#include "tools/measure/experiment/experiment.h"
#include "tools/measure/experiment/outcome.h"
#include "tools/measure/report/images.h"
#include "tools/measure/report/page/page.h"
#include "tools/measure/report/report_json.h"
#include "tools/measure/report/report_text.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/run_files.h"

namespace postchain::experiment {
namespace {

namespace fs = std::filesystem;

Result<io::OutputFiles> files_of(const ExperimentSettings& settings) {
    io::OutputFiles files(settings.on_existing,
                          settings.resumes ? "skip or overwrite" : "overwrite");
    sequence::read_inputs(settings.run, files);
    if (!settings.truth.empty()) {
        const auto truth = io::InputSpec::parse(settings.truth);
        if (!truth.ok()) return truth.status().at("{truth}"_keyed);
        files.read(truth->color(), "the ground truth");
    }
    files.write(io::OutputFolder{settings.folder, "a report", kFolderMark,
                                 "This folder is a report of postchain.\n",
                                 "name another folder with {output}"_keyed});
    std::error_code error;
    if (settings.assets.empty() || fs::equivalent(settings.assets, settings.folder, error))
        return files;
    const fs::path folder = fs::absolute(settings.folder, error);
    if (error) return Status(StatusCode::output, settings.folder + ": " + error.message());
    const fs::path canonical = fs::weakly_canonical(folder, error);
    if (error) return Status(StatusCode::output, settings.folder + ": " + error.message());
    const fs::path page = canonical / "index.html";
    files.write(io::OutputFolder{settings.assets, "the folder of this page's images", kAssetsMark,
                                 "Pictures of the page " + page.string() + "\n",
                                 "name another folder with {assets}"_keyed});
    return files;
}

bool is_number(std::string_view text) {
    text.remove_prefix(text.starts_with('-'));
    return !text.empty() && text.find_first_not_of("0123456789") == text.npos;
}

// The part between the last dot and `extension`: "0001" of "input.0001.exr".
std::string_view counted(std::string_view name, std::string_view extension) {
    if (!name.ends_with(extension)) return {};
    name.remove_suffix(extension.size());
    const size_t dot = name.rfind('.');
    return dot == name.npos || dot == 0 ? std::string_view() : name.substr(dot + 1);
}

bool is_frame_file(std::string_view name) {
    const std::string_view number = counted(name, ".exr");
    return number.size() >= 4 && is_number(number);
}

bool is_result_file(std::string_view name) {
    const std::string_view what = counted(name, ".json");
    return what == "time" || is_number(what);
}

// The images that report.json lists; empty if there is no such list.
std::optional<std::set<std::string>> listed_pictures(const std::string& folder) {
    const std::string report = folder + "/report.json";
    const auto json = io::read_json(text_of_file(report), report, io::kReportLimits);
    if (!json.ok() || !json->is_object() || !json->contains("images") ||
        !(*json)["images"].is_array())
        return std::nullopt;
    std::set<std::string> listed;
    for (const auto& image : (*json)["images"])
        if (image.is_object() && image.contains("path") && image["path"].is_string())
            listed.insert(image["path"].get<std::string>());
    return listed;
}

}  // namespace

std::vector<std::string> folders_in(const std::string& folder) {
    std::vector<std::string> folders;
    std::error_code error;
    if (fs::is_symlink(folder, error)) return folders;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        std::error_code ignored;
        if (it->is_directory(ignored) && !it->is_symlink(ignored))
            folders.push_back(it->path().string());
    }
    return folders;
}

Status remove_files(const std::string& folder,
                    const std::function<bool(const std::string& name)>& made) {
    std::error_code error;
    if (fs::is_symlink(folder, error) || !fs::is_directory(folder, error)) return Status();
    const OpenFolder in(folder);
    std::vector<fs::path> paths;
    for (fs::directory_iterator it(in.path(), error), end; !error && it != end;
         it.increment(error)) {
        std::error_code ignored;
        const bool is_folder = it->is_directory(ignored) && !it->is_symlink(ignored);
        if (!is_folder && made(it->path().filename().string())) paths.push_back(it->path());
    }
    for (const fs::path& path : paths) {
        fs::remove(path, error);
        if (error)
            return Status(StatusCode::output, concat(folder, "/", path.filename().string(),
                                                     ": cannot remove it: ", error.message()));
    }
    fs::remove(folder, error);  // only if empty
    return Status();
}

Status remove_report(const std::string& folder) {
    std::set<std::string> names = {"index.html", "report.json", "report.csv", "report.md"};
    for (const auto& column : metric_columns(report::Kind::bench, true))
        names.insert(under_file(column.name));
    const auto listed = listed_pictures(folder);
    const std::string images = report::kImageFolder;
    RETURN_IF_ERROR(remove_files(folder + "/" + images, [&](const std::string& name) {
        return listed ? listed->contains(images + "/" + name) : is_frame_file(name);
    }));
    RETURN_IF_ERROR(remove_files(folder + "/results", is_result_file));
    for (const std::string& truth : folders_in(folder + "/truth"))
        RETURN_IF_ERROR(remove_files(truth, [](const std::string& name) {
            return name.starts_with("both.") && is_frame_file(name);
        }));
    RETURN_IF_ERROR(remove_files(folder + "/truth", [](const std::string&) { return false; }));
    // The list is removed last, so that an interrupted removal can continue.
    return remove_files(folder, [&](const std::string& name) { return names.contains(name); });
}

Status check_folder(const ExperimentSettings& settings) {
    const auto files = files_of(settings);
    return files.ok() ? files->check() : files.status();
}

Result<io::OutputFiles> prepare_folder(const ExperimentSettings& settings) {
    auto files = files_of(settings);
    if (!files.ok()) return files;
    RETURN_IF_ERROR(files->check());
    files->remove_left_temporaries();
    if (settings.on_existing == io::OnExisting::overwrite)
        RETURN_IF_ERROR(remove_report(settings.folder));
    RETURN_IF_ERROR(files->make_folders());
    return files;
}

std::string page_path(const report::Report& report) {
    return report.folder + "/index.html";
}

Status write_report_files(const report::Report& report, const std::string& assets) {
    const std::string stem = report.folder + "/report.";
    RETURN_IF_ERROR(
        report.write(stem + "json", io::json_text(report::report_json(report), 1) + "\n"));
    RETURN_IF_ERROR(report.write(stem + "csv", report::report_as_csv(report)));
    RETURN_IF_ERROR(report.write(stem + "md", report::report_as_markdown(report)));
    return report::write_page(report, page_path(report), {assets});
}

}  // namespace postchain::experiment
