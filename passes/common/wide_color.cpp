#include "passes/common/wide_color.h"

#include "chain/frame/convert.h"

namespace postchain {

ImageD wide_color(const ReferenceFrame& frame, Role color, Role layers) {
    const ImageD narrow = finite_color(frame.planes.at(color));
    const auto found = frame.planes.find(layers);
    if (found == frame.planes.end()) return narrow;
    const ImageD& stack = found->second;
    const int count = stack.height / narrow.height;
    ImageD wide(narrow.width, narrow.height, 4 + 4 * count);
    for (int y = 0; y < wide.height; ++y)
        for (int x = 0; x < wide.width; ++x)
            for (int c = 0; c < wide.channels; ++c)
                wide.at(x, y, c) = c < 4 ? narrow.at(x, y, c)
                                         : stack.at(x, y + (c / 4 - 1) * narrow.height, c % 4);
    return wide;
}

ImageD color_of_wide(const ImageD& wide) {
    ImageD color(wide.width, wide.height, 4);
    for (int y = 0; y < wide.height; ++y)
        for (int x = 0; x < wide.width; ++x)
            for (int c = 0; c < 4; ++c) color.at(x, y, c) = wide.at(x, y, c);
    return color;
}

ImageD layers_of_wide(const ImageD& wide) {
    ImageD stack(wide.width, wide.height * (wide.channels / 4 - 1), 4);
    for (int y = 0; y < stack.height; ++y)
        for (int x = 0; x < wide.width; ++x)
            for (int c = 0; c < 4; ++c)
                stack.at(x, y, c) = wide.at(x, y % wide.height, 4 * (1 + y / wide.height) + c);
    return stack;
}

void set_wide_color(ReferenceFrame& frame, const ImageD& wide) {
    frame.planes[Role::color] = color_of_wide(wide);
    if (wide.channels == 4) return;
    frame.planes[Role::layers] = layers_of_wide(wide);
    frame.stages["layers"] = frame.planes.at(Role::layers);
}

}  // namespace postchain
