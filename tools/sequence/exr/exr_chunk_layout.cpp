#include "tools/sequence/exr/exr_chunk_layout.h"

#include <ImfChannelList.h>
#include <ImfPartType.h>

#include <algorithm>
#include <bit>

#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_part_check.h"

namespace postchain::io {

std::optional<ChunkLayout> ChunkLayout::of(const Imf::Header& header) {
    ChunkLayout layout;
    layout.tiled = header.hasTileDescription();
    if (header.hasType() && header.type() != (layout.tiled ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE))
        return {};
    const Imf::Compression compression = header.compression();
    layout.packed = compression == Imf::ZIP_COMPRESSION || compression == Imf::ZIPS_COMPRESSION;
    if (!layout.packed && compression != Imf::NO_COMPRESSION) return {};
    if (std::endian::native != std::endian::little) return {};
    layout.window = window_of(header.dataWindow());
    layout.columns = layout.tiled ? int(header.tileDescription().xSize) : layout.window.width();
    layout.rows = layout.tiled ? int(header.tileDescription().ySize)
                               : lines_of_chunk(int(header.compression()));
    layout.columns = std::min(layout.columns, layout.window.width());
    layout.rows = std::min(layout.rows, layout.window.height());
    layout.from_bottom = header.lineOrder() == Imf::DECREASING_Y;
    layout.channels = channels_in(header);
    return layout;
}

Window ChunkLayout::area(size_t chunk) const {
    const int column = int(chunk % size_t(across())), row = int(chunk / size_t(across()));
    Window area;
    area.min_x = window.min_x + column * columns;
    area.min_y = window.min_y + row * rows;
    area.max_x = std::min(area.min_x + columns - 1, window.max_x);
    area.max_y = std::min(area.min_y + rows - 1, window.max_y);
    return area;
}

size_t ChunkLayout::bytes(const Window& area) const {
    size_t sum = 0;
    for (const ExrChannel& c : channels)
        sum += size_t(samples_between(area.min_x, area.max_x, c.x_sampling)) *
               size_t(samples_between(area.min_y, area.max_y, c.y_sampling)) *
               size_t(bytes_of(c.type));
    return sum;
}

size_t ChunkLayout::most_bytes() const {
    const auto most = [](int pixels, int sampling) {
        return size_t((pixels + sampling - 1) / sampling);
    };
    size_t sum = 0;
    for (const ExrChannel& c : channels)
        sum += most(columns, c.x_sampling) * most(rows, c.y_sampling) * size_t(bytes_of(c.type));
    return sum;
}

size_t ChunkLayout::nth_written(size_t n) const {
    const size_t column = n % size_t(across()), row = n / size_t(across());
    return (from_bottom ? size_t(down()) - 1 - row : row) * size_t(across()) + column;
}

}  // namespace postchain::io
