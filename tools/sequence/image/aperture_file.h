// Pictures of apertures, read from files (chain/aperture_image.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::io {

// The longest side of a picture, pixels.
inline constexpr int kMaxApertureSide = 4096;

// Any format that OpenImageIO reads: the first picture of the file, its display window. Values are
// taken as they are, those of integer formats from 0 to 1: an sRGB file is not decoded. Of color
// (the first three channels) the Rec. 709 luminance counts, else the first channel; where there is
// alpha, color is premultiplied. The mean over each cell of the table is taken.
// Errors (input), with the path: missing, unreadable, deep, larger than kMaxApertureSide, not
// square, a value that is negative or not finite (its pixel), and those of ApertureImage::make().
Result<ApertureImage> read_aperture_image(const std::string& path);

// The picture that a camera names, as a file that a job reads; nothing where it names none.
std::vector<InputFile> inputs_of(const Camera& camera);

// Reads the pictures that cameras name, each file once.
class ApertureFiles {
  public:
    // Reads the camera's picture if it names one. Errors: those of read_aperture_image().
    Status read(Camera& camera);

  private:
    std::map<std::string, ApertureImage> read_;
};

}  // namespace postchain::io
