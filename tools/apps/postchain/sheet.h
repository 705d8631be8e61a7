// postchain sheet: a contact sheet, one image with thumbnails of a sequence.
//
//   frames of IN, evenly chosen --read, shrink, show--> thumbnails with their numbers --> one PNG
#pragma once

#include "tools/apps/postchain/options.h"

namespace postchain {

struct SheetOptions {
    std::string output;
    std::string beside;  // a second pattern; empty = none
    int cells = 60;      // maximum
    int columns = 0;     // 0 = chosen so that the sheet is about 16:9
    int width = 240;     // of a thumbnail, pixels
    io::OnExisting on_existing = io::OnExisting::fail;
};
void add_sheet(CLI::App& subcommand, Options& options, SheetOptions& sheet);
int sheet_subcommand(const Options& options, const SheetOptions& sheet);

}  // namespace postchain
