#include "tools/sequence/exr/exr_chunks.h"

#include <ImfChannelList.h>
#include <ImfPartType.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <memory>

#include "chain/base/text.h"
#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/worker_pool.h"
#include "tools/sequence/exr/zip.h"

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

namespace {

// The numbers before a chunk's size: its part in a multi-part file, then its first line, or its
// tile and level.
struct ChunkHead {
    ChunkHead(const ChunkLayout& layout, std::optional<int> part, size_t chunk) {
        if (part) numbers[count++] = *part;
        if (!layout.tiled) {
            numbers[count++] = layout.area(chunk).min_y;
            return;
        }
        numbers[count++] = int32_t(chunk % size_t(layout.across()));
        numbers[count++] = int32_t(chunk / size_t(layout.across()));
        count += 2;  // level 0
    }
    size_t bytes() const { return count * sizeof(int32_t); }

    int32_t numbers[5] = {};
    size_t count = 0;
};

// Buffers of one thread.
struct UnpackBuffers {
    std::unique_ptr<std::byte[]> packed;
    std::unique_ptr<std::byte[]> unpacked;
    std::unique_ptr<Inflater> inflater;
};

class ChunkReader {
  public:
    ChunkReader(const ChunkSource& source, const ChunkLayout& layout, const PartPixels& pixels)
        : source_(source), layout_(layout), pixels_(pixels) {
        for (const ExrChannel& c : layout.channels) planes_.push_back(pixels.find(c.name));
    }

    // Errors (input), without the name of the chunk.
    Status read(size_t chunk, UnpackBuffers& scratch) const {
        const Window area = layout_.area(chunk);
        const size_t bytes = layout_.bytes(area);
        uint64_t at = source_.offsets[chunk];
        size_t packed = 0;
        RETURN_IF_ERROR(read_head(chunk, bytes, at, packed));
        if (!source_.read_at(at, scratch.packed.get(), packed)) return chunk_is_cut();
        const auto* from = reinterpret_cast<const uint8_t*>(scratch.packed.get());
        if (packed == bytes) {
            layout_.each_row(area, [&](const ChunkLayout::Row& row) {
                if (std::byte* to = row_address(area, row))
                    std::memcpy(to, from + row.at, row.bytes);
            });
            return {};
        }
        if (!scratch.inflater->unpack(scratch.packed.get(), packed, scratch.unpacked.get(), bytes))
            return chunk_is_damaged("its packed bytes cannot be unpacked");
        auto* words = reinterpret_cast<uint8_t*>(scratch.unpacked.get());
        from_differences(words, bytes);
        // Every sample is one or two words.
        layout_.each_row(area, [&](const ChunkLayout::Row& row) {
            if (std::byte* to = row_address(area, row))
                join_words(words + row.at / 2, words + bytes / 2 + row.at / 2, row.bytes / 2,
                           reinterpret_cast<uint8_t*>(to));
        });
        return {};
    }

  private:
    // Reads and checks the header of a chunk. Moves `at` behind it.
    Status read_head(size_t chunk, size_t bytes, uint64_t& at, size_t& packed) const {
        RETURN_IF_ERROR(source_.check_place(layout_, chunk, at));
        int32_t size;
        if (!source_.read_at(at, &size, sizeof(size))) return chunk_is_cut();
        at += sizeof(size);
        // A chunk that would have grown is stored unpacked.
        if (size < 0 || uint64_t(size) > bytes || (!layout_.packed && uint64_t(size) != bytes))
            return chunk_is_damaged("its size is wrong");
        packed = size_t(size);
        return {};
    }

    // Destination of a row; null if it is not wanted.
    std::byte* row_address(const Window& area, const ChunkLayout::Row& row) const {
        const PartPixels::Plane* plane = planes_[row.channel];
        if (plane == nullptr || row.y < pixels_.window.min_y || row.y > pixels_.window.max_y)
            return nullptr;
        return plane->bytes.get() + place_in_plane(*plane, pixels_.window, area.min_x, row.y);
    }

    const ChunkSource& source_;
    const ChunkLayout& layout_;
    const PartPixels& pixels_;
    std::vector<const PartPixels::Plane*> planes_;  // by channel; null: not wanted
};

}  // namespace

Status damaged_header(const std::string& what) {
    return Status(StatusCode::input,
                  concat("damaged header: ", what, "; copy or render the file again"));
}

Status chunk_is_damaged(const char* what) {
    return Status(StatusCode::input, concat("damaged: ", what, "; copy or render it again"));
}

Status chunk_is_cut() {
    return Status(StatusCode::input, "truncated: the file ends in it; copy or render it again");
}

bool ChunkSource::read_at(uint64_t at, void* to, size_t count) const {
    auto* bytes = static_cast<char*>(to);
    while (count > 0) {
        const ssize_t n = ::pread(fd, bytes, count, off_t(at));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        bytes += n;
        at += uint64_t(n);
        count -= size_t(n);
    }
    return true;
}

Status ChunkSource::check_place(const ChunkLayout& layout, size_t chunk, uint64_t& at) const {
    const ChunkHead expected(layout, part, chunk);
    int32_t head[5];
    if (!read_at(at, head, expected.bytes())) return chunk_is_cut();
    if (!std::equal(head, head + expected.count, expected.numbers))
        return chunk_is_damaged("another chunk is in its place");
    at += expected.bytes();
    return {};
}

Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels) {
    if (source.offsets.size() < layout.count()) return damaged_header("a wrong number of chunks");
    const ChunkRange chunks = layout.chunks_with(pixels.window);
    WorkerPool& pool = WorkerPool::shared();
    std::vector<UnpackBuffers> scratch(std::min(pool.slots(), chunks.count));
    const size_t most = layout.most_bytes();
    for (UnpackBuffers& s : scratch) {
        s.packed = std::make_unique_for_overwrite<std::byte[]>(most);
        if (!layout.packed) continue;
        s.unpacked = std::make_unique_for_overwrite<std::byte[]>(most);
        s.inflater = std::make_unique<Inflater>();
    }
    const ChunkReader reader(source, layout, pixels);
    return pool.run(chunks.count, scratch.size(), [&](size_t index, size_t slot) {
        Status status = reader.read(chunks.first + index, scratch[slot]);
        return status.ok() ? status : status.at(layout.name(chunks.first + index));
    });
}

namespace {

constexpr size_t kBytesAtOnce = size_t(4)
                                << 20;  // bytes of pixels that are packed before they are written

// Buffers of one thread.
struct PackBuffers {
    std::unique_ptr<std::byte[]> words;
    std::unique_ptr<Deflater> deflater;
};

struct PackedChunk {
    std::unique_ptr<std::byte[]> bytes;
    size_t size = 0;
};

class ChunkPacker {
  public:
    ChunkPacker(const ChunkLayout& layout, const PartPlanes& part) : layout_(layout), part_(part) {
        for (const ExrChannel& c : layout.channels)
            planes_.push_back(*std::find_if(
                part.planes.begin(), part.planes.end(),
                [&](const PartPixels::Plane* plane) { return plane->channel.name == c.name; }));
    }

    void pack(size_t index, PackBuffers& scratch, PackedChunk& to) const {
        const Window area = layout_.area(index);
        const size_t bytes = layout_.bytes(area);
        if (layout_.packed) {
            // Every sample is one or two words.
            auto* words = reinterpret_cast<uint8_t*>(scratch.words.get());
            layout_.each_row(area, [&](const ChunkLayout::Row& row) {
                split_words(reinterpret_cast<const uint8_t*>(row_address(area, row)), row.bytes / 2,
                            words + row.at / 2, words + bytes / 2 + row.at / 2);
            });
            to_differences(words, bytes);
            to.size = scratch.deflater->pack(scratch.words.get(), bytes, to.bytes.get(), bytes);
            if (to.size > 0 && to.size < bytes) return;
        }
        to.size = bytes;
        layout_.each_row(area, [&](const ChunkLayout::Row& row) {
            std::memcpy(to.bytes.get() + row.at, row_address(area, row), row.bytes);
        });
    }

  private:
    const std::byte* row_address(const Window& area, const ChunkLayout::Row& row) const {
        const PartPixels::Plane& plane = *planes_[row.channel];
        return plane.bytes.get() + place_in_plane(plane, part_.window, area.min_x, row.y);
    }

    const ChunkLayout& layout_;
    const PartPlanes& part_;
    std::vector<const PartPixels::Plane*> planes_;  // by channel
};

void write_chunk(Imf::OStream& stream, const ChunkLayout& layout, std::optional<int> part,
                 size_t index, const PackedChunk& chunk) {
    const ChunkHead head(layout, part, index);
    const auto size = int32_t(chunk.size);
    stream.write(reinterpret_cast<const char*>(head.numbers), int(head.bytes()));
    stream.write(reinterpret_cast<const char*>(&size), sizeof(size));
    stream.write(reinterpret_cast<const char*>(chunk.bytes.get()), int(chunk.size));
}

}  // namespace

Status write_chunks(Imf::OStream& stream, const ChunkLayout& layout, const PartPlanes& planes,
                    std::optional<int> part, int level, uint64_t table) {
    const size_t most = std::max<size_t>(layout.most_bytes(), 1), count = layout.count();
    if (most > size_t(std::numeric_limits<int32_t>::max()))
        return Status(StatusCode::output,
                      concat(layout.rows,
                             " lines of all channels take more than a chunk of EXR "
                             "holds, 2 GiB; write fewer channels, or smaller tiles"));
    WorkerPool& pool = WorkerPool::shared();
    const size_t slots = pool.slots();
    std::vector<PackedChunk> chunks(std::min(count, std::max(2 * slots, kBytesAtOnce / most)));
    for (PackedChunk& chunk : chunks)
        chunk.bytes = std::make_unique_for_overwrite<std::byte[]>(most);
    std::vector<PackBuffers> scratch(std::min(slots, chunks.size()));
    for (PackBuffers& s : scratch) {
        if (!layout.packed) continue;
        s.words = std::make_unique_for_overwrite<std::byte[]>(most);
        s.deflater = std::make_unique<Deflater>(level);
    }
    const ChunkPacker packer(layout, planes);
    std::vector<uint64_t> offsets(count);
    for (size_t done = 0; done < count;) {
        const size_t now = std::min(chunks.size(), count - done);
        const Status status =
            pool.run(now, scratch.size(), [&](size_t index, size_t slot) -> Status {
                packer.pack(layout.nth_written(done + index), scratch[slot], chunks[index]);
                return {};
            });
        if (!status.ok()) return status;
        for (size_t i = 0; i < now; ++i) {
            const size_t index = layout.nth_written(done + i);
            offsets[index] = stream.tellp();
            write_chunk(stream, layout, part, index, chunks[i]);
        }
        done += now;
    }
    const uint64_t end = stream.tellp();
    stream.seekp(table);
    // A ChunkLayout exists only on little-endian machines.
    stream.write(reinterpret_cast<const char*>(offsets.data()),
                 int(offsets.size() * sizeof(uint64_t)));
    stream.seekp(end);
    return {};
}

}  // namespace postchain::io
