#include "tools/sequence/image/png.h"

#include <png.h>

#include <cstdint>

#include "tools/sequence/exr/zip.h"
#include "tools/sequence/image/image_file.h"

namespace postchain::io {

Result<std::string> encode_png(const Image<uint8_t>& pixels) try {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = png_uint_32(pixels.width);
    image.height = png_uint_32(pixels.height);
    image.format = pixels.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
    png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string png(bytes, '\0');
    if (!png_image_write_to_memory(&image, png.data(), &bytes, 0, pixels.data.data(), 0, nullptr))
        return Status(StatusCode::output, concat("cannot encode PNG: ", image.message));
    png.resize(bytes);
    return png;
} catch (...) {
    return status_of_exception("encoding a PNG");
}

Result<Image<uint8_t>> magma_of(const ImageF& values) try {
    ASSIGN_OR_RETURN(const auto pictures, image_module(StatusCode::output));
    return pictures->magma_of(values);
} catch (...) {
    return status_of_exception("colors of an error map");
}

std::string base64_of(std::string_view bytes) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const size_t count = std::min<size_t>(3, bytes.size() - i);
        uint32_t group = 0;
        for (size_t k = 0; k < 3; ++k)
            group = group << 8 | (k < count ? uint8_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr size_t kAround = 12;      // bytes around a chunk's data: length, type, CRC
constexpr size_t kHeaderData = 13;  // size of IHDR

std::string big_endian(uint32_t value) {
    return {char(value >> 24), char(value >> 16), char(value >> 8), char(value)};
}

uint32_t big_endian_at(std::string_view bytes, size_t at) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value = value << 8 | uint8_t(bytes[at + i]);
    return value;
}

}  // namespace

std::string with_png_text(std::string_view png, std::string_view keyword, std::string_view text) {
    const size_t behind_header = kSignature.size() + kAround + kHeaderData;
    std::string data = "tEXt";
    data.append(keyword).append(1, '\0').append(text);
    std::string file(png.substr(0, behind_header));
    file += big_endian(uint32_t(data.size() - 4)) + data + big_endian(crc32_of(data));
    return file.append(png.substr(behind_header));
}

std::optional<std::string> png_text(std::string_view png, std::string_view keyword) {
    if (!png.starts_with(kSignature)) return std::nullopt;
    std::optional<std::string> found;
    for (size_t at = kSignature.size(); png.size() - at >= kAround;) {
        const size_t length = big_endian_at(png, at);
        if (length > png.size() - at - kAround) return std::nullopt;
        const std::string_view chunk = png.substr(at + 4, 4 + length);
        if (crc32_of(chunk) != big_endian_at(png, at + 8 + length)) return std::nullopt;
        at += kAround + length;
        const std::string_view type = chunk.substr(0, 4), data = chunk.substr(4);
        if (type == "IEND") return at == png.size() ? found : std::nullopt;
        if (type == "tEXt" && data.substr(0, data.find('\0')) == keyword &&
            data.size() > keyword.size())
            found = std::string(data.substr(keyword.size() + 1));
    }
    return std::nullopt;
}

}  // namespace postchain::io
