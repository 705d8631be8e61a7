#include "tools/sequence/image/preview.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "chain/base/readable_file.h"
#include "tools/sequence/image/image_file.h"
#include "tools/sequence/image/png.h"

namespace postchain::io {
namespace {

constexpr const char* kProvenance = "postchain";  // named as the attribute of an EXR

// The first three channels, or gray in each, times `gain`; 0 for non-finite values.
ImageF finite_rgb(const ImageF& color, float gain) {
    ImageF rgb(color.width, color.height, 3);
    for (size_t i = 0; i < color.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) {
            const float value =
                color.data[i * size_t(color.channels) + (color.channels >= 3 ? c : 0)];
            rgb.data[3 * i + c] = std::isfinite(value) ? value * gain : 0;
        }
    return rgb;
}

}  // namespace

Result<Image<uint8_t>> shown_image(const ImageF& color, const PreviewOptions& options) {
    if (color.empty()) return Status(StatusCode::internal, "no pixels");
    const float gain = float(std::exp2(options.exposure_stops));
    if (options.view) {
        ASSIGN_OR_RETURN(const auto pictures, image_module(StatusCode::output));
        ImageF rgb = finite_rgb(color, gain);
        RETURN_IF_ERROR(pictures->to_view(rgb, *options.view));
        Image<uint8_t> bytes(rgb.width, rgb.height, 3);
        for (size_t i = 0; i < bytes.data.size(); ++i) {
            const float v = rgb.data[i];
            bytes.data[i] = uint8_t(std::lround(255 * (v > 0 ? std::min(v, 1.0f) : 0.0f)));
        }
        return bytes;
    }
    const int channels = color.channels >= 3 ? 3 : 1;
    const auto shown = [&](float v) {
        v = std::isfinite(v) ? std::max(v * gain, 0.0f) : 0.0f;
        if (options.curve == ToneCurve::display) v = v / (1 + v);
        if (options.curve != ToneCurve::none) v = std::pow(v, 1 / 2.2f);
        return uint8_t(std::lround(std::min(v, 1.0f) * 255));
    };
    Image<uint8_t> bytes(color.width, color.height, channels);
    for (size_t i = 0; i < color.pixels(); ++i) {
        for (int c = 0; c < channels; ++c) {
            bytes.data[i * size_t(channels) + size_t(c)] =
                shown(color.data[i * size_t(color.channels) + size_t(c)]);
        }
    }
    return bytes;
}

Result<std::string> encode_png_preview(const ImageF& color, const PreviewOptions& options) {
    ASSIGN_OR_RETURN(const auto shown, shown_image(color, options));
    auto png = encode_png(shown);
    if (!png.ok() || options.provenance.empty()) return png;
    return with_png_text(*png, kProvenance, options.provenance);
}

Status write_png_preview(const std::string& path, const ImageF& color,
                         const PreviewOptions& options) try {
    ASSIGN_OR_RETURN(const auto png, encode_png_preview(color, options).at(path));
    return atomic_write_text(path, png, options.on_existing).status();
} catch (...) {
    return status_of_exception(path);
}

std::string preview_provenance(const std::string& path) {
    return png_text(text_of_file(path), kProvenance).value_or("");
}

std::string preview_path(const std::string& output) {
    return std::filesystem::path(output).replace_extension(".png").string();
}

}  // namespace postchain::io
