// The sequences of a folder, found from the names of its EXR files.
#pragma once

#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {

struct FoundSequence {
    std::string pattern;      // "DIR/shot.####.exr", as --input takes it; one file: its path
    std::vector<int> frames;  // on disk, ascending
    std::vector<int> gaps;    // numbers missing between them, at most kMaxFrames
};

// By name. The frame number is the last group of digits before the extension, as everywhere
// (PathPattern::literal_frame()); names that differ in it alone are one sequence. A file that no
// other is like is a sequence of one. Temporaries and folders below are left out. Errors (input):
// the folder cannot be read, or has no EXR file.
Result<std::vector<FoundSequence>> scan_folder(const std::string& folder);

}  // namespace postchain::io
