// The chunks of a part (blocks of lines, or tiles): their layout, and pixels unpacked from them and
// packed into them on the threads of WorkerPool.
//
//   table of chunks --> pread, sizes checked --> inflate --> words joined --> rows of the planes
//   rows of the planes --> words split --> differences --> deflate --> the stream, a few at a time
//
// Reading checks every statement of the file: a chunk must match its place in the table, end within
// the file, and hold exactly the bytes of its pixels.
//
// Source: "OpenEXR File Layout" (openexr.com). A chunk holds its lines from top to bottom. A line
// holds the channels in the order of the header, each with its samples from left to right. Numbers
// are little-endian. ZIP and ZIPS then pack the whole chunk (zip.h), unless it would grow.
#pragma once

#include <ImfHeader.h>
#include <ImfIO.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

struct ChunkRange {
    size_t first = 0;
    size_t count = 0;
};

struct ChunkLayout {
    Window window;                     // the part's data window
    std::vector<ExrChannel> channels;  // in the order of the header
    bool tiled = false;
    int columns = 0;  // largest width of a chunk, pixels
    int rows = 0;
    uint64_t whole_chunk_pixels = 0;  // pixels of a tile that the data window does not cut
    bool packed = false;              // ZIP or ZIPS
    bool from_bottom = false;         // DECREASING_Y: the last lines are first in the file

    // Empty for parts that OpenEXR reads and writes: deep parts, unknown types, other compressions,
    // and every part on a big-endian machine.
    static std::optional<ChunkLayout> of(const Imf::Header& header);
    // The chunks of a deep part. The sizes in bytes are those of one sample for each pixel.
    static ChunkLayout of_deep(const Imf::Header& header);

    int across() const { return (window.width() + columns - 1) / columns; }
    int down() const { return (window.height() + rows - 1) / rows; }
    // Chunks of the full-size level, which are the first ones in the table of chunks.
    size_t count() const { return size_t(across()) * size_t(down()); }
    Window area(size_t chunk) const;
    size_t bytes(const Window& area) const;
    size_t most_bytes() const;  // size of the largest chunk
    // The chunks with at least one line of `window`, which has a line of the layout's.
    ChunkRange chunks_with(const Window& window) const;
    std::string name(size_t chunk) const;  // "lines 0 to 15", "tile (0, 0)-(63, 63)"
    // Index of the `n`-th chunk to write.
    size_t nth_written(size_t n) const;

    // The samples of one channel in one line of a chunk.
    struct Row {
        size_t channel;
        int y;
        size_t at;  // offset in the chunk, bytes
        size_t bytes;
    };
    // visit(row) in the order of the chunk.
    template <class Visit>
    void each_row(const Window& area, const Visit& visit) const;
};

// Byte offset of the sample at column `x` of line `y` in `plane`, which covers `window`.
inline size_t place_in_plane(const PartPixels::Plane& plane, const Window& window, int x, int y) {
    const ExrChannel& c = plane.channel;
    return size_t(samples_between(window.min_y, y - 1, c.y_sampling)) * plane.row_bytes() +
           size_t(samples_between(window.min_x, x - 1, c.x_sampling)) * size_t(bytes_of(c.type));
}

template <class Visit>
void ChunkLayout::each_row(const Window& area, const Visit& visit) const {
    size_t at = 0;
    for (int y = area.min_y; y <= area.max_y; ++y) {
        for (size_t i = 0; i < channels.size(); ++i) {
            const ExrChannel& c = channels[i];
            if (y % c.y_sampling != 0) continue;
            const size_t bytes = size_t(samples_between(area.min_x, area.max_x, c.x_sampling)) *
                                 size_t(bytes_of(c.type));
            visit(Row{i, y, at, bytes});
            at += bytes;
        }
    }
}

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

// Errors (input) with the remedy.
Status damaged_header(const std::string& what);
Status chunk_is_damaged(const char* what);
Status chunk_is_cut();

// Fills the planes of `pixels`, which are channels of the layout. At least one line of its window
// must be in the layout's window. Errors (input), with the lines or the tile: damaged, truncated;
// (memory).
Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels);

// Appends all chunks of the full-size level, and fills in the part's table of chunks, which OpenEXR
// left empty at the file offset `table`. `planes`: one for each channel of the layout, in any
// order. `part`: part number, only for multi-part files. `level`: deflate level (zip.h). Errors
// (output): a chunk of 2 GiB or more; (memory). Throws the exceptions of the stream.
Status write_chunks(Imf::OStream& stream, const ChunkLayout& layout, const PartPlanes& planes,
                    std::optional<int> part, int level, uint64_t table);

}  // namespace postchain::io
