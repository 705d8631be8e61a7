#include "tools/sequence/io/png.h"

#include <OpenImageIO/color.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

namespace postchain::io {

Result<std::string> encode_png(const Image<uint8_t>& pixels) try {
    std::vector<unsigned char> png;
    OIIO::Filesystem::IOVecOutput memory(png);
    const auto out = OIIO::ImageOutput::create("png");
    OIIO::ImageSpec spec(pixels.width, pixels.height, pixels.channels, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    if (out == nullptr || !out->set_ioproxy(&memory) || !out->open("memory.png", spec) ||
        !out->write_image(OIIO::TypeDesc::UINT8, pixels.data.data()) || !out->close())
        return Status(StatusCode::output,
                      "cannot encode PNG: " + (out ? out->geterror() : OIIO::geterror()));
    return std::string(reinterpret_cast<const char*>(png.data()), png.size());
} catch (...) {
    return status_of_exception("encoding a PNG");
}

Result<Image<uint8_t>> magma_of(const ImageF& values) try {
    ImageF shown = values;
    for (float& v : shown.data) v = v > 0 ? std::min(v, 1.0f) : 0.0f;
    ImageF colors(values.width, values.height, 3);
    const OIIO::ImageBuf from(
        OIIO::ImageSpec(values.width, values.height, 1, OIIO::TypeDesc::FLOAT), shown.data.data());
    OIIO::ImageBuf to(OIIO::ImageSpec(values.width, values.height, 3, OIIO::TypeDesc::FLOAT),
                      colors.data.data());
    if (!OIIO::ImageBufAlgo::color_map(to, from, 0, "magma"))
        return Status(StatusCode::internal, "magma: " + to.geterror());
    // OpenImageIO keeps its color maps linear; the published magma is display-referred sRGB.
    Image<uint8_t> bytes(values.width, values.height, 3);
    for (size_t i = 0; i < bytes.data.size(); ++i)
        bytes.data[i] = uint8_t(
            std::lround(255 * std::clamp(OIIO::linear_to_sRGB(colors.data[i]), 0.0f, 1.0f)));
    return bytes;
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
