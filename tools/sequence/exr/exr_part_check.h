// Checks the sizes in a part's header before OpenEXR allocates memory for them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io {

// The fields of one header that memory depends on, unchecked.
struct PartSizes {
    struct Channel {
        int bytes;  // bytes of a sample
        int32_t x_sampling, y_sampling;
    };
    struct Tile {
        uint32_t width, height;
        uint32_t levels;  // low four bits: 0 one, 1 mip, 2 rip; high: 1 rounds their sizes up
    };
    std::optional<Window> data_window;
    std::vector<Channel> channels;
    bool known = true;  // OpenEXR reads this type; for others only chunk_count is known
    bool tiled = false;
    bool deep = false;
    std::optional<Tile> tile;
    int compression = 0;
    std::optional<int32_t> chunk_count;
    std::optional<std::string> type;  // optional in a single flat part
};

struct PartNeeds {
    uint64_t chunks = 0;            // chunks of all levels
    uint64_t pixel_bytes = 0;       // decoded, without smaller levels and deep samples
    uint64_t least_file_bytes = 0;  // pixel_bytes at the compression's highest ratio
};

// The compression's highest ratio, decoded bytes for one byte of the file:
//
//   none   1      not packed
//   rle    64     a run of 128 bytes in two
//   zip(s) 1032   deflate: 258 bytes in two bits, one for the length, one for the distance
//   piz    454    a run of 255 values of two bytes in nine bits, one for its code, eight for it
//   pxr24  1376   deflate of three bytes for each float of four
//   b44(a) 11     a block of 16 halves in three bytes
//   dwaa/b 66048  deflate of a run of 128 bytes in two (alpha); its other methods give less
//
// 0 for a compression that OpenEXR 3.1 cannot read.
uint64_t most_packed(int compression);

// Lines that a compression packs together; 1 for an unknown one.
int lines_of_chunk(int compression);

// Errors (input): no data window, no channels, sizes above the limits, levels of unknown kind, a
// number of chunks that contradicts the sizes.
Result<PartNeeds> check_part(const PartSizes& part, const ReadLimits& limits);

// The error for a part that is too large for a file of `file_bytes`.
Status too_much_packed(const PartSizes& part, const PartNeeds& needs, uint64_t file_bytes);

}  // namespace postchain::io
