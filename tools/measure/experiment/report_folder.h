// The folder of a report: its owner, the changes an experiment may make in it, and its files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/measure/experiment/settings.h"
#include "tools/measure/report/report.h"

namespace postchain::experiment {

// A file in the folder of every report, from the start of its experiment.
inline constexpr const char* kFolderMark = ".postchain-report";
// A file in the separate folder of a page's images; it names the page.
inline constexpr const char* kAssetsMark = ".postchain-assets";

// Creates and marks the folder and that of the page's images. A non-empty folder is refused unless
// it has the mark and settings.on_existing is skip or overwrite; overwrite removes the report's own
// files, and nothing else. Returns what may be written. Errors (usage): an input of the experiment
// is inside a folder; (output).
Result<io::OutputFiles> prepare_folder(const ExperimentSettings& settings);

// The refusals of prepare_folder(), without a change on disk.
Status check_folder(const ExperimentSettings& settings);

// Removes a report's files: the images that its report.json lists (otherwise those with names of
// that form), results, ground truth and texts. Other files and the mark stay. Errors (output).
Status remove_report(const std::string& folder);

// Removes the files of `folder` whose names are `made`, and the folder if it is then empty. Does
// nothing if the folder does not exist or is a link. Errors (output).
Status remove_files(const std::string& folder,
                    const std::function<bool(const std::string& name)>& made);

// The folders in `folder`; none if it is a link or does not exist.
std::vector<std::string> folders_in(const std::string& folder);

// Writes report.json, report.csv, report.md and index.html into the report's folder. `assets`: as
// in ExperimentSettings. Errors (output).
Status write_report_files(const report::Report& report, const std::string& assets);
std::string page_path(const report::Report& report);

}  // namespace postchain::experiment
