#include "tools/sequence/exr/exr_chunk_writer.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>

#include "tools/sequence/exr/worker_pool.h"
#include "tools/sequence/exr/zip_bytes.h"
#include "tools/sequence/exr/zlib_stream.h"

namespace postchain::io {

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
                split_words(reinterpret_cast<const uint8_t*>(place(area, row)), row.bytes / 2,
                            words + row.at / 2, words + bytes / 2 + row.at / 2);
            });
            to_differences(words, bytes);
            to.size = scratch.deflater->pack(scratch.words.get(), bytes, to.bytes.get(), bytes);
            if (to.size > 0 && to.size < bytes) return;
        }
        to.size = bytes;
        layout_.each_row(area, [&](const ChunkLayout::Row& row) {
            std::memcpy(to.bytes.get() + row.at, place(area, row), row.bytes);
        });
    }

  private:
    const std::byte* place(const Window& area, const ChunkLayout::Row& row) const {
        const PartPixels::Plane& plane = *planes_[row.channel];
        return plane.bytes.get() + place_in_plane(plane, part_.window, area.min_x, row.y);
    }

    const ChunkLayout& layout_;
    const PartPlanes& part_;
    std::vector<const PartPixels::Plane*> planes_;  // by channel
};

void write_chunk(Imf::OStream& stream, const ChunkLayout& layout, std::optional<int> part,
                 size_t index, const PackedChunk& chunk) {
    int32_t head[6];
    size_t count = 0;
    if (part) head[count++] = *part;
    if (layout.tiled) {
        head[count++] = int32_t(index % size_t(layout.across()));
        head[count++] = int32_t(index / size_t(layout.across()));
        head[count++] = 0;  // level
        head[count++] = 0;
    } else {
        head[count++] = layout.area(index).min_y;
    }
    head[count++] = int32_t(chunk.size);
    stream.write(reinterpret_cast<const char*>(head), int(count * sizeof(int32_t)));
    stream.write(reinterpret_cast<const char*>(chunk.bytes.get()), int(chunk.size));
}

}  // namespace

Result<std::vector<uint64_t>> write_chunks(Imf::OStream& stream, const ChunkLayout& layout,
                                           const PartPlanes& planes, std::optional<int> part,
                                           int level) {
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
    return offsets;
}

}  // namespace postchain::io
