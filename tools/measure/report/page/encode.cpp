#include "tools/measure/report/page/encode.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "shaders/shared/color_limits.h"
#include "tools/sequence/exr/pixel_encode.h"
#include "tools/sequence/image/png.h"

namespace postchain::report {

namespace {

using shared::kMaxHalf;
constexpr uint16_t kHalfInfinity = 0x7c00;
constexpr uint16_t kHalfNan = 0x7e00;
constexpr int kLevel = 6;  // compression level of zlib

Result<std::string> deflated(const std::vector<uint8_t>& bytes) {
    uLongf size = compressBound(uLong(bytes.size()));
    std::vector<uint8_t> packed(size);
    const int code = compress2(packed.data(), &size, bytes.data(), uLong(bytes.size()), kLevel);
    if (code != Z_OK) return Status(StatusCode::internal, concat("zlib: ", zError(code)));
    return std::string(reinterpret_cast<const char*>(packed.data()), size);
}

// Differences of an image's values, channel by channel.
template <class T>
std::vector<T> differences_of(const Image<T>& image) {
    std::vector<T> steps;
    steps.reserve(image.data.size());
    for (int c = 0; c < image.channels; ++c) {
        T above = 0;
        for (int y = 0; y < image.height; ++y) {
            T left = above;
            if (image.width > 0) above = image.at(0, y, c);
            for (int x = 0; x < image.width; ++x) {
                const T v = image.at(x, y, c);
                steps.push_back(T(v - left));
                left = v;
            }
        }
    }
    return steps;
}

uint16_t nonfinite_half(float v) {
    if (std::isnan(v)) return kHalfNan;
    return v > 0 ? kHalfInfinity : uint16_t(kHalfInfinity | 0x8000);
}

Result<std::string> base64_of(const Result<std::string>& packed) {
    return packed.ok() ? Result<std::string>(io::base64_of(*packed)) : packed;
}

Result<std::string> packed_halves(const ImageF& rgb) {
    std::vector<float> finite(rgb.data.size());
    std::transform(rgb.data.begin(), rgb.data.end(), finite.begin(), [](float v) {
        return std::isnan(v) ? 0.0f : std::clamp(v, -kMaxHalf, kMaxHalf);
    });
    Image<uint16_t> halves(rgb.width, rgb.height, rgb.channels);
    io::floats_to_halves(finite.data(), finite.size(), halves.data.data());
    for (size_t i = 0; i < rgb.data.size(); ++i)
        if (!std::isfinite(rgb.data[i])) halves.data[i] = nonfinite_half(rgb.data[i]);

    const auto steps = differences_of(halves);
    std::vector<uint8_t> bytes(2 * steps.size());
    for (size_t i = 0; i < steps.size(); ++i) {
        bytes[i] = uint8_t(steps[i] >> 8);
        bytes[steps.size() + i] = uint8_t(steps[i] & 255);
    }
    return deflated(bytes);
}

}  // namespace

Result<std::string> encode_color(const ImageF& rgb) {
    return base64_of(packed_halves(rgb));
}

Result<std::string> picture_file(const ImageF& color) {
    const auto packed = packed_halves(color);
    if (!packed.ok()) return packed;
    std::string file = "PPIC";
    for (const int number : {color.width, color.height, color.channels})
        for (int shift = 0; shift < 32; shift += 8) file += char(uint32_t(number) >> shift & 255);
    return file + *packed;
}

Result<std::string> encode_map(const ImageF& map) {
    Image<uint8_t> steps(map.width, map.height, map.channels);
    std::transform(map.data.begin(), map.data.end(), steps.data.begin(), [](float v) {
        return uint8_t(std::isnan(v) ? 255 : std::lround(255 * std::clamp(v, 0.0f, 1.0f)));
    });
    return base64_of(deflated(differences_of(steps)));
}

}  // namespace postchain::report
