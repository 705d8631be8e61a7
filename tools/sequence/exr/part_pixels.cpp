#include "tools/sequence/exr/part_pixels.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "chain/base/status.h"
#include "tools/sequence/exr/pixel_encode.h"

namespace postchain::io {

namespace {

// The bytes of a value in a channel's own type.
std::vector<std::byte> stored(float value, PixelType type) {
    ImageF one(1, 1, 1, value);
    std::vector<std::byte> bytes(size_t(bytes_of(type)));
    if (type == PixelType::half)
        floats_to_halves(one.data.data(), 1, reinterpret_cast<uint16_t*>(bytes.data()));
    else
        encode_channels({{&one, 0, type, bytes.data()}});
    return bytes;
}

}  // namespace

const char* name_of(PixelType type) {
    return type == PixelType::half ? "half" : type == PixelType::float32 ? "float" : "uint";
}

int bytes_of(PixelType type) {
    return type == PixelType::half ? 2 : 4;
}

Window Window::united(const Window& o) const {
    return {std::min(min_x, o.min_x), std::min(min_y, o.min_y), std::max(max_x, o.max_x),
            std::max(max_y, o.max_y)};
}

Window Window::intersected(const Window& o) const {
    return {std::max(min_x, o.min_x), std::max(min_y, o.min_y), std::min(max_x, o.max_x),
            std::min(max_y, o.max_y)};
}

Window Window::grown(int px) const {
    return {min_x - px, min_y - px, max_x + px, max_y + px};
}

std::string Window::text() const {
    return concat("(", std::to_string(min_x), ", ", std::to_string(min_y), ")-(",
                  std::to_string(max_x), ", ", std::to_string(max_y), ")");
}

int samples_between(int low, int high, int sampling) {
    const auto floor_div = [sampling](int64_t a) {
        return a >= 0 ? a / sampling : -((-a + sampling - 1) / sampling);
    };
    return int(floor_div(high) - floor_div(int64_t(low) - 1));
}

PartPixels::Plane::Plane(const ExrChannel& its_channel, const Window& window)
    : channel(its_channel),
      width(samples_between(window.min_x, window.max_x, channel.x_sampling)),
      height(samples_between(window.min_y, window.max_y, channel.y_sampling)),
      bytes(std::make_unique_for_overwrite<std::byte[]>(std::max<size_t>(total_bytes(), 1))) {}

const PartPixels::Plane* PartPixels::find(std::string_view channel) const {
    for (const Plane& p : planes)
        if (p.channel.name == channel) return &p;
    return nullptr;
}

ImageF PartPixels::interleaved(const std::vector<std::string>& names, const Window& area,
                               int channels, float fill, float outside) const {
    const int count = std::max(channels, int(names.size()));
    ImageF image(area.width(), area.height(), count, fill);
    const Window here = area.intersected(window);
    std::vector<float> row(size_t(image.width), outside);
    const size_t first = here.empty() ? 0 : size_t(here.min_x - area.min_x);
    const size_t width = here.empty() ? 0 : size_t(here.width());
    for (size_t c = 0; c < names.size(); ++c) {
        const Plane* plane = find(names[c]);
        assert(plane != nullptr && plane->channel.x_sampling == 1 &&
               plane->channel.y_sampling == 1);
        const size_t size = size_t(bytes_of(plane->channel.type));
        for (int y = 0; y < image.height; ++y) {
            const int in_file = y + area.min_y;
            const bool covered = width > 0 && in_file >= here.min_y && in_file <= here.max_y;
            if (!covered) {
                std::fill(row.begin(), row.end(), outside);
            } else {
                const std::byte* from = plane->bytes.get() +
                                        size_t(in_file - window.min_y) * plane->row_bytes() +
                                        size_t(here.min_x - window.min_x) * size;
                float* values = row.data() + first;
                std::fill(row.data(), values, outside);
                std::fill(values + width, row.data() + row.size(), outside);
                if (plane->channel.type == PixelType::half) {
                    halves_to_floats(reinterpret_cast<const uint16_t*>(from), width, values);
                } else if (plane->channel.type == PixelType::float32) {
                    std::memcpy(values, from, width * sizeof(float));
                } else {
                    const auto* numbers = reinterpret_cast<const uint32_t*>(from);
                    std::transform(numbers, numbers + width, values,
                                   [](uint32_t v) { return float(v); });
                }
            }
            float* to = image.data.data() + size_t(y) * row.size() * size_t(count) + c;
            for (size_t x = 0; x < row.size(); ++x) to[x * size_t(count)] = row[x];
        }
    }
    return image;
}

PartPixels PartPixels::placed(const Window& to, const std::map<std::string, float>& outside) const {
    PartPixels result;
    result.part = part;
    result.window = to;
    const Window here = to.intersected(window);
    for (const Plane& from : planes) {
        Plane& plane = result.planes.emplace_back(from.channel, to);
        const int sampling_x = from.channel.x_sampling, sampling_y = from.channel.y_sampling;
        std::fill_n(plane.bytes.get(), plane.total_bytes(), std::byte(0));
        if (const auto value = outside.find(from.channel.name); value != outside.end()) {
            const std::vector<std::byte> bytes = stored(value->second, from.channel.type);
            for (size_t at = 0; at < plane.total_bytes(); at += bytes.size())
                std::copy(bytes.begin(), bytes.end(), plane.bytes.get() + at);
        }
        if (here.empty()) continue;
        const size_t size = size_t(bytes_of(from.channel.type));
        const size_t width = size_t(samples_between(here.min_x, here.max_x, sampling_x));
        const int height = samples_between(here.min_y, here.max_y, sampling_y);
        // Samples before the first common one.
        const auto skipped = [&](const Window& w) {
            return std::pair(size_t(samples_between(w.min_x, here.min_x - 1, sampling_x)),
                             size_t(samples_between(w.min_y, here.min_y - 1, sampling_y)));
        };
        const auto [from_x, from_y] = skipped(window);
        const auto [to_x, to_y] = skipped(to);
        for (int y = 0; y < height; ++y)
            std::memcpy(plane.bytes.get() + (to_y + size_t(y)) * plane.row_bytes() + to_x * size,
                        from.bytes.get() + (from_y + size_t(y)) * from.row_bytes() + from_x * size,
                        width * size);
    }
    return result;
}

ImageF placed(const ImageF& image, const Window& from, const Window& to) {
    if (from == to) return image;
    ImageF result(to.width(), to.height(), image.channels);
    const Window here = to.intersected(from);
    for (int y = here.min_y; y <= here.max_y && !here.empty(); ++y)
        std::copy_n(image.pixel(here.min_x - from.min_x, y - from.min_y),
                    size_t(here.width()) * size_t(image.channels),
                    result.pixel(here.min_x - to.min_x, y - to.min_y));
    return result;
}

}  // namespace postchain::io
