#include "tools/sequence/image/image_calls.h"

#include <OpenImageIO/color.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "chain/base/readable_file.h"
#include "chain/frame/bokeh_kernel.h"
#include "tools/sequence/image/image_codec.h"
#include "tools/sequence/image/ocio_config.h"

namespace postchain::io {
namespace {

Result<Image<uint8_t>> magma_of(const ImageF& values) {
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
}

// Which channels are color or gray, at most three.
std::vector<int> shown_channels(const OIIO::ImageSpec& spec) {
    std::vector<int> channels;
    for (int c = 0; c < spec.nchannels && channels.size() < 3; ++c)
        if (c != spec.alpha_channel && c != spec.z_channel) channels.push_back(c);
    if (channels.size() == 2) channels.pop_back();
    return channels;
}

Status check(const OIIO::ImageSpec& spec, int max_side) {
    const int width = spec.full_width, height = spec.full_height;
    if (spec.deep) return input_error("is deep; flatten it");
    if (spec.depth > 1 || spec.full_depth > 1)
        return input_error("is a volume; one flat picture is needed");
    if (shown_channels(spec).empty())
        return input_error("has no channel of color or gray; write one as R, G, B or Y");
    for (const int side : {width, height, spec.width, spec.height})
        if (side > max_side)
            return input_error(concat("has ", side, " pixels on a side; at most ", max_side,
                                      " are read: make it smaller (", BokehKernel::kSide,
                                      " are used)"));
    if (width != height || width < 1 || spec.width < 1 || spec.height < 1)
        return input_error(
            concat("is ", width, "x", height,
                   " pixels; an aperture image must be square: crop it, or pad it with "
                   "black"));
    return Status();
}

// The display window in gray; black where the file has no pixels.
Result<ImageF> gray_of(OIIO::ImageInput& file, const OIIO::ImageSpec& spec) {
    const std::vector<int> shown = shown_channels(spec);
    const bool straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    const int alpha = straight ? spec.alpha_channel : -1;
    const int channels = std::max(shown.back(), alpha) + 1;
    ImageF data(spec.width, spec.height, channels);
    if (!file.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, data.data.data()))
        return input_error("cannot be read: " + file.geterror() + "; copy or write it again");
    ImageF gray(spec.full_width, spec.full_height, 1);
    for (int y = 0; y < gray.height; ++y)
        for (int x = 0; x < gray.width; ++x) {
            // A file states where its windows are.
            const int64_t from_x = int64_t(x) + spec.full_x - spec.x;
            const int64_t from_y = int64_t(y) + spec.full_y - spec.y;
            if (from_x < 0 || from_y < 0 || from_x >= data.width || from_y >= data.height) continue;
            const auto value = [&](size_t i) {
                const auto stored = [&](int c) { return data.at(int(from_x), int(from_y), c); };
                return stored(shown[i]) * (alpha < 0 ? 1.0f : stored(alpha));
            };
            gray.at(x, y) = shown.size() == 3
                                ? 0.2126f * value(0) + 0.7152f * value(1) + 0.0722f * value(2)
                                : value(0);
            for (size_t i = 0; i < shown.size(); ++i)
                if (!std::isfinite(value(i)) || value(i) < 0)
                    return input_error(concat("pixel ", x, ", ", y, " is ", value(i),
                                              "; the light that passes is a finite number >= 0"));
        }
    return gray;
}

Result<ImageF> read_gray(const std::string& path, int max_side) {
    if (const ReadableFile opened(path); !opened.ok()) return input_error(opened.fault());
    // Color is multiplied by alpha here: some versions of OpenImageIO do it in linear light, others
    // in stored values.
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto file = OIIO::ImageInput::open(path, &config);
    if (!file)
        return input_error("cannot be read: " + OIIO::geterror() + "; copy or write it again");
    const OIIO::ImageSpec spec = file->spec();
    RETURN_IF_ERROR(check(spec, max_side));
    return gray_of(*file, spec);
}

}  // namespace
}  // namespace postchain::io

const postchain::io::ImageCalls* postchain_image_calls() {
    using namespace postchain::io;
    static const ImageCalls calls = {POSTCHAIN_VERSION, OIIO_VERSION_STRING, magma_of,
                                     read_gray,         describe_image,      read_stored_image,
                                     encode_image,      from_ocio_space,     to_ocio_space,
                                     to_ocio_view,      ocio_sources};
    return &calls;
}
