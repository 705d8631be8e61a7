#include "tools/measure/experiment/pixel_classes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "passes/common/shutter.h"

namespace postchain::experiment {
namespace {

using metrics::PixelClass;

// Radius of the circle of confusion, px.
class ThinLens {
  public:
    explicit ThinLens(const FrameDescription& frame) {
        const Camera& c = frame.camera;
        if (!c.focal_length_mm || !c.sensor_width_mm || !c.f_stop || !c.focus_distance) return;
        const double f = *c.focal_length_mm / 1000 /
                         c.meters_per_unit.value_or(kDefaultMetersPerUnit);  // scene units
        gain_ =
            0.5 * (f / *c.f_stop) * *c.focal_length_mm * frame.display_width / *c.sensor_width_mm;
        focus_ = 1 / *c.focus_distance;
    }
    double radius(double inverse_depth) const { return gain_ * std::abs(focus_ - inverse_depth); }

  private:
    double gain_ = 0, focus_ = 0;
};

// max over q of field(q) - |p - q|, distances by steps to the eight neighbors.
void spread(ImageF& field) {
    const auto take = [&](int x, int y, int dx, int dy) {
        if (!field.inside(x + dx, y + dy)) return;
        const float step = dx && dy ? std::numbers::sqrt2_v<float> : 1;
        field.at(x, y) = std::max(field.at(x, y), field.at(x + dx, y + dy) - step);
    };
    for (int y = 0; y < field.height; ++y)
        for (int x = 0; x < field.width; ++x)
            for (const auto& [dx, dy] : {std::pair(-1, 0), {-1, -1}, {0, -1}, {1, -1}})
                take(x, y, dx, dy);
    for (int y = field.height - 1; y >= 0; --y)
        for (int x = field.width - 1; x >= 0; --x)
            for (const auto& [dx, dy] : {std::pair(1, 0), {1, 1}, {0, 1}, {-1, 1}})
                take(x, y, dx, dy);
}

// Above 0 within reach of a jump in depth: inverse depth is linear along a flat surface, so that
// its second difference is 0 there.
ImageF outline_field(const ImageF& depth, const ImageF& radius) {
    ImageF field(depth.width, depth.height, 1, -1);
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x)
            for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}}) {
                if (!depth.inside(x - dx, y - dy) || !depth.inside(x + dx, y + dy)) continue;
                const auto of_three = [&](const ImageF& image) {
                    return std::max(
                        {image.at(x - dx, y - dy), image.at(x, y), image.at(x + dx, y + dy)});
                };
                const double change = double(depth.at(x - dx, y - dy)) - 2 * depth.at(x, y) +
                                      double(depth.at(x + dx, y + dy));
                if (std::abs(change) > kDepthJump * double(of_three(depth)))
                    field.at(x, y) =
                        std::max(field.at(x, y), float(kOutlineReachPx) + of_three(radius));
            }
    spread(field);
    return field;
}

}  // namespace

Image<PixelClass> pixel_classes(const FrameDescription& frame,
                                const std::function<const ImageF*(Role)>& plane) {
    Image<PixelClass> classes(frame.width, frame.height, 1, PixelClass::still);
    const ThinLens lens(frame);
    const double shutter = shutter::open_frames({}, frame.camera);
    const ImageF* depth = plane(Role::inverse_depth);
    ImageF blur(frame.width, frame.height, 1);  // radius of motion and lens together
    for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
            double speed = 0;
            for (const Role role : {Role::motion, Role::motion_back})
                if (const ImageF* motion = plane(role))
                    speed = std::max(
                        speed, std::hypot(double(motion->at(x, y)), double(motion->at(x, y, 1))));
            const double defocus = depth ? lens.radius(double(depth->at(x, y))) : 0;
            if (speed > kMovingPx) classes.at(x, y) = PixelClass::moving;
            if (defocus > kDefocusedPx) classes.at(x, y) = PixelClass::defocused;
            blur.at(x, y) = float(0.5 * shutter * speed + defocus);
        }
    if (!depth) return classes;
    const ImageF outline = outline_field(*depth, blur);
    for (size_t i = 0; i < classes.data.size(); ++i)
        if (outline.data[i] > 0) classes.data[i] = PixelClass::outline;
    return classes;
}

}  // namespace postchain::experiment
