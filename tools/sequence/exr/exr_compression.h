// How OpenEXR packs the pixels of a part, as it is written: "zip:4", "dwaa:45".
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "chain/status.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

// In the order of OpenEXR's own numbers.
enum class ExrMethod { none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab };
const char* name_of(ExrMethod method);

struct ExrCompression {
    ExrMethod method = ExrMethod::zip;
    // Of zips and zip 1..9 (zlib's), of dwaa and dwab 0..1000 (OpenEXR's, more is smaller and
    // coarser; its default is 45). The others have none.
    std::optional<float> level = {};

    // NAME or NAME:LEVEL. Errors (usage): an unknown name, a level where there is none, or outside
    // its range.
    static Result<ExrCompression> parse(std::string_view text);
    bool is_dwa() const { return method == ExrMethod::dwaa || method == ExrMethod::dwab; }
    bool is_zip() const { return method == ExrMethod::zips || method == ExrMethod::zip; }
    // Whether values of this channel may come back different. PXR24: float. B44: half. DWA: half
    // and float whose name ends in R, G, B, Y, RY or BY; everything else it packs lossless.
    // Source: ImfPxr24Compressor.cpp, ImfB44Compressor.cpp, ImfDwaCompressor.cpp of OpenEXR 3.1.
    bool changes(const ExrChannel& channel) const;
};

}  // namespace postchain::io
