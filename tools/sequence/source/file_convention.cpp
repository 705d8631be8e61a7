#include "tools/sequence/source/file_convention.h"

#include <cmath>

namespace postchain::sequence {

void to_file_convention(ImageF& color, const ConvertOptions& conversion, const ImageF& stored) {
    if (!conversion.unpremultiplied) return;
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        float* rgba = color.data.data() + 4 * pixel;
        const float* was = stored.data.data() + 4 * pixel;
        for (int c = 0; c < 3; ++c)
            if (rgba[3] == was[3] && was[3] != 0 && rgba[c] == was[c] * was[3])
                rgba[c] = was[c];
            else if (rgba[3] != 0)
                rgba[c] /= rgba[3];
            else if (rgba[c] == 0 && was[3] == 0 && std::isfinite(was[c]))
                rgba[c] = was[c];
    }
}

void layer_to_file_convention(ImageF& layer, const ConvertOptions& conversion,
                              const ImageF& color) {
    if (!conversion.unpremultiplied) return;
    for (size_t pixel = 0; pixel < layer.pixels(); ++pixel)
        for (size_t c = 0; c < 3; ++c)
            if (const float alpha = color.data[4 * pixel + 3]; alpha != 0)
                layer.data[4 * pixel + c] /= alpha;
}

}  // namespace postchain::sequence
