#include "chain/frame/behind.h"

#include <algorithm>
#include <vector>

#include "chain/frame/layers.h"

namespace postchain {

ImageF stack_behind(const PlaneView& planes) {
    const ImageF& color = planes.at(Role::color);
    const ImageF& depth = planes.at(Role::inverse_depth);
    const ImageF* motion = planes.find(Role::motion);
    const ImageF* back = planes.find(Role::motion_back);
    ImageF depths(color.width, color.height, 4), motions(color.width, color.height, 4);
    for (size_t pixel = 0; pixel < color.pixels(); ++pixel) {
        depths.data[4 * pixel] = depth.data[pixel];
        if (!motion) continue;
        std::copy_n(&motion->data[2 * pixel], 2, &motions.data[4 * pixel]);
        std::copy_n(&(back ? back : motion)->data[2 * pixel], 2, &motions.data[4 * pixel + 2]);
    }
    std::vector<ImageF> stack = {color, std::move(depths), std::move(motions)};
    if (const ImageF* layers = planes.find(Role::layers)) stack.push_back(*layers);
    return stack_planes(stack);
}

}  // namespace postchain
