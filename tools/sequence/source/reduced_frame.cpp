#include "tools/sequence/source/reduced_frame.h"

#include <algorithm>
#include <cmath>

#include "chain/frame/behind.h"
#include "chain/frame/layers.h"
#include "tools/sequence/image/contact_sheet.h"

namespace postchain::sequence {
namespace {

Role role_in_its_frame(Role role) {
    for (const Neighbor neighbor : kNeighbors)
        for (const Role own : kNeighborRoles)
            if (role_of(neighbor, own) == role) return own;
    return role;
}

// A stack of planes, one below the other, each reduced by mean.
ImageF stack_reduced(const ImageF& stack, int height_of_each, int width, int height) {
    std::vector<ImageF> planes;
    for (int i = 0; i < stack.height / height_of_each; ++i)
        planes.push_back(io::shrunk(plane_of_stack(stack, i, height_of_each), width, height));
    return stack_planes(planes);
}

// The layer behind (chain/frame/behind.h): inverse depth and motion are not averaged.
ImageF behind_reduced(const ImageF& stack, int height_of_each, int width, int height) {
    std::vector<ImageF> planes;
    for (int i = 0; i < stack.height / height_of_each; ++i) {
        const ImageF plane = plane_of_stack(stack, i, height_of_each);
        const bool mean = i == 0 || i >= kBehindPlanes;
        planes.push_back(mean ? io::shrunk(plane, width, height)
                              : middle_reduced(plane, width, height));
    }
    ImageF& motion = planes[2];
    for (size_t i = 0; i < motion.data.size(); ++i)
        motion.data[i] *=
            i % 2 == 0 ? float(width) / float(stack.width) : float(height) / float(height_of_each);
    return stack_planes(planes);
}

}  // namespace

int reduced_side(int side, double scale) {
    return std::max(1, int(std::lround(side * scale)));
}

ImageF middle_reduced(const ImageF& image, int width, int height) {
    ImageF reduced(width, height, image.channels);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int from_x = std::min(image.width - 1, int((x + 0.5) * image.width / width));
            const int from_y = std::min(image.height - 1, int((y + 0.5) * image.height / height));
            std::copy_n(image.pixel(from_x, from_y), image.channels, reduced.pixel(x, y));
        }
    return reduced;
}

void reduce_frame(SourceFrame& source, double scale) {
    FrameDescription& frame = source.description;
    const int width = reduced_side(frame.width, scale);
    const int height = reduced_side(frame.height, scale);
    const float scale_x = float(width) / float(frame.width);
    const float scale_y = float(height) / float(frame.height);
    for (auto& [role, plane] : source.planes) {
        const Role own = role_in_its_frame(role);
        ImageF reduced = own == Role::color    ? io::shrunk(*plane, width, height)
                         : own == Role::behind ? behind_reduced(*plane, frame.height, width, height)
                         : is_stacked(own)     ? stack_reduced(*plane, frame.height, width, height)
                                               : middle_reduced(*plane, width, height);
        if (own == Role::motion || own == Role::motion_back)
            for (size_t i = 0; i < reduced.pixels(); ++i) {
                reduced.data[2 * i] *= scale_x;
                reduced.data[2 * i + 1] *= scale_y;
            }
        plane = std::make_shared<const ImageF>(std::move(reduced));
    }
    frame.width = width;
    frame.height = height;
    frame.display_width = reduced_side(frame.display_width, scale);
    frame.display_height = reduced_side(frame.display_height, scale);
    frame.origin_x = int(std::lround(frame.origin_x * scale));
    frame.origin_y = int(std::lround(frame.origin_y * scale));
    const double speed_scale = std::max(scale_x, scale_y);
    frame.bounds.max_speed_px *= speed_scale;
    frame.bounds.max_speed_back_px *= speed_scale;
    frame.bounds.color_is_half = false;
}

}  // namespace postchain::sequence
