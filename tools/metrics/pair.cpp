#include "tools/metrics/pair.h"

#include <cmath>

namespace postchain::metrics {

Result<RgbImage> rgb_image_of(const ImageF& image) {
    if (image.empty()) return Status(StatusCode::input, "the image has no pixels");
    if (image.channels < 3)
        return Status(StatusCode::input, concat("the image has ", image.channels,
                                                " channels, metrics need RGB; write color"));
    RgbImage made;
    made.rgb = ImageF(image.width, image.height, 3);
    for (size_t i = 0; i < image.pixels(); ++i) {
        const float* from = image.data.data() + i * size_t(image.channels);
        float* to = made.rgb.data.data() + 3 * i;
        bool bad = false;
        for (int c = 0; c < 3; ++c) {
            const bool finite = std::isfinite(from[c]);
            to[c] = finite ? from[c] : 0.0f;
            bad = bad || !finite;
        }
        made.nonfinite += bad;
    }
    return made;
}

void composite_over(ImageF& rgba, double gray) {
    for (size_t i = 0; i < rgba.pixels(); ++i) {
        float* pixel = rgba.data.data() + 4 * i;
        for (int c = 0; c < 3; ++c) pixel[c] += float(gray * (1 - double(pixel[3])));
        pixel[3] = 1;
    }
}

Result<Pair> pair_of(RgbImage test, RgbImage reference) {
    const ImageF& a = test.rgb;
    const ImageF& b = reference.rgb;
    if (a.width != b.width || a.height != b.height)
        return Status(StatusCode::input,
                      concat("sizes differ: ", a.width, "x", a.height, " against ", b.width, "x",
                             b.height, "; render both with one size"));
    return Pair{std::move(test), std::move(reference)};
}

Result<Pair> pair_of(const ImageF& test, const ImageF& reference) {
    auto a = rgb_image_of(test);
    if (!a.ok()) return a.status().at("test");
    auto b = rgb_image_of(reference);
    if (!b.ok()) return b.status().at("reference");
    return pair_of(std::move(*a), std::move(*b));
}

}  // namespace postchain::metrics
