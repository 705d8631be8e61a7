// Reads images of apertures from files (chain/frame/bokeh_kernel.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::io {

// The longest side of an aperture image, pixels.
inline constexpr int kMaxApertureSide = 4096;

// Reads any format of OpenImageIO: the display window of the file's first image. Values are not
// decoded, even of sRGB files; integers become 0 to 1. Uses the Rec. 709 luminance of color (the
// first three channels), otherwise the first channel; with alpha, color is premultiplied. Averages
// over each cell of the table.
// Errors (input), with the path: missing, unreadable, deep, larger than kMaxApertureSide, not
// square, a negative or non-finite value (with its pixel), and those of BokehKernel::make().
Result<BokehKernel> read_aperture_image(const std::string& path);

// The image that a camera names, as a file that a job reads; empty if it names none.
std::vector<InputFile> inputs_of(const Camera& camera);

// Reads the images that cameras name, each file once.
class ApertureFiles {
  public:
    // Reads the camera's image if it names one. Errors: those of read_aperture_image().
    Status read(Camera& camera);

  private:
    std::map<std::string, BokehKernel> read_;
};

}  // namespace postchain::io
