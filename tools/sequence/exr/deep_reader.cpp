#include "tools/sequence/exr/deep_reader.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "tools/sequence/exr/deep_pixel.h"
#include "tools/sequence/exr/pixel_encode.h"
#include "tools/sequence/exr/worker_pool.h"
#include "tools/sequence/exr/zip.h"

namespace postchain::io {

namespace {

constexpr float kNoDepth = 1e10F;  // as in Blender
constexpr uint16_t kHalfInfinity = 0x7c00;

// A channel's values of one line.
struct Values {
    PixelType type = PixelType::float32;
    const std::byte* bytes = nullptr;

    const std::byte* at(size_t sample) const { return bytes + sample * size_t(bytes_of(type)); }
    float value(size_t sample) const {
        if (type == PixelType::half) {
            uint16_t bits;
            std::memcpy(&bits, at(sample), sizeof(bits));
            float value;
            halves_to_floats(&bits, 1, &value);
            return value;
        }
        if (type == PixelType::float32) {
            float value;
            std::memcpy(&value, at(sample), sizeof(value));
            return value;
        }
        uint32_t value;
        std::memcpy(&value, at(sample), sizeof(value));
        return float(value);
    }
};

void store(double value, PixelType type, std::byte* to) {
    const float number = float(value);
    if (type == PixelType::float32) {
        std::memcpy(to, &number, sizeof(number));
        return;
    }
    uint16_t bits;
    floats_to_halves(&number, 1, &bits);
    std::memcpy(to, &bits, sizeof(bits));
}

struct ScratchBytes {
    std::unique_ptr<std::byte[]> bytes;
    size_t room = 0;

    std::byte* at_least(size_t count) {
        if (count > room) {
            bytes.reset();  // so that both are never allocated together
            room = 0;
            bytes = std::make_unique_for_overwrite<std::byte[]>(count);
            room = count;
        }
        return bytes.get();
    }
};

// Buffers of one thread.
struct DeepBuffers {
    ScratchBytes packed, words, counts, samples;
    std::vector<int32_t> ends;  // per pixel: samples up to it in its line
    Inflater inflater;
    DeepPixel pixel;
};

// How each channel of the part is used.
struct DeepChannels {
    std::vector<size_t> sizes;                     // bytes of a sample, by channel
    std::vector<const PartPixels::Plane*> planes;  // by channel; null: not wanted
    std::vector<bool> is_color;
    size_t depth = 0;
    std::optional<size_t> back, alpha;
    size_t sample_bytes = 0;

    DeepChannels(const ChunkLayout& layout, const Flattening& flattening,
                 const PartPixels& pixels) {
        for (size_t i = 0; i < layout.channels.size(); ++i) {
            const ExrChannel& channel = layout.channels[i];
            sizes.push_back(size_t(bytes_of(channel.type)));
            planes.push_back(pixels.find(channel.name));
            is_color.push_back(channel.type != PixelType::uint32 &&
                               flattening.is_color(channel.name));
            sample_bytes += sizes.back();
            if (channel.name == flattening.depth) depth = i;
            if (channel.name == flattening.depth + "Back") back = i;
            if (channel.name == flattening.alpha) alpha = i;
        }
    }
};

// OpenEXR's runs: a count n of 0 to 127 and a byte that stands n + 1 times, or -n and n bytes.
bool unpack_runs(const std::byte* from, size_t packed, std::byte* to, size_t count) {
    const std::byte* const from_end = from + packed;
    std::byte* const to_end = to + count;
    while (from != from_end) {
        const int n = int(int8_t(*from++));
        const size_t bytes = size_t(n < 0 ? -n : n + 1);
        if (bytes > size_t(to_end - to) || size_t(from_end - from) < (n < 0 ? bytes : 1))
            return false;
        if (n < 0)
            std::memcpy(to, from, bytes);
        else
            std::memset(to, int(*from), bytes);
        from += n < 0 ? bytes : 1;
        to += bytes;
    }
    return to == to_end;
}

class DeepReader {
  public:
    DeepReader(const ChunkSource& source, const ChunkLayout& layout, ExrMethod method,
               const Flattening& flattening, const PartPixels& pixels)
        : source_(source),
          layout_(layout),
          method_(method),
          behind_(flattening.behind),
          pixels_(pixels),
          channels_(layout, flattening, pixels) {}

    // Errors (input), without the name of the chunk.
    Status read(size_t chunk, DeepBuffers& buffers) const {
        const Window area = layout_.area(chunk);
        uint64_t at = source_.offsets[chunk];
        std::array<uint64_t, 3> sizes;  // counts and samples, packed; samples, unpacked
        RETURN_IF_ERROR(source_.check_place(layout_, chunk, at));
        if (!source_.read_at(at, sizes.data(), sizeof(sizes))) return chunk_is_cut();
        at += sizeof(sizes);
        const size_t count_bytes = size_t(area.pixels()) * sizeof(int32_t);
        const std::byte* counted = nullptr;
        RETURN_IF_ERROR(unpack(at, sizes[0], count_bytes,
                               layout_.whole_chunk_pixels * sizeof(int32_t), buffers,
                               buffers.counts, counted));
        std::vector<int32_t>& ends = buffers.ends;
        ends.resize(size_t(area.pixels()));
        std::memcpy(ends.data(), counted, count_bytes);
        uint64_t samples = 0;
        if (!add_up(ends, size_t(area.width()), samples))
            return chunk_is_damaged("its sample counts are no running sums");
        if (samples * channels_.sample_bytes != sizes[2])
            return chunk_is_damaged("its sample counts and the size of its samples differ");
        const std::byte* values = nullptr;
        RETURN_IF_ERROR(unpack(at + sizes[0], sizes[1], size_t(sizes[2]), sizes[2], buffers,
                               buffers.samples, values));
        // A chunk is one line, or a tile: all of it is in the window, which has whole tiles.
        const size_t width = size_t(area.width());
        for (int y = area.min_y; y <= area.max_y; ++y) {
            const int32_t* row = ends.data() + size_t(y - area.min_y) * width;
            flatten(area, y, row, values, buffers.pixel);
            values += size_t(row[width - 1]) * channels_.sample_bytes;
        }
        return {};
    }

  private:
    // The counts of a line are summed from its left.
    static bool add_up(const std::vector<int32_t>& ends, size_t width, uint64_t& samples) {
        for (size_t row = 0; row < ends.size(); row += width) {
            int32_t before = 0;
            for (size_t x = 0; x < width; ++x) {
                if (ends[row + x] < before) return false;
                before = ends[row + x];
            }
            samples += uint64_t(before);
        }
        return true;
    }

    // Data that would have grown are stored unpacked, in `raw` bytes of which the first are used:
    // OpenEXR writes as many counts for a tile at the border as for a whole one.
    Status unpack(uint64_t at, uint64_t packed, size_t bytes, uint64_t raw, DeepBuffers& buffers,
                  ScratchBytes& to, const std::byte*& result) const {
        const bool is_raw = packed == raw || (method_ == ExrMethod::none && packed == bytes);
        if (packed > raw || (method_ == ExrMethod::none && !is_raw))
            return chunk_is_damaged("its size is wrong");
        std::byte* out = to.at_least(bytes);
        result = out;
        std::byte* from = is_raw ? out : buffers.packed.at_least(size_t(packed));
        if (!source_.read_at(at, from, is_raw ? bytes : size_t(packed))) return chunk_is_cut();
        if (is_raw) return {};
        std::byte* words = buffers.words.at_least(bytes);
        const bool whole = method_ == ExrMethod::rle
                               ? unpack_runs(from, size_t(packed), words, bytes)
                               : buffers.inflater.unpack(from, size_t(packed), words, bytes);
        if (!whole) return chunk_is_damaged("its packed bytes cannot be unpacked");
        // Every value is one or two words.
        auto* low = reinterpret_cast<uint8_t*>(words);
        from_differences(low, bytes);
        join_words(low, low + bytes / 2, bytes / 2, reinterpret_cast<uint8_t*>(out));
        return {};
    }

    void flatten(const Window& area, int y, const int32_t* ends, const std::byte* row,
                 DeepPixel& pixel) const {
        const size_t width = size_t(area.width());
        std::vector<Values> values;
        for (size_t i = 0; i < layout_.channels.size(); ++i) {
            values.push_back({layout_.channels[i].type, row});
            row += size_t(ends[width - 1]) * channels_.sizes[i];
        }
        std::vector<std::byte*> to;
        for (const PartPixels::Plane* plane : channels_.planes)
            to.push_back(plane ? plane->bytes.get() +
                                     place_in_plane(*plane, pixels_.window, area.min_x, y)
                               : nullptr);
        for (size_t x = 0; x < width; ++x) {
            const size_t first = x == 0 ? 0 : size_t(ends[x - 1]);
            gather(values, first, size_t(ends[x]) - first, pixel.samples());
            pixel.composite(behind_);
            const std::optional<size_t> alone = pixel.shown_alone();
            for (size_t i = 0; i < values.size(); ++i) {
                if (to[i] == nullptr) continue;
                const bool color = channels_.is_color[i];
                if (color && i == channels_.alpha)
                    store(pixel.alpha(), values[i].type, to[i]);
                else if (color && !alone)
                    put_color(pixel, values[i], first, to[i]);
                else if (color || pixel.surface() >= 0)
                    // A value that is shown alone keeps its bits.
                    std::memcpy(to[i],
                                values[i].at(first + (color ? *alone : size_t(pixel.surface()))),
                                channels_.sizes[i]);
                else
                    put_nothing(i, values[i].type, to[i]);
                to[i] += channels_.sizes[i];
            }
        }
    }

    void gather(const std::vector<Values>& values, size_t first, size_t count,
                std::vector<DeepSample>& samples) const {
        samples.resize(count);
        for (size_t i = 0; i < count; ++i) {
            DeepSample& sample = samples[i];
            sample.index = uint32_t(i);
            sample.front = values[channels_.depth].value(first + i);
            sample.back = channels_.back ? values[*channels_.back].value(first + i) : sample.front;
            sample.alpha = channels_.alpha ? values[*channels_.alpha].value(first + i) : 1;
        }
    }

    static void put_color(const DeepPixel& pixel, const Values& values, size_t first,
                          std::byte* to) {
        double sum = 0;
        for (size_t i = 0; i < pixel.size(); ++i)
            if (const double weight = pixel.weight(i); weight != 0)
                sum += weight * double(values.value(first + i));
        store(sum, values.type, to);
    }

    void put_nothing(size_t channel, PixelType type, std::byte* to) const {
        std::memset(to, 0, channels_.sizes[channel]);
        const bool depth = channel == channels_.depth || channel == channels_.back;
        if (depth && type == PixelType::half)
            std::memcpy(to, &kHalfInfinity, sizeof(kHalfInfinity));
        else if (depth && type == PixelType::float32)
            std::memcpy(to, &kNoDepth, sizeof(kNoDepth));
    }

    const ChunkSource& source_;
    const ChunkLayout& layout_;
    const ExrMethod method_;
    const bool behind_;
    const PartPixels& pixels_;
    const DeepChannels channels_;
};

}  // namespace

Status read_deep_part(const ChunkSource& source, const ChunkLayout& layout, ExrMethod method,
                      const Flattening& flattening, PartPixels& pixels) {
    if (source.offsets.size() < layout.count()) return damaged_header("a wrong number of chunks");
    const DeepReader reader(source, layout, method, flattening, pixels);
    const ChunkRange chunks = layout.chunks_with(pixels.window);
    WorkerPool& pool = WorkerPool::shared();
    std::vector<DeepBuffers> buffers(std::min(pool.slots(), chunks.count));
    return pool.run(chunks.count, buffers.size(), [&](size_t index, size_t slot) {
        Status status = reader.read(chunks.first + index, buffers[slot]);
        return status.ok() ? status : status.at(layout.name(chunks.first + index));
    });
}

uint64_t flattening_bytes(uint64_t packed, uint64_t unpacked, uint64_t sample_bytes) {
    // Packed, twice unpacked; all samples may be in one pixel, as volumes that overlap.
    const uint64_t of_sample = sizeof(DeepSample) + 2 * sizeof(double) + 2 * 24;
    return packed + 2 * unpacked + unpacked / std::max<uint64_t>(sample_bytes, 1) * of_sample;
}

}  // namespace postchain::io
