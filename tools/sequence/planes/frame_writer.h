// Writes the input EXR with its color replaced.
//
//   color's file, StoredFrame, color --write_filtered--> the input file, color channels replaced:
//     color's part    every channel in its own type; other channels keep the bytes that were read
//     a layer's part  as color's part, if an extra layer in it is filtered
//     other parts     chunk by chunk as stored (copyPixels): flat, tiled, mip-mapped and deep alike
//
// A deep part of color becomes a flat one, with every channel as it was read.
//
// If no color value has changed, and the compression is lossy and the input's, the chunks of
// color's part are copied too: encoding them again would add an error.
//
// Kept: channel set, types and names, windows, compression, line order, tiling, pixel aspect,
// views, every attribute that stays valid. Dropped, since they describe the unfiltered image:
// preview, oiio:SHA-1, oiio:AverageColor, oiio:ConstantColor.
// Lossy compression (PXR24, B44, B44A, DWAA, DWAB) of color's part is kept only if the part has no
// other channels; otherwise it becomes ZIP, since depth, motion vectors and all other channels are
// always written lossless. WriteOptions::exr may set another compression. A mip- or rip-mapped
// color part is written with only its full-size level, since the others would show the unfiltered
// image. WriteReport::notes lists both changes.
#pragma once

#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/exr/write_options.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::io {

// Channels of color's file that are replaced or added: color, and others in addition to it.
struct FilteredLayer {
    int part = 0;                       // its data window is that of color's part
    std::vector<std::string> channels;  // names, in the order of the image's channels
    const ImageF* image = nullptr;      // covers StoredFrame::window
    bool ids = false;                   // not color: the bits are written unchanged
    bool added =
        false;  // the file has no such channels: halves, whatever ExrSettings::channels says
};

// Writes color's file with its color channels and those of `layers` replaced. `frame`: read from it
// with Keep::all. The image of `color` has 4 channels; alpha is written if the file has it. If the
// written data window is larger than the file's, other channels are StoredFrame::outside there.
// Errors (output): the path (see AtomicFile), write errors, and with `refuse` values above the
// range of half, NaN and Inf (with `clamp` NaN becomes 0, the others the largest value of the
// channel's type); (input): check_rewritable(), damaged data in a copied part; (usage): settings
// that check_rewritable() refuses.
Result<WriteReport> write_filtered(const std::string& path, PixelFile& file,
                                   const StoredFrame& frame, const FilteredLayer& color,
                                   const WriteOptions& options,
                                   const std::vector<FilteredLayer>& layers = {});

// Checks from the header whether write_filtered() can write the file. Errors (input): a part of
// unknown type, which cannot be copied; an attribute of color's part with the name of one of
// WriteOptions::attributes that is not a string; (usage): WriteOptions::exr does not fit the file.
Status check_rewritable(PixelFile& file, const RoleChannels& color, const WriteOptions& options);

// The corresponding check for a new EXR with the color channels of another format.
Status check_new_exr(const PixelFile& file, const RoleChannels& color, const WriteOptions& options);

}  // namespace postchain::io
