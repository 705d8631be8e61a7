// A contact sheet: one image with thumbnails of a sequence.
//
//   frames, evenly chosen --read, shrink, show--> thumbnails with their numbers --> one PNG
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/sequence/settings/run_settings.h"

namespace postchain::sequence {

struct SheetSettings {
    RunSettings run;  // input, frames, source; parsed with RunChoices::preview, for the view
    std::string output;
    std::string beside;  // a second pattern; empty = none
    int cells = 60;      // maximum
    int columns = 0;     // 0 = chosen so that the sheet is about 16:9
    int width = 240;     // width of a thumbnail, pixels
    io::OnExisting on_existing = io::OnExisting::fail;
};

struct SheetReport {
    size_t frames = 0, of = 0;            // on the sheet, and of the sequence
    size_t absent = 0;                    // images that are not on disk
    std::vector<std::string> unreadable;  // why, an entry for each image
};

// Called before each frame; false ends the sheet.
using SheetProgress = std::function<bool(int frame, size_t done, size_t total)>;

// Images that are missing or unreadable are marked on the sheet. Errors: (usage) names of outputs,
// a sheet that is too large; (input) no frame is readable; (output); (canceled).
Result<SheetReport> make_sheet(const SheetSettings& sheet, const SheetProgress& progress);

}  // namespace postchain::sequence
