// Settings by which an output file differs from its input: compression, type of color, channels.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

// In the order of OpenEXR's own numbers.
enum class ExrMethod { none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab };
const char* name_of(ExrMethod method);

// Compression of a part, written as "zip:4" or "dwaa:45".
struct ExrCompression {
    ExrMethod method = ExrMethod::zip;
    // zips and zip: deflate level, 1..9. dwaa and dwab: OpenEXR's level, 0..1000; larger values
    // give smaller files and larger errors, the default is 45. The others have no level.
    std::optional<float> level = {};

    // NAME or NAME:LEVEL. Errors (usage): unknown name, level out of range or for a method without
    // levels.
    static Result<ExrCompression> parse(std::string_view text);
    bool is_dwa() const { return method == ExrMethod::dwaa || method == ExrMethod::dwab; }
    bool is_zip() const { return method == ExrMethod::zips || method == ExrMethod::zip; }
    // Whether the compression may change values of this channel. PXR24 changes float, B44 half, DWA
    // half and float channels whose name ends in R, G, B, Y, RY or BY.
    // Source: ImfPxr24Compressor.cpp, ImfB44Compressor.cpp, ImfDwaCompressor.cpp of OpenEXR 3.1.
    bool changes(const ExrChannel& channel) const;
};

struct ExrSettings {
    std::optional<ExrCompression> compression;  // color part; unset: as in the input
    bool half = false;                          // float channels of color become half
    std::vector<std::string> channels;          // patterns, * matches any text; empty: all

    // Whether the channel is written.
    bool takes(std::string_view channel) const;
};

// Whether `name` matches `pattern`, in which * matches any text.
bool matches(std::string_view pattern, std::string_view name);

}  // namespace postchain::io
