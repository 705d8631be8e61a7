// Whether the sizes that one part's header states may be believed, before OpenEXR allocates by
// them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io {

// Of one header, as far as memory depends on it. Nothing of it has been checked.
struct PartSizes {
    struct Channel {
        int bytes;  // of a sample
        int32_t x_sampling, y_sampling;
    };
    struct Tile {
        uint32_t width, height;
        uint32_t levels;  // low four bits: 0 one, 1 mip, 2 rip; high: 1 rounds their sizes up
    };
    std::optional<Window> data_window;
    std::vector<Channel> channels;
    bool known = true;  // a kind that OpenEXR reads; of others only chunk_count tells of chunks
    bool tiled = false;
    bool deep = false;
    std::optional<Tile> tile;
    int compression = 0;
    std::optional<int32_t> chunk_count;
    std::optional<std::string> type;  // optional in a single flat part
};

struct PartNeeds {
    uint64_t chunks = 0;            // of all levels
    uint64_t pixel_bytes = 0;       // decoded, without what only a level or a deep sample adds
    uint64_t least_file_bytes = 0;  // pixel_bytes packed as densely as the compression can
};

// Bytes that one byte of a file can become, at most, by the compression's own format:
//
//   none   1      as it is
//   rle    64     a run of 128 bytes in two
//   zip(s) 1032   deflate: 258 bytes in two bits, one for the length, one for the distance
//   piz    454    a run of 255 values of two bytes in nine bits, one for its code, eight for it
//   pxr24  1376   deflate of three bytes for each float of four
//   b44(a) 11     a block of 16 halves in three bytes
//   dwaa/b 66048  deflate of a run of 128 bytes in two (alpha); its other ways give less
//
// 0 for a compression that OpenEXR 3.1 does not know.
uint64_t most_packed(int compression);

// Lines that a compression packs together; 1 for one that is unknown.
int lines_of_chunk(int compression);

// Errors (input): no data window, no channels, sizes above the limits, levels of unknown kind,
// another number of chunks than follows from the sizes.
Result<PartNeeds> check_part(const PartSizes& part, const ReadLimits& limits);

// Why a file of `file_bytes` cannot hold the part.
Status too_much_packed(const PartSizes& part, const PartNeeds& needs, uint64_t file_bytes);

}  // namespace postchain::io
