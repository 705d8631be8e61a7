// Writes filtered color in formats other than EXR.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {

struct ImageSettings {
    std::optional<Transfer> transfer;  // default: the input's, otherwise the format's
    int bits = 0;                      // bits of a value; 0: as the input, if the format has them
};

// How an image is stored.
struct ImageEncoding {
    const ImageFormat* format = nullptr;
    int bits = 8;
    bool alpha = false;
    bool unassociated = false;  // PNG: always; TIFF: as the input
    Transfer transfer = Curve::srgb;
    std::string color_space;         // that the file states, OpenImageIO's name; may be empty
    float pixel_aspect = 1;          // of the display window
    bool same_transfer = true;       // as the input: its color profile is kept
    std::string compression;         // TIFF: the input's, if lossless; may be empty
    std::vector<std::string> notes;  // losses compared with the input
};
// Chosen from the frame's header. Errors (usage): bits that the format does not support.
Result<ImageEncoding> image_encoding(const std::string& path, const PixelFile& color_file,
                                     size_t color_channels, const ImageSettings& settings);

// Writes `color`: four linear channels of the display window, multiplied by alpha unless
// ImageEncoding::unassociated is set. Values outside the format's range (after rounding) and
// non-finite ones are an error (output), or with HalfOverflow::clamp clamped and counted: NaN
// becomes 0, and Inf becomes the largest half before a transform of OpenColorIO. No dither. Keeps
// metadata of part `metadata_part` of the input that the format supports. Also errors of
// ImageCalls::to_space and to_view.
Result<WriteReport> write_picture(const std::string& path, const ImageF& color,
                                  const ImageEncoding& encoding, const std::string& metadata_of,
                                  int metadata_part, const WriteOptions& options);

}  // namespace postchain::io
