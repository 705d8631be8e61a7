// The chunks of one part, unpacked on the threads of WorkerPool.
//
//   table of chunks --> pread, sizes checked --> inflate --> words joined --> rows of the planes
//
// Every statement of the file is checked: a chunk must match its place in the table, end within the
// file, and hold exactly the bytes of its pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "chain/status.h"
#include "tools/sequence/exr/exr_chunk_layout.h"

namespace postchain::io {

struct ChunkSource {
    int fd = -1;
    std::span<const uint64_t> offsets;  // the part's table of chunks, from scan_header()
    std::optional<int> part;            // part number; only for multi-part files
};

// Fills the planes of `pixels`, which are channels of the layout. At least one line of its window
// must be in the layout's window. Errors (input), with the lines or the tile: damaged, truncated;
// (memory).
Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels);

}  // namespace postchain::io
