// Ownership of a report's folder, and the changes an experiment may make in it.
#pragma once

#include <functional>
#include <string>

#include "tools/measure/experiment/settings.h"

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

// Removes a report's files: the images that its report.json lists (otherwise those with names of
// that form), results, ground truth and texts. Other files and the mark stay. Errors (output).
Status remove_report(const std::string& folder);

// Removes the files of `folder` whose names are `made`, and the folder if it is then empty. Does
// nothing if the folder does not exist or is a link. Errors (output).
Status remove_files(const std::string& folder,
                    const std::function<bool(const std::string& name)>& made);

}  // namespace postchain::experiment
