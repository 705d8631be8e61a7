// The report as a page: one HTML file that opens from disk and needs no network.
//
//   tools/page/report + report.json + images and their error maps --> index.html
//
// Images are encoded as encode.h says. They are loaded, encoded and written one at a time.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

struct PageOptions {
    // Folder for the images, created if missing: scripts beside the page, which it loads on
    // demand. For long sequences, whose page would be too large for a browser. Empty: the images
    // are in the page.
    std::string assets_folder;
};

// Writes the page, whole or not at all, after its assets. Errors (output): a file or folder cannot
// be written. Errors (input): a stored image is missing or damaged, or its size is not the listed
// one.
Status write_page(const Report& report, const std::string& path, const PageOptions& options = {});

}  // namespace postchain::report
