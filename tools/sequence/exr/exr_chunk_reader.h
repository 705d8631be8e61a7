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

    // False if the file ends too early.
    bool read_at(uint64_t at, void* to, size_t count) const;
    // Reads and checks the begin of a chunk, its part and its line or tile, and moves `at` behind
    // it. Errors (input): truncated, or another chunk at this offset.
    Status check_place(const ChunkLayout& layout, size_t chunk, uint64_t& at) const;
};

Status chunk_is_damaged(const char* what);
Status chunk_is_cut();

// Fills the planes of `pixels`, which are channels of the layout. At least one line of its window
// must be in the layout's window. Errors (input), with the lines or the tile: damaged, truncated;
// (memory).
Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels);

}  // namespace postchain::io
