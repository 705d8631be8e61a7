// How the pixels of a part are cut into chunks (blocks of lines, or tiles), and how they lie in
// one.
//
// Source: "OpenEXR File Layout" (openexr.com). In a chunk: each line from top to bottom, of it each
// channel in the order of the header, of it each sample from left to right; numbers little-endian.
// ZIP and ZIPS then pack the whole chunk (zip_bytes.h, zlib_stream.h), or leave it where it would
// not become smaller.
#pragma once

#include <ImfHeader.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/sequence/exr/part_pixels.h"

namespace postchain::io {

struct ChunkLayout {
    Window window;                     // of the part's data
    std::vector<ExrChannel> channels;  // in the order of the header
    bool tiled = false;
    int columns = 0;  // pixels of a chunk, at most
    int rows = 0;
    bool packed = false;       // ZIP or ZIPS
    bool from_bottom = false;  // DECREASING_Y: the last lines come first in the file

    // Nothing for a part that is left to OpenEXR: deep, of unknown type, of another compression, or
    // on a machine that is not little-endian.
    static std::optional<ChunkLayout> of(const Imf::Header& header);

    int across() const { return (window.width() + columns - 1) / columns; }
    int down() const { return (window.height() + rows - 1) / rows; }
    // Of the full size, in the order of the table of chunks, which has them first.
    size_t count() const { return size_t(across()) * size_t(down()); }
    Window area(size_t chunk) const;
    size_t bytes(const Window& area) const;
    size_t most_bytes() const;  // no chunk has more
    // The chunk that comes `n`-th in a file that is written.
    size_t nth_written(size_t n) const;

    // The samples that one channel has in one line of a chunk.
    struct Row {
        size_t channel;
        int y;
        size_t at;  // in the chunk, bytes
        size_t bytes;
    };
    // visit(row) in the order of the chunk.
    template <class Visit>
    void each_row(const Window& area, const Visit& visit) const;
};

// Where the samples of `plane`, whose pixels are `window`, begin for line `y` from column `x` on.
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

}  // namespace postchain::io
