// The report as a page: one HTML file that opens from disk and needs no network.
//
//   dist/page.html (built from src/, inside the program)  + report.json + pictures --> index.html
//
// Pictures travel as encode.h says. They are loaded, encoded and written one at a time.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

struct PageOptions {
    // A folder for the pictures, made when missing: scripts beside the page, which it loads when
    // they are wanted. For long sequences, whose page would be too large for a browser. Empty: the
    // pictures are in the page.
    std::string assets_folder;
};

// Writes the page, whole or not at all; assets before it. Errors (output): a file or folder cannot
// be written. Errors (input): a stored image is gone or damaged, or not of the size it is listed
// with.
Status write_page(const Report& report, const std::string& path, const PageOptions& options = {});

}  // namespace postchain::report
