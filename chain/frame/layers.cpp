#include "chain/frame/layers.h"

#include <cassert>
#include <cstddef>

namespace postchain {

ImageF stack_planes(const std::vector<ImageF>& planes) {
    ImageF stack;
    for (const ImageF& plane : planes) {
        assert(stack.empty() || (plane.width == stack.width && plane.channels == stack.channels));
        stack.width = plane.width;
        stack.height += plane.height;
        stack.channels = plane.channels;
        stack.data.insert(stack.data.end(), plane.data.begin(), plane.data.end());
    }
    return stack;
}

ImageF plane_of_stack(const ImageF& stack, int index, int height) {
    ImageF plane(stack.width, height, stack.channels);
    assert((index + 1) * height <= stack.height);
    const size_t values = plane.data.size();
    const auto first = stack.data.begin() + std::ptrdiff_t(size_t(index) * values);
    plane.data.assign(first, first + std::ptrdiff_t(values));
    return plane;
}

}  // namespace postchain
