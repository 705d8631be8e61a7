// What needs OpenImageIO: pictures of other formats than EXR. It is a module of its own, loaded at
// its first use (picture_module.h), because OpenImageIO brings some 250 libraries with it, whose
// loading takes longer than a small frame.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// A picture of three or four channels, red, green, blue, alpha, as its file stores it.
struct PictureInfo {
    std::string format;  // in OpenImageIO's words
    int width = 0, height = 0;
    int x = 0, y = 0;  // of the first pixel
    int display_x = 0, display_y = 0, display_width = 0, display_height = 0;
    float pixel_aspect = 1;
    int channels = 3;
    int bits = 8;  // of a value: 8, 10, 12, 16; 32: float, also where the file has half
    bool is_float = false;
    bool unassociated = false;  // color is not multiplied by alpha
    std::string color_space;    // what the file says, in OpenImageIO's words; empty: nothing
    bool has_more = false;      // pictures after the first: pages
    std::map<std::string, std::string> attributes;
};

// A picture to write.
struct PictureToWrite {
    PictureInfo info;           // format, windows, channels, bits, alpha, color space
    const void* values;         // uint16_t of the whole range of 16 bits, or float
    std::string metadata_of;    // a file whose metadata are kept; may be empty
    int metadata_part = 0;      // of it
    bool same_transfer = true;  // its values mean what these do: a profile of them is still true
    std::string compression;    // of TIFF, in OpenImageIO's words; empty: its default, without loss
    std::map<std::string, std::string> attributes;  // besides
};

struct PictureCalls {
    const char* version;        // of the postchain that the module was built with
    const char* open_image_io;  // version of OpenImageIO
    // The bytes of a PNG file of one (gray) or three (sRGB) channels. Errors (output): the
    // encoder's.
    Result<std::string> (*encode_png)(const Image<uint8_t>& pixels);
    // The published color map magma, display-referred sRGB, of one channel of 0..1, three channels.
    Result<Image<uint8_t>> (*magma_of)(const ImageF& values);
    // The display window of a square picture in gray, at most `max_side` pixels on a side; what is
    // read and what is refused: read_aperture_image(). Errors (input), without the path.
    Result<ImageF> (*read_gray)(const std::string& path, int max_side);
    // What a file of this format holds. Errors (input), without the path: unreadable, another
    // format, what PictureInfo cannot say (gray, deep, volumes, integers of 32 bits).
    Result<PictureInfo> (*describe)(const std::string& path, const std::string& format);
    // Its stored values, integers as code / (2^bits - 1). Errors (input), without the path: damaged
    // or truncated.
    Result<ImageF> (*read_stored)(const std::string& path, const PictureInfo& info);
    // The bytes of a file. Errors (output): the encoder's.
    Result<std::string> (*encode)(const PictureToWrite& picture);
    // The first three channels in place, by a configuration of OpenColorIO: stored values of a
    // color space as the frames have them, and the frames as they are stored in a color space, or
    // as a view shows them. Values are finite. Errors: (input) the configuration cannot be used;
    // (usage) it has no such name, with those that it has.
    Status (*from_space)(ImageF& color, const OcioSpace& space);
    Status (*to_space)(ImageF& color, const OcioSpace& space);
    Status (*to_view)(ImageF& color, const DisplayView& view);
    // The configuration's file, then each that its transforms name, in every folder of its search
    // path, whether there or not; absolute. What those files name themselves is not among them.
    // Errors (input): no such file, none that OpenColorIO can read.
    Result<std::vector<std::string>> (*ocio_files)(const std::string& config);
};

}  // namespace postchain::io

// The one name that the module exports.
extern "C" __attribute__((visibility("default"))) const postchain::io::PictureCalls*
postchain_picture_calls();
