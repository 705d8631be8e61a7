// What needs OpenImageIO: pictures of other formats than EXR. It is a module of its own, loaded at
// its first use (picture_module.h), because OpenImageIO brings some 250 libraries with it, whose
// loading takes longer than a small frame.
#pragma once

#include <cstdint>
#include <string>

#include "chain/image.h"
#include "chain/status.h"

namespace postchain::io {

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
};

}  // namespace postchain::io

// The one name that the module exports.
extern "C" __attribute__((visibility("default"))) const postchain::io::PictureCalls*
postchain_picture_calls();
