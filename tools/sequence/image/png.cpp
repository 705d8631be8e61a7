#include "tools/sequence/image/png.h"

#include <png.h>

#include "tools/sequence/image/image_module.h"

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

}  // namespace postchain::io
