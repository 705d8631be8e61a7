// Images of a report, one EXR file each in DIR/images: written as they are made, read one at a
// time. 32-bit float, ZIP, so the page shows the measured values.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report {

inline constexpr const char* kImageFolder = "images";

// An entry with the path images/NAME.0010.exr.
StoredImage stored_image(ImageKind kind, int variant, int frame, const std::string& name,
                         const std::string& map = {});

// Writes RGB (of 3 or more channels) or the one channel to report.folder and names it in
// report.images; an entry of the same path and variant is replaced. Errors (output).
Status store_image(Report& report, StoredImage entry, const ImageF& pixels);

// Names an image that an earlier run has written; false if it is missing or incomplete.
bool take_stored_image(Report& report, StoredImage entry);

// RGB (or the one channel) of a stored image. Errors (input): the file is missing or damaged.
Result<ImageF> load_image(const Report& report, const StoredImage& image);

}  // namespace postchain::report
