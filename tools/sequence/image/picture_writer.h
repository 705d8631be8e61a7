// Writing filtered color as a picture of another format than EXR.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/image.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/image/picture_format.h"

namespace postchain::io {

struct PictureSettings {
    std::optional<Transfer> transfer;  // none: the input's where it has one, else the format's
    int bits = 0;                      // of a value; 0: as the input where the format has them
};

// How the picture of a frame is stored.
struct PictureEncoding {
    const PictureFormat* format = nullptr;
    int bits = 8;
    bool alpha = false;
    bool unassociated = false;  // PNG always, TIFF where the input has it so
    Transfer transfer = Curve::srgb;
    std::string color_space;    // that the file says, in OpenImageIO's words; may be empty
    bool same_transfer = true;  // as the input: a profile of its color is still true
    std::string compression;    // of TIFF, that of its input where it loses nothing; may be empty
    std::vector<std::string> notes;  // what of the input is not in the output
};
// From the frame's header. Errors (usage): bits that the format has not.
Result<PictureEncoding> picture_encoding(const std::string& path, const PixelFile& color_file,
                                         size_t color_channels, const PictureSettings& settings);

// Writes `color` as `encoding` has it: four channels of the display window, linear, multiplied by
// alpha or not as PictureEncoding::unassociated says. A value that lies further outside the
// format's range than its rounding is an error (output), or clamped and counted under
// HalfOverflow::clamp, as is what is not finite (NaN becomes 0; before a configuration's transform
// Inf becomes the largest half). No dither. Metadata of part `metadata_part` of the input are kept
// where the format has a place for them. Errors besides: those of PictureCalls::to_space, to_view.
Result<WriteReport> write_picture(const std::string& path, const ImageF& color,
                                  const PictureEncoding& encoding, const std::string& metadata_of,
                                  int metadata_part, const WriteOptions& options);

}  // namespace postchain::io
