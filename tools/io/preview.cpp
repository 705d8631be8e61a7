// PNG previews: tone curve here, encoding by OpenImageIO into memory, then one atomic file.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "tools/io/exr_writer.h"

namespace postchain::io {

Status write_png_preview(const std::string& path, const ImageF& color,
                         const PreviewOptions& options) {
    if (color.empty()) return Status(StatusCode::internal, concat(path, ": no pixels"));
    const int channels = color.channels >= 3 ? 3 : 1;
    const float gain = float(std::exp2(options.exposure_stops));
    const auto shown = [&](float v) {
        v = std::isfinite(v) ? std::max(v * gain, 0.0f) : 0.0f;
        if (options.curve == ToneCurve::display) v = v / (1 + v);
        if (options.curve != ToneCurve::none) v = std::pow(v, 1 / 2.2f);
        return uint8_t(std::lround(std::min(v, 1.0f) * 255));
    };
    std::vector<uint8_t> bytes(color.pixels() * size_t(channels));
    for (size_t i = 0; i < color.pixels(); ++i) {
        for (int c = 0; c < channels; ++c) {
            bytes[i * size_t(channels) + size_t(c)] =
                shown(color.data[i * size_t(color.channels) + size_t(c)]);
        }
    }

    std::vector<unsigned char> png;
    {
        OIIO::Filesystem::IOVecOutput memory(png);
        const auto out = OIIO::ImageOutput::create("png");
        OIIO::ImageSpec spec(color.width, color.height, channels, OIIO::TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        if (out == nullptr || !out->set_ioproxy(&memory) || !out->open(path, spec) ||
            !out->write_image(OIIO::TypeDesc::UINT8, bytes.data()) || !out->close()) {
            return Status(
                StatusCode::output,
                concat(path, ": cannot encode PNG: ", out ? out->geterror() : OIIO::geterror()));
        }
    }
    const Result<bool> written = atomic_write_text(
        path, {reinterpret_cast<const char*>(png.data()), png.size()}, options.on_existing);
    return written.status();
}

}  // namespace postchain::io
