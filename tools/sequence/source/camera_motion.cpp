#include "tools/sequence/source/camera_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "chain/base/parameter.h"

namespace postchain::sequence {
namespace {

constexpr float kMovesPx = 0.5f;  // per frame
constexpr double kNearlyAll = 0.9;

using Direction = std::array<double, 3>;

Rotation product(const Rotation& a, const Rotation& b) {
    Rotation r{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            for (size_t k = 0; k < 3; ++k) r[i][j] += a[i][k] * b[k][j];
    return r;
}

Rotation transposed(const Rotation& r) {
    Rotation t;
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) t[i][j] = r[j][i];
    return t;
}

std::optional<double> focal_px_in(const CameraFile& file, const Camera& metadata, int frame,
                                  const Display& display) {
    // For a zoom, each frame states its focal length.
    if (file.zooms() && !file.frames.contains(frame)) return std::nullopt;
    const Camera camera = frame_camera(metadata, &file, frame, display);
    if (!camera.focal_length_mm || !camera.sensor_width_mm) return std::nullopt;
    return *camera.focal_length_mm * display.width / *camera.sensor_width_mm;
}

std::optional<SkyView> view_in(const CameraFile& file, const Camera& metadata, int frame,
                               const Display& display) {
    const auto found = file.rotations.find(frame);
    if (found == file.rotations.end()) return std::nullopt;
    const auto focal_px = focal_px_in(file, metadata, frame, display);
    if (!focal_px) return std::nullopt;
    SkyView view{found->second, *focal_px, {}};
    if (const auto at = file.places.find(frame); at != file.places.end())
        view.position = at->second;
    return view;
}

std::optional<SkyView> view_in(const std::optional<io::CameraMetadata>& metadata,
                               const CameraFile* file, int frame, const Display& display) {
    if (!metadata || !metadata->pose) return std::nullopt;
    const io::CameraPose& pose = *metadata->pose;
    SkyView view{pose.to_world, 0, pose.position};
    const Camera camera = frame_camera(metadata->camera, file, frame, display);
    if (pose.focal_widths)
        view.focal_px = *pose.focal_widths * display.width;
    else if (camera.focal_length_mm && camera.sensor_width_mm)
        view.focal_px = *camera.focal_length_mm * display.width / *camera.sensor_width_mm;
    else
        return std::nullopt;
    return view;
}

// Continues the camera's motion, rotation and zoom from `other` to `now` by the same amount.
SkyView continued(const SkyView& now, const SkyView& other) {
    SkyView next{product(product(now.to_world, transposed(other.to_world)), now.to_world),
                 now.focal_px * now.focal_px / other.focal_px,
                 {}};
    if (now.position && other.position) {
        next.position.emplace();
        for (size_t i = 0; i < 3; ++i)
            (*next.position)[i] = 2 * (*now.position)[i] - (*other.position)[i];
    }
    return next;
}

// Maps a pixel offset (x, y) from the image center, at inverse depth w, from one view to another.
class Transfer {
  public:
    Transfer(const SkyView& from, const SkyView& to, double aspect)
        : turn_(product(transposed(to.to_world), from.to_world)),
          from_px_(from.focal_px),
          to_px_(to.focal_px),
          aspect_(aspect) {
        if (!from.position || !to.position) return;
        for (size_t i = 0; i < 3; ++i)
            for (size_t k = 0; k < 3; ++k)
                step_[i] += to.to_world[k][i] * ((*from.position)[k] - (*to.position)[k]);
    }

    // Empty if the point is behind the camera.
    std::optional<std::array<double, 2>> operator()(double x, double y, double w) const {
        const Direction d = {x / from_px_, -y / (from_px_ * aspect_), -1};
        Direction e{};
        for (size_t i = 0; i < 3; ++i) {
            for (size_t k = 0; k < 3; ++k) e[i] += turn_[i][k] * d[k];
            e[i] += w * step_[i];
        }
        if (!(e[2] < -1e-3)) return std::nullopt;
        return std::array{to_px_ * e[0] / -e[2], -to_px_ * aspect_ * e[1] / -e[2]};
    }

  private:
    Rotation turn_;
    Direction step_ = {};  // camera's step, in the other's axes, scene units
    double from_px_, to_px_, aspect_;
};

// Infinitely far and not clear; the motion of clear pixels does not matter.
bool is_sky(const FramePlanes& planes, size_t pixel) {
    if (!is_infinitely_far(planes.at(Role::inverse_depth).data[pixel])) return false;
    const float* c = planes.at(Role::color).data.data() + 4 * pixel;
    return c[0] != 0 || c[1] != 0 || c[2] != 0 || c[3] != 0;
}

bool has_planes(const FramePlanes& planes) {
    return planes.contains(Role::inverse_depth) && planes.contains(Role::motion);
}

}  // namespace

bool SkyViews::turns() const {
    const auto still = [&](const SkyView& other) {
        return other.to_world == now.to_world && other.focal_px == now.focal_px;
    };
    return !still(before) || !still(after);
}

std::string SkyViews::text() const {
    std::string text;
    for (const SkyView* view : {&now, &before, &after}) {
        for (const auto& row : view->to_world)
            for (double value : row) text += text_of(value) + " ";
        text += text_of(view->focal_px) + " ";
    }
    text += concat(int(knows_before), " ", int(knows_after));
    return text;
}

std::optional<SkyViews> sky_views(const CameraFile* file, const MetadataOf& metadata_of, int frame,
                                  const Display& display, const std::set<int>& cuts) {
    std::optional<io::CameraMetadata> own = metadata_of(frame);
    const bool in_file = file && file->rotations.contains(frame);
    const auto view_of = [&](int number) -> std::optional<SkyView> {
        if (in_file) return view_in(*file, own ? own->camera : Camera(), number, display);
        return view_in(number == frame ? own : metadata_of(number), file, number, display);
    };
    const auto now = view_of(frame);
    if (!now) return std::nullopt;
    std::optional<SkyView> before, after;
    if (!cuts.count(frame - 1)) before = view_of(frame - 1);
    if (!cuts.count(frame)) after = view_of(frame + 1);
    if (!before && !after) return std::nullopt;
    SkyViews views{*now,
                   before ? *before : continued(*now, *after),
                   after ? *after : continued(*now, *before),
                   display.pixel_aspect,
                   before.has_value(),
                   after.has_value()};
    return views;
}

std::optional<Zoom> zoom_of(const CameraFile& file, const Camera& metadata, int frame,
                            const Display& display, const std::set<int>& cuts) {
    const auto now = focal_px_in(file, metadata, frame, display);
    std::optional<double> before, after;
    if (!cuts.count(frame - 1)) before = focal_px_in(file, metadata, frame - 1, display);
    if (!cuts.count(frame)) after = focal_px_in(file, metadata, frame + 1, display);
    if (!now || (!before && !after)) return std::nullopt;
    const Zoom zoom{before ? *before / *now : *now / *after,
                    after ? *after / *now : *now / *before};
    if (zoom.before == 1 && zoom.after == 1) return std::nullopt;
    return zoom;
}

namespace {

// Center of a pixel, from the center of the image, in pixels.
std::array<double, 2> from_center(const FrameDescription& frame, size_t pixel) {
    return {
        frame.origin_x + double(pixel % size_t(frame.width)) + 0.5 - 0.5 * frame.display_width,
        frame.origin_y + double(pixel / size_t(frame.width)) + 0.5 - 0.5 * frame.display_height};
}

// The vector is of sky, and the renderer did not write it.
bool lacks_sky_motion(const FramePlanes& planes, size_t pixel, const float* vector) {
    return vector[0] == 0 && vector[1] == 0 && is_sky(planes, pixel);
}

// Sets the motion vectors for which `wanted` is true; returns the number of their pixels. Each
// plane gets the same vectors whether or not the other is there.
template <class Wanted>
uint64_t set_vectors(const SkyViews& views, FramePlanes& planes, FrameDescription& frame,
                     Wanted wanted) {
    const Transfer to_after(views.now, views.after, views.pixel_aspect);
    const Transfer to_before(views.now, views.before, views.pixel_aspect);
    const auto back = planes.find(Role::motion_back);
    const ImageF& depth = planes.at(Role::inverse_depth);
    uint64_t count = 0;
    double largest = 0, largest_back = 0;
    const auto set = [](float* v, const std::array<double, 2>& motion, double& most) {
        v[0] = float(motion[0]);
        v[1] = float(motion[1]);
        most = std::max(most, std::hypot(double(v[0]), double(v[1])));
    };
    for (size_t pixel = 0; pixel < planes.at(Role::color).pixels(); ++pixel) {
        float* v = planes.at(Role::motion).data.data() + 2 * pixel;
        float* k = back == planes.end() ? nullptr : back->second.data.data() + 2 * pixel;
        const bool sets_forward = wanted(pixel, v), sets_backward = k && wanted(pixel, k);
        if (!sets_forward && !sets_backward) continue;
        const auto [x, y] = from_center(frame, pixel);
        const double w = is_infinitely_far(depth.data[pixel]) ? 0 : double(depth.data[pixel]);
        std::optional<std::array<double, 2>> forward, backward;
        if (const auto at = to_after(x, y, w)) forward = {(*at)[0] - x, (*at)[1] - y};
        if (const auto at = to_before(x, y, w)) backward = {x - (*at)[0], y - (*at)[1]};
        // No frame was rendered on that side: the surface moves as on the other side.
        if (!forward && !views.knows_after) forward = backward;
        if (!backward && !views.knows_before) backward = forward;
        const bool has_forward = sets_forward && forward, has_backward = sets_backward && backward;
        if (has_forward) set(v, *forward, largest);
        if (has_backward) set(k, *backward, largest_back);
        count += has_forward || has_backward;
    }
    FrameBounds& bounds = frame.bounds;
    bounds.max_speed_px = std::max(bounds.max_speed_px, largest);
    if (back != planes.end())
        bounds.max_speed_back_px = std::max(bounds.max_speed_back_px, largest_back);
    return count;
}

}  // namespace

uint64_t fill_sky_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame) {
    if (!has_planes(planes)) return 0;
    return set_vectors(views, planes, frame, [&](size_t pixel, const float* vector) {
        return lacks_sky_motion(planes, pixel, vector);
    });
}

uint64_t add_zoom_motion(const Zoom& zoom, bool keep_sky, FramePlanes& planes,
                         FrameDescription& frame) {
    if (!planes.contains(Role::motion)) return 0;
    keep_sky = keep_sky && has_planes(planes);
    const auto back = planes.find(Role::motion_back);
    FrameBounds& bounds = frame.bounds;
    bounds.max_speed_px = 0;
    if (back != planes.end()) bounds.max_speed_back_px = 0;
    uint64_t count = 0;
    for (size_t pixel = 0; pixel < planes.at(Role::motion).pixels(); ++pixel) {
        float* v = planes.at(Role::motion).data.data() + 2 * pixel;
        float* k = back == planes.end() ? nullptr : back->second.data.data() + 2 * pixel;
        const auto keeps = [&](const float* vector) {
            return keep_sky && lacks_sky_motion(planes, pixel, vector);
        };
        const bool adds_forward = !keeps(v), adds_backward = k && !keeps(k);
        const auto at = from_center(frame, pixel);
        for (size_t i = 0; i < 2; ++i) {
            if (adds_forward) v[i] = float((at[i] + double(v[i])) * zoom.after - at[i]);
            if (adds_backward) k[i] = float(at[i] - (at[i] - double(k[i])) * zoom.before);
        }
        count += adds_forward || adds_backward;
        bounds.max_speed_px = std::max(bounds.max_speed_px, std::hypot(double(v[0]), double(v[1])));
        if (k)
            bounds.max_speed_back_px =
                std::max(bounds.max_speed_back_px, std::hypot(double(k[0]), double(k[1])));
    }
    return count;
}

uint64_t set_camera_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame) {
    if (!has_planes(planes)) return 0;
    for (Role role : {Role::motion, Role::motion_back})
        if (const auto plane = planes.find(role); plane != planes.end())
            std::fill(plane->second.data.begin(), plane->second.data.end(), 0.0f);
    frame.bounds.max_speed_px = 0;
    if (planes.contains(Role::motion_back)) frame.bounds.max_speed_back_px = 0;
    return set_vectors(views, planes, frame, [](size_t, const float*) { return true; });
}

uint64_t SkyCounts::without_motion() const {
    return surfaces > 0 && double(moving) >= kNearlyAll * double(surfaces) ? sky : 0;
}

SkyCounts count_sky(const FramePlanes& planes) {
    SkyCounts count;
    if (!has_planes(planes)) return count;
    const ImageF& motion = planes.at(Role::motion);
    for (size_t pixel = 0; pixel < motion.pixels(); ++pixel) {
        const float* v = motion.data.data() + 2 * pixel;
        if (!is_infinitely_far(planes.at(Role::inverse_depth).data[pixel])) {
            ++count.surfaces;
            count.moving += v[0] * v[0] + v[1] * v[1] > kMovesPx * kMovesPx;
        } else if (v[0] == 0 && v[1] == 0 && is_sky(planes, pixel)) {
            ++count.sky;
        }
    }
    return count;
}

}  // namespace postchain::sequence
