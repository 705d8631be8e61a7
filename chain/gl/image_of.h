// One image of a texture.
#pragma once

namespace postchain::gl {

struct ImageOf {
    int layer = 0;  // of an array
    int level = 0;
    bool operator==(const ImageOf&) const = default;
};

}  // namespace postchain::gl
