#include "tools/sequence/exr/exr_chunk_layout.h"

#include <ImfChannelList.h>
#include <ImfPartType.h>

#include <algorithm>
#include <bit>

#include "chain/text.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_part_check.h"

namespace postchain::io {

namespace {

ChunkLayout layout_of(const Imf::Header& header, bool tiled) {
    ChunkLayout layout;
    layout.tiled = tiled;
    const Imf::Compression compression = header.compression();
    layout.packed = compression == Imf::ZIP_COMPRESSION || compression == Imf::ZIPS_COMPRESSION;
    layout.window = window_of(header.dataWindow());
    layout.columns = tiled ? int(header.tileDescription().xSize) : layout.window.width();
    layout.rows =
        tiled ? int(header.tileDescription().ySize) : lines_of_chunk(int(header.compression()));
    layout.whole_chunk_pixels = uint64_t(layout.columns) * uint64_t(layout.rows);
    layout.columns = std::min(layout.columns, layout.window.width());
    layout.rows = std::min(layout.rows, layout.window.height());
    layout.from_bottom = header.lineOrder() == Imf::DECREASING_Y;
    layout.channels = channels_in(header);
    return layout;
}

}  // namespace

std::optional<ChunkLayout> ChunkLayout::of(const Imf::Header& header) {
    const bool tiled = header.hasTileDescription();
    if (header.hasType() && header.type() != (tiled ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE))
        return {};
    const ChunkLayout layout = layout_of(header, tiled);
    if (!layout.packed && header.compression() != Imf::NO_COMPRESSION) return {};
    if (std::endian::native != std::endian::little) return {};
    return layout;
}

ChunkLayout ChunkLayout::of_deep(const Imf::Header& header) {
    return layout_of(header, header.type() == Imf::DEEPTILE);
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

ChunkRange ChunkLayout::chunks_with(const Window& lines) const {
    const auto row_of = [&](int y) { return size_t(y - window.min_y) / size_t(rows); };
    const size_t first = row_of(lines.min_y), last = row_of(lines.max_y);
    return {first * size_t(across()), (last - first + 1) * size_t(across())};
}

std::string ChunkLayout::name(size_t chunk) const {
    const Window there = area(chunk);
    return tiled ? concat("tile ", there.text())
                 : concat("lines ", there.min_y, " to ", there.max_y);
}

size_t ChunkLayout::nth_written(size_t n) const {
    const size_t column = n % size_t(across()), row = n / size_t(across());
    return (from_bottom ? size_t(down()) - 1 - row : row) * size_t(across()) + column;
}

}  // namespace postchain::io
