#include "tools/page/encode.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "shaders/shared/color_limits.h"
#include "tools/sequence/exr/pixel_encode.h"
#include "tools/sequence/image/png.h"

namespace postchain::page {

namespace {

using shared::kMaxHalf;
constexpr uint16_t kHalfInfinity = 0x7c00;
constexpr uint16_t kHalfNan = 0x7e00;
constexpr int kLevel = 6;  // compression level of zlib

// `head`, then the deflated bytes.
Result<std::string> deflated(const std::vector<uint8_t>& bytes, const std::string& head = "") {
    uLongf size = compressBound(uLong(bytes.size()));
    std::string packed = head;
    packed.resize(head.size() + size);
    const int code = compress2(reinterpret_cast<Bytef*>(packed.data() + head.size()), &size,
                               bytes.data(), uLong(bytes.size()), kLevel);
    if (code != Z_OK) return Status(StatusCode::internal, concat("zlib: ", zError(code)));
    packed.resize(head.size() + size);
    return packed;
}

// take(difference) for each value of an image, channel by channel. row_of(y, c, values) sets the
// values of a row.
template <class T, class RowOf, class Take>
void each_difference(int width, int height, int channels, const RowOf& row_of, const Take& take) {
    std::vector<T> row(size_t(width), T(0));
    for (int c = 0; c < channels; ++c) {
        T above = 0;
        for (int y = 0; y < height; ++y) {
            row_of(y, c, row);
            T left = above;
            if (width > 0) above = row[0];
            for (const T v : row) {
                take(T(v - left));
                left = v;
            }
        }
    }
}

uint16_t nonfinite_half(float v) {
    if (std::isnan(v)) return kHalfNan;
    return v > 0 ? kHalfInfinity : uint16_t(kHalfInfinity | 0x8000);
}

Result<std::string> base64_of(const Result<std::string>& packed) {
    return packed.ok() ? Result<std::string>(io::base64_of(*packed)) : packed;
}

// The first channels of an image.
Result<std::string> packed_halves(const ImageF& color, int channels, const std::string& head = "") {
    std::vector<float> finite(size_t(color.width));
    const auto halves_of = [&](int y, int c, std::vector<uint16_t>& halves) {
        for (int x = 0; x < color.width; ++x) {
            const float v = color.at(x, y, c);
            finite[size_t(x)] = std::isnan(v) ? 0.0f : std::clamp(v, -kMaxHalf, kMaxHalf);
        }
        io::floats_to_halves(finite.data(), finite.size(), halves.data());
        for (int x = 0; x < color.width; ++x)
            if (const float v = color.at(x, y, c); !std::isfinite(v))
                halves[size_t(x)] = nonfinite_half(v);
    };
    const size_t count = color.pixels() * size_t(channels);
    std::vector<uint8_t> bytes(2 * count);
    size_t at = 0;
    each_difference<uint16_t>(color.width, color.height, channels, halves_of, [&](uint16_t step) {
        bytes[at] = uint8_t(step >> 8);
        bytes[count + at++] = uint8_t(step & 255);
    });
    return deflated(bytes, head);
}

}  // namespace

Result<std::string> encode_color(const ImageF& rgb) {
    return base64_of(packed_halves(rgb, rgb.channels));
}

Result<std::string> picture_file(const ImageF& color) {
    const int channels = std::min(color.channels, 3);
    std::string head = "PPIC";
    for (const int number : {color.width, color.height, channels})
        for (int shift = 0; shift < 32; shift += 8) head += char(uint32_t(number) >> shift & 255);
    return packed_halves(color, channels, head);
}

Result<std::string> encode_map(const ImageF& map) {
    const auto steps_of = [&](int y, int c, std::vector<uint8_t>& steps) {
        for (int x = 0; x < map.width; ++x) {
            const float v = map.at(x, y, c);
            steps[size_t(x)] =
                uint8_t(std::isnan(v) ? 255 : std::lround(255 * std::clamp(v, 0.0f, 1.0f)));
        }
    };
    std::vector<uint8_t> bytes;
    bytes.reserve(map.data.size());
    each_difference<uint8_t>(map.width, map.height, map.channels, steps_of,
                             [&](uint8_t step) { bytes.push_back(step); });
    return base64_of(deflated(bytes));
}

}  // namespace postchain::page
