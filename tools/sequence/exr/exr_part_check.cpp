#include "tools/sequence/exr/exr_part_check.h"

#include <algorithm>
#include <bit>

#include "tools/sequence/exr/exr_compression.h"

namespace postchain::io {

namespace {

struct Compression {
    uint64_t lines;        // lines of a chunk
    uint64_t most_packed;  // derived in exr_part_check.h
};

// Indexed by ExrMethod, which has the file's numbers.
constexpr Compression kCompressions[] = {{1, 1},      {1, 64},     {1, 1032}, {16, 1032},
                                         {32, 454},   {16, 1376},  {32, 11},  {32, 11},
                                         {32, 66048}, {256, 66048}};

const Compression* compression_of(int number) {
    const bool known = number >= 0 && size_t(number) < std::size(kCompressions);
    return known ? &kCompressions[number] : nullptr;
}

std::string mebibytes(uint64_t bytes) {
    return std::to_string(bytes >> 20) + " MiB";
}

Status check_chunk(const std::string& what, uint64_t bytes, const ReadLimits& limits,
                   const char* remedy) {
    if (bytes <= limits.max_chunk_bytes) return {};
    return input_error(concat(what, " takes ", mebibytes(bytes), "; the limit is ",
                              mebibytes(limits.max_chunk_bytes), "; ", remedy));
}

uint64_t up(uint64_t a, uint64_t b) {
    return (a + b - 1) / b;
}

// Tiles along one side of a level.
uint64_t tiles_of_level(uint64_t side, uint64_t tile, int level, bool up_sizes) {
    const uint64_t divisor = uint64_t(1) << level;
    const uint64_t size = up_sizes ? up(side, divisor) : side / divisor;
    return up(std::max<uint64_t>(size, 1), tile);
}

int levels_of(uint64_t side, bool up_sizes) {
    return (up_sizes ? std::bit_width(side - 1) : std::bit_width(side) - 1) + 1;
}

// The number of levels, as in ImfTiledMisc.cpp.
uint64_t count_tiles(uint64_t width, uint64_t height, const PartSizes::Tile& tile) {
    const bool up_sizes = (tile.levels >> 4) == 1;
    const uint32_t mode = tile.levels & 0xf;
    const auto across = [&](int level) {
        return tiles_of_level(width, tile.width, level, up_sizes);
    };
    const auto down = [&](int level) {
        return tiles_of_level(height, tile.height, level, up_sizes);
    };
    if (mode == 0) return across(0) * down(0);
    uint64_t sum = 0;
    if (mode == 1) {
        const int levels = levels_of(std::max(width, height), up_sizes);
        for (int level = 0; level < levels; ++level) sum += across(level) * down(level);
        return sum;
    }
    uint64_t columns = 0;
    for (int level = 0; level < levels_of(width, up_sizes); ++level) columns += across(level);
    for (int level = 0; level < levels_of(height, up_sizes); ++level) sum += columns * down(level);
    return sum;
}

Status check_chunk_count(const PartSizes& part, PartNeeds& needs) {
    if (part.known && part.chunk_count.value_or(int32_t(needs.chunks)) == int32_t(needs.chunks))
        return {};
    if (!part.known && part.chunk_count.value_or(-1) >= 0) {
        needs.chunks = uint64_t(*part.chunk_count);
        return {};
    }
    return input_error("damaged header: a wrong number of chunks");
}

}  // namespace

uint64_t most_packed(int compression) {
    const Compression* found = compression_of(compression);
    return found == nullptr ? 0 : found->most_packed;
}

int lines_of_chunk(int compression) {
    const Compression* found = compression_of(compression);
    return found == nullptr ? 1 : int(found->lines);
}

Result<PartNeeds> check_part(const PartSizes& part, const ReadLimits& limits) {
    if (!part.data_window || part.channels.empty()) {
        return input_error("damaged header: no data window or no channels");
    }
    const Window& w = *part.data_window;
    const int64_t signed_width = int64_t(w.max_x) - w.min_x + 1;
    const int64_t signed_height = int64_t(w.max_y) - w.min_y + 1;
    if (signed_width < 1 || signed_height < 1) {
        return input_error("damaged header: empty data window");
    }
    if (signed_width > limits.max_side || signed_height > limits.max_side) {
        return input_error(concat("the data window is ", std::to_string(signed_width), "x",
                                  std::to_string(signed_height), " pixels; the limit is ",
                                  std::to_string(limits.max_side),
                                  " a side; render or crop it smaller"));
    }
    const uint64_t width = uint64_t(signed_width), height = uint64_t(signed_height);
    PartNeeds needs;
    uint64_t bytes = 0;  // bytes of one pixel
    for (const PartSizes::Channel& c : part.channels) {
        bytes += uint64_t(c.bytes);
        // Rounded down: a subsampled channel may miss its first and last sample.
        needs.pixel_bytes += uint64_t(c.bytes) * (width / uint64_t(c.x_sampling)) *
                             (height / uint64_t(c.y_sampling));
    }
    // A deep pixel may have 0 samples; its sample count takes 4 bytes.
    if (part.deep) needs.pixel_bytes = 4 * width * height;
    if (width * height * bytes > limits.max_bytes) {
        return input_error(concat("the pixels of one part take ", mebibytes(width * height * bytes),
                                  "; the limit is ", mebibytes(limits.max_bytes),
                                  "; render it smaller or with fewer channels"));
    }
    const Compression* compression = compression_of(part.compression);
    if (compression == nullptr) return input_error("damaged header: unknown compression");
    needs.least_file_bytes = up(needs.pixel_bytes, compression->most_packed);
    if (!part.tiled) {
        needs.chunks = up(height, compression->lines);
        // OpenEXR's buffers hold a whole block even if the part has fewer lines.
        RETURN_IF_ERROR(check_chunk(concat("a block of ", std::to_string(compression->lines),
                                           " lines of ", name_of(ExrMethod(part.compression))),
                                    compression->lines * width * bytes, limits,
                                    "write it with fewer channels or as zip"));
        RETURN_IF_ERROR(check_chunk_count(part, needs));
        return needs;
    }
    if (!part.tile || part.tile->width < 1 || part.tile->height < 1) {
        return input_error("damaged header: tiles of size 0");
    }
    const auto [tile_width, tile_height, levels] = *part.tile;
    if ((levels & 0xf) > 2 || (levels >> 4) > 1) {
        return input_error("damaged header: unknown kind of levels");
    }
    const std::string tile = concat("a tile of ", std::to_string(tile_width), "x",
                                    std::to_string(tile_height), " pixels");
    if (tile_width > uint32_t(limits.max_side) || tile_height > uint32_t(limits.max_side)) {
        return input_error(concat(tile, " is too large; the limit is ",
                                  std::to_string(limits.max_side),
                                  " a side; write it with smaller tiles"));
    }
    needs.chunks = count_tiles(width, height, *part.tile);
    RETURN_IF_ERROR(check_chunk(tile, uint64_t(tile_width) * tile_height * bytes, limits,
                                "write it with smaller tiles"));
    RETURN_IF_ERROR(check_chunk_count(part, needs));
    return needs;
}

Status too_much_packed(const PartSizes& part, const PartNeeds& needs, uint64_t file_bytes) {
    const Compression& compression = *compression_of(part.compression);
    return input_error(concat(
        "truncated or damaged: its header states ", std::to_string(needs.pixel_bytes),
        " bytes of pixels in a file of ", std::to_string(file_bytes), "; ",
        name_of(ExrMethod(part.compression)), " packs at most ",
        std::to_string(compression.most_packed), " bytes into one; copy or render it again"));
}

}  // namespace postchain::io
