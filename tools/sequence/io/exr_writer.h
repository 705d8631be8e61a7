// Writing EXR: the input file with its color replaced, planes of our own.
//
//   InputFrame + color --write_filtered--> the input file, color channels replaced:
//     color's part    every channel in its own type; what is not color comes from the bytes read
//     a layer's part  the same, where a further layer is filtered
//     other parts     chunk by chunk as stored (copyPixels): flat, tiled, mip-mapped and deep alike
//
// Kept: channel set, types and names, windows, compression, line order, tiling, pixel aspect,
// views, every attribute that stays true. Dropped because they describe the unfiltered picture:
// preview, oiio:SHA-1, oiio:AverageColor, oiio:ConstantColor.
// Lossy compression (PXR24, B44, B44A, DWAA, DWAB) of color's part is kept only where the part
// holds nothing but color; else it becomes ZIP, since depth, vectors and all other channels are
// only ever written lossless. A mip- or rip-mapped color part is written with its full-size level
// alone: the smaller ones would show the unfiltered picture. Both are said in WriteReport::notes.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/io/atomic_file.h"
#include "tools/sequence/io/frame_reader.h"

namespace postchain::io {

inline constexpr float kMaxHalf = 65504;

enum class HalfOverflow {
    refuse,  // an error that counts them
    clamp,   // to the largest value of the channel's type, counted
};

struct WriteOptions {
    OnExisting on_existing = OnExisting::fail;
    HalfOverflow overflow = HalfOverflow::refuse;
    int zip_level = kZipLevel;
    // Data window of color's part, grown outwards where its subsampled channels need that. The
    // file's own when not given.
    std::optional<Window> window = {};
    // String attributes of color's part ("postchain" -> version and chain hash).
    std::map<std::string, std::string> attributes = {};
    // Asked when all is written and the file has not got its name yet; an error ends it.
    std::function<Status()> before_commit = {};

    // Level of deflate for ZIP and ZIPS, 0 (stored) to 9. On the 25.8 MB of a 1280x720 Cycles frame (4
    // half, 5 float channels), milliseconds on one core and size of what comes out:
    //
    //   level         1     2     4     5     6     9
    //   libdeflate  106   124   133   149   156   386 ms   8.26  8.31  8.25  8.19  8.17  8.14 MB
    //   zlib        204   215   263   301   348  1582      8.64  8.55  8.18  8.13  8.09  8.05
    //
    // Files at libdeflate's 1 are a hundredth larger than at OpenEXR's default, zlib's 4.
    static constexpr int kZipLevel = 1;
};

struct WriteReport {
    bool skipped = false;            // on_existing skip, and there was a file
    uint64_t overflow_pixels = 0;    // clamped
    uint64_t nonfinite_pixels = 0;   // NaN or Inf; in color clamped too, planes keep them
    uint64_t bytes = 0;              // of the file
    std::vector<std::string> notes;  // what was changed besides color
};

// Channels of a part of color's file that are replaced besides color.
struct FilteredLayer {
    int part = 0;                       // its data window is that of color's part
    std::vector<std::string> channels;  // of the part, in the order of the image's channels
    const ImageF* image = nullptr;      // covers InputFrame::window
    bool ids = false;                   // no color: the bits are written as they are
};

// Writes `frame` (read with Keep::all) with its color channels and those of `layers` replaced.
// `color` covers `frame.window` and has 4 channels; alpha is written where the file has it. Where
// the data window written is larger than the file's, other channels hold InputFrame::outside there.
// Errors (output): the path (see AtomicFile), write errors, and under `refuse` values beyond a half
// channel, NaN and Inf (under `clamp` NaN becomes 0, the others the largest value of the channel's
// type); (input): check_rewritable(), damaged data in a part that is copied.
Result<WriteReport> write_filtered(const std::string& path, InputFrame& frame, const ImageF& color,
                                   const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers = {});

// Whether write_filtered() can write the file back, from its header alone. Errors (input): a part
// of unknown type, which cannot be copied; an attribute of color's part that has the name of one of
// `attributes` and is no text.
Status check_rewritable(ExrFile& file, int color_part,
                        const std::map<std::string, std::string>& attributes);

using AttributeValue = std::variant<std::string, float, int>;

// A single-part file made of planes: stages, scenes.
struct PlaneChannel {
    std::string name;  // in the file
    PixelType type = PixelType::float32;
    const ImageF* image = nullptr;
    int index = 0;  // channel of the image
};
struct PlanesFile {
    std::vector<PlaneChannel> channels;  // images of one size
    std::map<std::string, AttributeValue> attributes;
    int origin_x = 0;  // of the data window
    int origin_y = 0;
    std::optional<Window> display_window;  // the data window when not given
};
// ZIP, scanlines. Half channels follow `overflow`; Inf and NaN of a half channel are written as
// they are where the plane has them. Errors (output); (internal): sizes that differ, no channels.
Result<WriteReport> write_planes_exr(const std::string& path, const PlanesFile& file,
                                     const WriteOptions& options = {});
// All channels of one image as float.
Result<WriteReport> write_planes_exr(const std::string& path, const ImageF& image,
                                     const std::vector<std::string>& names,
                                     OnExisting on_existing = OnExisting::fail);

// The bytes of such a file.
Result<std::string> planes_exr_bytes(const ImageF& image, const std::vector<std::string>& names);

}  // namespace postchain::io
