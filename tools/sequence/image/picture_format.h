// The formats besides EXR that color may have, and what each can hold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/sequence/image/transfer.h"

namespace postchain::io {

struct PictureFormat {
    const char* name;  // as OpenImageIO has it
    std::vector<const char*> extensions;
    std::vector<int> bits;  // of a value; the first where the input has another format
    bool alpha;
    bool lossy;
    std::vector<Curve>
        stated;  // curves that its files can say, besides what is taken without a word

    // 32: float, which holds any value. HDR's has no sign.
    static bool is_float(int bits) { return bits == 32; }
    bool has_sign() const;
    bool can_have(int bits_of_value) const;
    // Values of this curve are read back as such: the file says so, or says nothing and it is the
    // curve that is taken then (integers srgb, float linear).
    bool tells(Curve curve, int bits_of_value) const;
};

const std::vector<PictureFormat>& picture_formats();
// By the extension, in any case of its letters; null for EXR and all else.
const PictureFormat* picture_format_of(std::string_view path);
// ".png, .tif, ...", for messages.
std::string picture_extensions();

}  // namespace postchain::io
