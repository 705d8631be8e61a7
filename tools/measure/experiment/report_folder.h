// The folder of a report: whose it is, and what an experiment may do in it.
#pragma once

#include <functional>
#include <string>

#include "tools/measure/experiment/settings.h"

namespace postchain::experiment {

// A file in every folder of a report, from the moment an experiment begins there.
inline constexpr const char* kFolderMark = ".postchain-report";
// And in the folder of its page's pictures, where that is another: it names the page.
inline constexpr const char* kAssetsMark = ".postchain-assets";

// Makes the folder, and that of the page's pictures, and marks them. A folder that is not empty is
// refused, unless it bears the mark and settings.on_existing is skip, or overwrite; then what a
// report consists of is removed, and nothing else. Returns what may be written. Errors (usage): an
// input of the experiment lies in a folder; (output).
Result<io::OutputFiles> prepare_folder(const ExperimentSettings& settings);

// Removes what a report has written into its folder: the pictures that its report.json lists, or
// those of the form of its names, results, truth and texts. What else lies there stays, the mark
// too. Errors (output).
Status remove_report(const std::string& folder);

// Removes the files of `folder` whose names are `made`, and the folder where nothing is left in it.
// Nothing where it is not there or is a link. Errors (output).
Status remove_files(const std::string& folder,
                    const std::function<bool(const std::string& name)>& made);

}  // namespace postchain::experiment
