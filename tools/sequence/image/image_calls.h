// Functions that need OpenImageIO: formats other than EXR. They are in a module that is loaded at
// its first use (image_module()), because OpenImageIO depends on some 250 libraries, which take
// longer to load than a small frame takes to filter.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// An image as its file stores it: three or four channels, red, green, blue, alpha.
struct ImageInfo {
    std::string format;  // in OpenImageIO's words
    int width = 0, height = 0;
    int x = 0, y = 0;  // position of the first pixel
    int display_x = 0, display_y = 0, display_width = 0, display_height = 0;
    float pixel_aspect = 1;
    int channels = 3;
    int bits = 8;  // bits of a value: 8, 10, 12, 16; 32: float, also for half
    bool is_float = false;
    bool unassociated = false;  // color is not multiplied by alpha
    std::string color_space;    // stated by the file, OpenImageIO's name; empty: none
    bool has_more = false;      // has further images (pages)
    std::map<std::string, std::string> attributes;
};

// An image to write.
struct ImageToWrite {
    ImageInfo info;             // format, windows, channels, bits, alpha, color space
    const void* values;         // uint16_t of the whole range of 16 bits, or float
    std::string metadata_of;    // file whose metadata are kept; may be empty
    int metadata_part = 0;      // part of that file
    bool same_transfer = true;  // same transfer as that file: keep its color profile
    std::string compression;  // TIFF's compression, OpenImageIO's name; empty: its lossless default
    std::map<std::string, std::string> attributes;  // additional
};

// The sources of a configuration's transforms.
struct OcioSources {
    // Absolute paths: the configuration's file, then each file that its transforms name, in every
    // folder of its search path, whether it exists or not. Files named in turn by those are not
    // included.
    std::vector<std::string> files;
    std::map<std::string, std::string> variables;  // context variables that its text names
};

struct ImageCalls {
    const char* version;        // version of postchain that the module was built with
    const char* open_image_io;  // version of OpenImageIO
    // The published color map magma, display-referred sRGB, of one channel of 0..1, three channels.
    Result<Image<uint8_t>> (*magma_of)(const ImageF& values);
    // The display window of a square image in gray, at most `max_side` pixels on a side; see
    // read_aperture_image(). Errors (input), without the path.
    Result<ImageF> (*read_gray)(const std::string& path, int max_side);
    // Reads the header of a file of this format. Errors (input), without the path: unreadable,
    // another format, content outside ImageInfo (gray, deep, volumes, integers of 32 bits).
    Result<ImageInfo> (*describe)(const std::string& path, const std::string& format);
    // Reads the stored values, integers as code / (2^bits - 1). Errors (input), without the path:
    // damaged or truncated.
    Result<ImageF> (*read_stored)(const std::string& path, const ImageInfo& info);
    // The bytes of a file. Errors (output): the encoder's.
    Result<std::string> (*encode)(const ImageToWrite& picture);
    // Convert the first three channels in place by a configuration of OpenColorIO: from a color
    // space to the frames' space, from the frames' space to a color space, or to a display view.
    // Values must be finite. Errors: (input) the configuration cannot be used; (usage) unknown
    // name, with the known ones.
    Status (*from_space)(ImageF& color, const OcioSpace& space);
    Status (*to_space)(ImageF& color, const OcioSpace& space);
    Status (*to_view)(ImageF& color, const DisplayView& view);
    // Errors (input): missing file, OpenColorIO cannot read it.
    Result<OcioSources> (*ocio_sources)(const std::string& config);
};

}  // namespace postchain::io

// The module's only exported symbol.
extern "C" __attribute__((visibility("default"))) const postchain::io::ImageCalls*
postchain_image_calls();
