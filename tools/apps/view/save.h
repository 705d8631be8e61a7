// Writes what the viewer saves: files of one kind each, by the rules of files/output_files.h.
#pragma once

#include <map>
#include <string>

#include "tools/sequence/run/run_settings.h"

namespace postchain::view {

// The rules for one file that is not a frame of a run. `replace`: an existing file may be replaced.
// Errors (usage, output): it is an input, or exists.
Result<io::OnExisting> permit(const sequence::RunSettings& settings, const std::string& path,
                              const std::string& what, bool replace);
Status save_text(const sequence::RunSettings& settings, const std::string& path,
                 const std::string& text, const std::string& what, bool replace);

// The camera file with these focus distances by frame: the values of `camera` (the text of a
// camera file, may be empty) stay. Errors (input): `camera` is not JSON.
Result<std::string> camera_with_focus(const std::string& camera, const Camera& values,
                                      const std::map<int, double>& focus);

}  // namespace postchain::view
