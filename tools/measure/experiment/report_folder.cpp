#include "tools/measure/experiment/report_folder.h"

#include <filesystem>

#include "tools/measure/experiment/choose.h"
#include "tools/measure/experiment/experiment.h"
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
        if (!truth.ok()) return truth.status().at("--truth");
        files.read(truth->color(), "the truth");
    }
    files.write(io::OutputFolder{settings.folder, "a report", kFolderMark,
                                 "This folder is a report of postchain.\n",
                                 "name another folder with --output"});
    std::error_code error;
    if (settings.assets.empty() || fs::equivalent(settings.assets, settings.folder, error))
        return files;
    const fs::path folder = fs::absolute(settings.folder, error);
    if (error) return Status(StatusCode::output, settings.folder + ": " + error.message());
    const fs::path canonical = fs::weakly_canonical(folder, error);
    if (error) return Status(StatusCode::output, settings.folder + ": " + error.message());
    const fs::path page = canonical / "index.html";
    files.write(io::OutputFolder{settings.assets, "the folder of this page's pictures", kAssetsMark,
                                 "Pictures of the page " + page.string() + "\n",
                                 "name another folder with --assets"});
    return files;
}

Status remove_report(const std::string& folder) {
    std::vector<std::string> names = {"images",      "results",    "truth",    "index.html",
                                      "report.json", "report.csv", "report.md"};
    for (const auto& column : metric_columns(report::Kind::bench, true))
        names.push_back(under_file(column.name));
    for (const auto& name : names) {
        std::error_code error;
        fs::remove_all(folder + "/" + name, error);
        if (error)
            return Status(StatusCode::output,
                          concat(folder, "/", name, ": cannot be removed: ", error.message()));
    }
    return Status();
}

}  // namespace

Result<io::OutputFiles> prepare_folder(const ExperimentSettings& settings) {
    auto files = files_of(settings);
    if (!files.ok()) return files;
    if (Status status = files->check(); !status.ok()) return status;
    files->remove_left_temporaries();
    if (settings.on_existing == io::OnExisting::overwrite)
        if (Status status = remove_report(settings.folder); !status.ok()) return status;
    if (Status status = files->make_folders(); !status.ok()) return status;
    return files;
}

}  // namespace postchain::experiment
