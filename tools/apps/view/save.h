// Writes what the viewer saves: files of one kind each, by the rules of files/output_files.h.
#pragma once

#include <map>
#include <string>

#include "tools/sequence/settings/run_settings.h"

namespace postchain::view {

// The user's choice.
io::OnExisting on_existing(bool replace);

// A file that is not a frame of a run, and what its commit() may do. Errors (usage, output): it is
// an input, or exists and `replace` is not set.
struct NewFile {
    io::AtomicFile file;
    io::OnExisting on_existing;
};
Result<NewFile> new_file(const sequence::RunSettings& settings, const std::string& path,
                         const std::string& what, bool replace);
Status save_text(const sequence::RunSettings& settings, const std::string& path,
                 const std::string& text, const std::string& what, bool replace);

// The camera file with these focus distances by frame: the values of `camera` (the text of a
// camera file, may be empty) stay. Errors (input): `camera` is not JSON.
Result<std::string> camera_with_focus(const std::string& camera, const Camera& values,
                                      const std::map<int, double>& focus);

}  // namespace postchain::view
