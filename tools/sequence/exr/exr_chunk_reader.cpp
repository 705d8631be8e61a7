#include "tools/sequence/exr/exr_chunk_reader.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string>

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
        if (Status s = read_head(chunk, area, bytes, at, packed); !s.ok()) return s;
        if (!read_at(at, scratch.packed.get(), packed)) return cut();
        const auto* from = reinterpret_cast<const uint8_t*>(scratch.packed.get());
        if (packed == bytes) {
            layout_.each_row(area, [&](const ChunkLayout::Row& row) {
                if (std::byte* to = place(area, row)) std::memcpy(to, from + row.at, row.bytes);
            });
            return {};
        }
        if (!scratch.inflater->unpack(scratch.packed.get(), packed, scratch.unpacked.get(), bytes))
            return damaged("its packed bytes cannot be unpacked");
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

    std::string name(size_t chunk) const {
        const Window area = layout_.area(chunk);
        return layout_.tiled ? concat("tile ", area.text())
                             : concat("lines ", area.min_y, " to ", area.max_y);
    }

  private:
    static Status damaged(const char* what) {
        return Status(StatusCode::input, concat("damaged: ", what, "; copy or render it again"));
    }
    static Status cut() {
        return Status(StatusCode::input, "truncated: the file ends in it; copy or render it again");
    }

    // False if the file ends too early.
    bool read_at(uint64_t at, void* to, size_t count) const {
        auto* bytes = static_cast<char*>(to);
        while (count > 0) {
            const ssize_t n = ::pread(source_.fd, bytes, count, off_t(at));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            bytes += n;
            at += uint64_t(n);
            count -= size_t(n);
        }
        return true;
    }

    // Reads and checks the header of a chunk: part, line or tile with its level, size. Moves `at`
    // behind it.
    Status read_head(size_t chunk, const Window& area, size_t bytes, uint64_t& at,
                     size_t& packed) const {
        int32_t expected[5];
        size_t count = 0;
        if (source_.part) expected[count++] = *source_.part;
        if (layout_.tiled) {
            expected[count++] = int32_t(chunk % size_t(layout_.across()));
            expected[count++] = int32_t(chunk / size_t(layout_.across()));
            expected[count++] = 0;
            expected[count++] = 0;
        } else {
            expected[count++] = area.min_y;
        }
        int32_t head[6];
        const size_t head_bytes = (count + 1) * sizeof(int32_t);
        if (!read_at(at, head, head_bytes)) return cut();
        if (!std::equal(expected, expected + count, head))
            return damaged("another chunk is in its place");
        at += head_bytes;
        // A chunk that would have grown is stored unpacked.
        const int32_t size = head[count];
        if (size < 0 || uint64_t(size) > bytes || (!layout_.packed && uint64_t(size) != bytes))
            return damaged("its size is wrong");
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

Status read_chunks(const ChunkSource& source, const ChunkLayout& layout, PartPixels& pixels) {
    if (source.offsets.size() < layout.count())
        return Status(StatusCode::input, "damaged header: a wrong number of chunks");
    // Whole rows of chunks with at least one line in the window.
    const auto row_of = [&](int y) {
        return size_t(y - layout.window.min_y) / size_t(layout.rows);
    };
    const size_t first = row_of(pixels.window.min_y) * size_t(layout.across());
    const size_t end = (row_of(pixels.window.max_y) + 1) * size_t(layout.across());
    WorkerPool& pool = WorkerPool::shared();
    std::vector<UnpackBuffers> scratch(std::min(pool.slots(), end - first));
    const size_t most = layout.most_bytes();
    for (UnpackBuffers& s : scratch) {
        s.packed = std::make_unique_for_overwrite<std::byte[]>(most);
        if (!layout.packed) continue;
        s.unpacked = std::make_unique_for_overwrite<std::byte[]>(most);
        s.inflater = std::make_unique<Inflater>();
    }
    const ChunkReader reader(source, layout, pixels);
    return pool.run(end - first, scratch.size(), [&](size_t index, size_t slot) {
        Status status = reader.read(first + index, scratch[slot]);
        return status.ok() ? status : status.at(reader.name(first + index));
    });
}

}  // namespace postchain::io
