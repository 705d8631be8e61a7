// The chunks of one part, unpacked on the threads of WorkerPool.
//
//   table of chunks --> pread, sizes checked --> inflate --> words joined --> rows of the planes
//
// Nothing that the file states is believed: a chunk must be the one that its place in the table
// says, lie in the file, and hold exactly the bytes of its pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "chain/status.h"
#include "tools/sequence/exr/exr_chunk_layout.h"

namespace postchain::io {

struct ChunkSource {
    int fd = -1;
    std::span<const uint64_t> offsets;  // of the part, from scan_header()
    std::optional<int> part;            // the number that chunks of a multi-part file begin with
};

// Fills the planes of `pixels`, channels of the layout; of its window at least one line must be in
// the layout's. Errors (input), each with the lines or the tile: damaged, truncated; (memory).
Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels);

}  // namespace postchain::io
