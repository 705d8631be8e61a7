// The formats other than EXR for color, and their capabilities.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/sequence/image/transfer.h"

namespace postchain::io {

struct ImageFormat {
    const char* name;  // OpenImageIO's name
    std::vector<const char*> extensions;
    std::vector<int> bits;  // bits of a value; the first is the default for inputs of other formats
    bool alpha;
    bool lossy;
    std::vector<Curve> stated;  // curves that its files can state, in addition to the default one

    // 32: float, any value. HDR's has no sign.
    static bool is_float(int bits) { return bits == 32; }
    bool has_sign() const;
    bool can_have(int bits_of_value) const;
    // Whether values of this curve are read back with it: the file states it, or it is the default
    // (integers srgb, float linear).
    bool tells(Curve curve, int bits_of_value) const;
};

const std::vector<ImageFormat>& image_formats();
// By the extension, case-insensitive; null for EXR and unknown ones.
const ImageFormat* image_format_of(std::string_view path);
// ".png, .tif, ...", for messages.
std::string image_extensions();

}  // namespace postchain::io
