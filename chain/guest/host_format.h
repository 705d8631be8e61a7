// GL's internal formats of a host's textures.
#pragma once

#include <string>

namespace postchain::guest {

struct HostFormat {
    unsigned name = 0;  // GL_RGBA16F
    const char* text = "";
    int channels = 0;
    bool depth = false;
    bool image = false;  // can be written as an image
    bool half = false;   // halves hold every value
    // Largest value of a float format; 0: normalized, or as large as color can be.
    float largest() const;
};

// Null for integer, compressed and unsized formats, and others that no plane can be read from.
const HostFormat* find_format(unsigned internal_format);

// "GL_RGBA16F", "0x8d7c".
std::string text_of_format(unsigned internal_format);

}  // namespace postchain::guest
