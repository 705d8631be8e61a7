#include "tools/measure/study/study_folder.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "config/text_tree.h"
#include "tools/sequence/run/run_files.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;

constexpr TextLimits kResultLimits = {size_t(64) << 20, 32};

// Shortened to what stands around the first difference.
std::string shown(const std::string& line, size_t from) {
    constexpr size_t kMost = 120;
    const size_t begin = from > 40 ? from - 40 : 0;
    std::string text = line.substr(begin, kMost);
    if (begin > 0) text = "..." + text;
    if (begin + kMost < line.size()) text += "...";
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

}  // namespace

Result<StudyFolder> StudyFolder::open(const Study& study, const std::string& path,
                                      io::OnExisting on_existing) {
    io::OutputFiles files(on_existing, "skip or overwrite");
    for (const Scene& scene : study.scenes) {
        sequence::read_inputs(scene.measured.run, files);
        if (scene.measured.truth.empty()) continue;
        const auto truth = io::PathPattern::parse(scene.measured.truth);
        if (!truth.ok()) return truth.status();
        files.read(*truth, "the truth of " + scene.name);
    }
    files.read(io::InputFile{study.file, "the study's file"});
    files.write(io::OutputFolder{path, "a study", kStudyMark,
                                 "This folder is a study of postchain.\n",
                                 "name another folder with --output"});
    if (Status status = files.check(); !status.ok()) return status;
    files.remove_left_temporaries();
    if (on_existing == io::OnExisting::overwrite)
        for (const char* name :
             {"units", "scenes", "report.json", "report.csv", "report.md", "index.html"}) {
            std::error_code error;
            fs::remove_all(path + "/" + name, error);
            if (error)
                return Status(StatusCode::output,
                              concat(path, "/", name, ": cannot be removed: ", error.message()));
        }
    if (Status status = files.make_folders(); !status.ok()) return status;
    std::error_code error;
    fs::create_directories(path + "/units", error);
    if (error)
        return Status(StatusCode::output, path + "/units: cannot be made: " + error.message());
    io::remove_dead_temporaries(path + "/units", [](const std::string&) { return true; });
    StudyFolder folder(path, std::move(files));
    if (Status status = folder.check_results(study); !status.ok()) return status;
    return folder;
}

// Those that are there belong to this study as it is now.
Status StudyFolder::check_results(const Study& study) const {
    std::set<std::string> known;
    for (const Unit& unit : units_of(study)) {
        known.insert(unit.name + ".json");
        if (const auto found = result(study, unit); !found.ok()) return found.status();
    }
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(path_ + "/units", error)) {
        const std::string name = entry.path().filename().string();
        if (entry.path().extension() == ".json" && name[0] != '.' && !known.contains(name))
            return Status(StatusCode::usage,
                          concat(path_, "/units/", name,
                                 ": is of another study: this one has no such scene or question; "
                                 "name another folder with --output, or --on-existing overwrite"));
    }
    return Status();
}

Result<std::optional<UnitResult>> StudyFolder::result(const Study& study, const Unit& unit) const {
    const std::string path = path_ + "/" + result_path(unit);
    std::error_code error;
    if (!fs::exists(path, error)) return std::optional<UnitResult>();
    const auto text = read_text_file(path, StatusCode::input, kResultLimits);
    if (!text.ok()) return text.status();
    auto result = unit_result_from(*text);
    if (!result)
        return Status(StatusCode::input,
                      path + ": is no result of a study; remove it, and it is made again");
    // A scene that failed is tried again, whatever has changed since.
    if (!result->failure.empty()) return result;
    const std::string differs = difference(result->made_from, made_from(study, unit));
    if (!differs.empty())
        return Status(StatusCode::usage,
                      concat(path, ": ", differs,
                             "; remove this file to measure the scene again, name another folder "
                             "with --output, or --on-existing overwrite"));
    return result;
}

Status StudyFolder::keep(const Unit& unit, const UnitResult& result) const {
    return write(result_path(unit), text_of(result));
}

Status StudyFolder::write(const std::string& name, std::string_view text) const {
    const std::string path = path_ + "/" + name;
    const auto permit = files_.permit(path);
    if (!permit.ok()) return permit.status();
    return io::atomic_write_text(path, text, *permit).status();
}

}  // namespace postchain::study
