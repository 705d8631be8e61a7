#include "tools/sequence/image/image_format.h"

#include <algorithm>
#include <filesystem>

namespace postchain::io {

bool ImageFormat::has_sign() const {
    return std::string_view(name) != "hdr";
}

bool ImageFormat::can_have(int bits_of_value) const {
    return std::find(bits.begin(), bits.end(), bits_of_value) != bits.end();
}

bool ImageFormat::tells(Curve curve, int bits_of_value) const {
    return curve == (is_float(bits_of_value) ? Curve::linear : Curve::srgb) ||
           std::find(stated.begin(), stated.end(), curve) != stated.end();
}

const std::vector<ImageFormat>& image_formats() {
    static const std::vector<ImageFormat> formats = {
        {"png",
         {".png"},
         {16, 8},
         true,
         false,
         {Curve::linear, Curve::rec709, Curve::gamma22, Curve::cineon}},
        {"tiff", {".tif", ".tiff"}, {32, 16, 8}, true, false, {}},
        {"dpx",
         {".dpx"},
         {10, 8, 12, 16},
         true,
         false,
         {Curve::linear, Curve::rec709, Curve::cineon}},
        {"jpeg", {".jpg", ".jpeg"}, {8}, false, true, {}},
        {"hdr", {".hdr"}, {32}, false, true, {}},
    };
    return formats;
}

const ImageFormat* image_format_of(std::string_view path) {
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
    for (const ImageFormat& format : image_formats())
        for (const char* known : format.extensions)
            if (extension == known) return &format;
    return nullptr;
}

std::string image_extensions() {
    std::string text;
    for (const ImageFormat& format : image_formats())
        for (const char* extension : format.extensions)
            text += (text.empty() ? "" : ", ") + std::string(extension);
    return text;
}

}  // namespace postchain::io
