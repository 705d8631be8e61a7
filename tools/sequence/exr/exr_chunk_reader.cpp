#include "tools/sequence/exr/exr_chunk_reader.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "tools/sequence/exr/worker_pool.h"
#include "tools/sequence/exr/zip_bytes.h"
#include "tools/sequence/exr/zlib_stream.h"

namespace postchain::io {

namespace {

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
                if (std::byte* to = place(area, row)) std::memcpy(to, from + row.at, row.bytes);
            });
            return {};
        }
        if (!scratch.inflater->unpack(scratch.packed.get(), packed, scratch.unpacked.get(), bytes))
            return chunk_is_damaged("its packed bytes cannot be unpacked");
        auto* words = reinterpret_cast<uint8_t*>(scratch.unpacked.get());
        from_differences(words, bytes);
        // Every sample is one or two words.
        layout_.each_row(area, [&](const ChunkLayout::Row& row) {
            if (std::byte* to = place(area, row))
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
    std::byte* place(const Window& area, const ChunkLayout::Row& row) const {
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
    int32_t expected[5];
    size_t count = 0;
    if (part) expected[count++] = *part;
    if (layout.tiled) {
        expected[count++] = int32_t(chunk % size_t(layout.across()));
        expected[count++] = int32_t(chunk / size_t(layout.across()));
        expected[count++] = 0;
        expected[count++] = 0;
    } else {
        expected[count++] = layout.area(chunk).min_y;
    }
    int32_t head[5];
    if (!read_at(at, head, count * sizeof(int32_t))) return chunk_is_cut();
    if (!std::equal(expected, expected + count, head))
        return chunk_is_damaged("another chunk is in its place");
    at += count * sizeof(int32_t);
    return {};
}

Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels) {
    if (source.offsets.size() < layout.count())
        return Status(StatusCode::input, "damaged header: a wrong number of chunks");
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

}  // namespace postchain::io
