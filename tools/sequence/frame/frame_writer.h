// Writing an EXR back: the input file with its color replaced.
//
//   InputFrame + color --write_filtered--> the input file, color channels replaced:
//     color's part    every channel in its own type; what is not color comes from the bytes read
//     a layer's part  the same, where a further layer is filtered
//     other parts     chunk by chunk as stored (copyPixels): flat, tiled, mip-mapped and deep alike
//
// Where every value of color is the one that was read, and the compression is lossy and the
// input's, the chunks of color's part are copied too: packed anew they would be a little further
// off.
//
// Kept: channel set, types and names, windows, compression, line order, tiling, pixel aspect,
// views, every attribute that stays true. Dropped because they describe the unfiltered picture:
// preview, oiio:SHA-1, oiio:AverageColor, oiio:ConstantColor.
// Lossy compression (PXR24, B44, B44A, DWAA, DWAB) of color's part is kept only where the part
// holds nothing but color; else it becomes ZIP, since depth, vectors and all other channels are
// only ever written lossless; WriteOptions::exr may ask for another one. A mip- or rip-mapped color
// part is written with its full-size level alone: the smaller ones would show the unfiltered
// picture. Both are said in WriteReport::notes.
#pragma once

#include <string>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/frame/frame_reader.h"

namespace postchain::io {

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
// type); (input): check_rewritable(), damaged data in a part that is copied; (usage): settings that
// check_rewritable() refuses.
Result<WriteReport> write_filtered(const std::string& path, InputFrame& frame, const ImageF& color,
                                   const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers = {});

// Whether write_filtered() can write the file back, from its header alone. Errors (input): a part
// of unknown type, which cannot be copied; an attribute of color's part that has the name of one of
// WriteOptions::attributes and is no text; (usage): WriteOptions::exr does not suit the file.
Status check_rewritable(PixelFile& file, const RoleChannels& color, const WriteOptions& options);

// The same of a new file of the color channels of a picture that is no EXR.
Status check_new_exr(const PixelFile& file, const RoleChannels& color, const WriteOptions& options);

}  // namespace postchain::io
