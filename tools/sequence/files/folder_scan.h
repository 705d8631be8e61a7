// The sequences of a folder, found from the names of its EXR files.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::io {

struct FoundSequence {
    std::string pattern;      // "DIR/shot.####.exr", as --input takes it; one file: its path
    std::vector<int> frames;  // on disk, ascending
    std::vector<int> gaps;    // numbers missing between them, at most kMaxFrames of a folder
};

// Sorted by name. The frame number is the last group of digits before the extension
// (PathPattern::literal_frame()); names that differ only in it form one sequence, and any other
// file is a sequence of one frame. Skips temporaries and subfolders. Errors (input): the folder
// cannot be read, or has no EXR file.
Result<std::vector<FoundSequence>> scan_folder(const std::string& folder);

// The input that the user of a pattern or name without a file probably meant, as --input takes it:
// in the same folder and with the same extension, the same name with another form of the number
// (also for "*"), or else the name spelled most like it. Empty if there is none.
std::string nearest_input(const PathPattern& pattern);

}  // namespace postchain::io
