#include "chain/hold_still.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "shaders/shared/frame_uniforms.h"

namespace postchain {
namespace {

// If object and ground are at two depths and both within kAround pixels of a soft pixel, the pixel
// has the motion of the one whose depth it has. Inverse depths up to this ratio count as one.
constexpr int kAround = 2;
constexpr double kOneDepth = 1.05;

void hold_frame_still(PassPlanner& planner, int matte) {
    const FrameDescription& frame = planner.context().frame;
    const bool back = planner.has(Role::motion_back), depth = planner.has(Role::inverse_depth);
    const auto flag = [](bool on) { return on ? "1" : "0"; };
    const Format format = plane_format(channels_of(Role::motion), Precision::fp32);
    const TextureId motion = planner.texture("still_motion", format);
    Step step;
    step.name = "hold_still";
    step.program = {
        "common/hold_still.comp",
        {{"MATTE", std::to_string(matte)}, {"BACK", flag(back)}, {"DEPTH", flag(depth)}}};
    step.bindings = {{0, planner.input(Role::motion)},
                     {1, planner.input(Role::mattes)},
                     {0, motion, Access::write}};
    if (depth) step.bindings.push_back({2, planner.input(Role::inverse_depth)});
    if (back) {
        const TextureId still_back = planner.texture("still_motion_back", format);
        step.bindings.push_back({3, planner.input(Role::motion_back)});
        step.bindings.push_back({1, still_back, Access::write});
        planner.output(Role::motion_back, still_back);
    }
    step.take_uniforms<shared::FrameUniforms>();
    step.taps = uint64_t(frame.width) * uint64_t(frame.height) * (back ? 3 : 2);
    planner.step(std::move(step));
    planner.output(Role::motion, motion);
}

void hide_in(PassPlanner& planner, Neighbor neighbor, int matte) {
    const FrameDescription& frame = planner.context().frame;
    const Role role = role_of(neighbor, Role::inverse_depth);
    const std::string suffix = concat("_", name_of(neighbor));
    const TextureId beside =
        planner.texture("beside_object" + suffix, plane_format(channels_of(role), Precision::fp32));
    Step step;
    step.name = "hide_object" + suffix;
    step.program = {"common/hide_object.comp", {{"MATTE", std::to_string(matte)}}};
    step.bindings = {{0, planner.input(role)},
                     {1, planner.input(role_of(neighbor, Role::mattes))},
                     {0, beside, Access::write}};
    step.take_uniforms<shared::FrameUniforms>();
    step.taps = uint64_t(frame.width) * uint64_t(frame.height) * 2;
    planner.step(std::move(step));
    planner.output(role, beside);
}

// The planes that a pass gets others in place of: the frame's motion vectors without the object's
// motion, and its neighbors' inverse depths, below 0 at the object. The object stands elsewhere
// there, and a search that found it would show it twice.
constexpr std::array<Role, 4> kStillRoles = {Role::motion, Role::motion_back,
                                             Role::inverse_depth_before, Role::inverse_depth_after};

// Adds the steps that make these planes and hands them on.
void hold_still(PassPlanner& planner, int matte) {
    hold_frame_still(planner, matte);
    for (const Neighbor neighbor : kNeighbors)
        if (planner.has(role_of(neighbor, Role::mattes)) &&
            planner.has(role_of(neighbor, Role::inverse_depth)))
            hide_in(planner, neighbor, matte);
}

double length_of(const ImageF& plane, int x, int y) {
    return std::hypot(double(plane.at(x, y, 0)), double(plane.at(x, y, 1)));
}

// The vector that the reference gives a pixel: this part of the vector at this place.
struct Still {
    double part = 1;
    int x = 0, y = 0;
};

Still still_at(const ImageD& mattes, const ImageD* depth, int matte, int width, int height, int x,
               int y) {
    const double m = matte_at(mattes, matte, height, x, y);
    const Still scaled{1 - m, x, y};
    if (m == 0 || m == 1 || !depth) return scaled;
    const auto one_depth = [&](int i, int j) {
        const double q = std::max(depth->at(x, y), 0.0), r = std::max(depth->at(i, j), 0.0);
        return q <= kOneDepth * r && r <= kOneDepth * q;
    };
    bool object = false, object_here = false, ground = false, ground_here = false;
    Still nearest{1, x, y};
    int nearest_square = 2 * kAround * kAround + 1;
    for (int j = std::max(y - kAround, 0); j <= std::min(y + kAround, height - 1); ++j)
        for (int i = std::max(x - kAround, 0); i <= std::min(x + kAround, width - 1); ++i) {
            const double other = matte_at(mattes, matte, height, i, j);
            const bool here = one_depth(i, j);
            if (other == 1) {
                object = true;
                object_here = object_here || here;
            } else if (other == 0) {
                ground = true;
                ground_here = ground_here || here;
                const int square = (i - x) * (i - x) + (j - y) * (j - y);
                if (here && square < nearest_square) {
                    nearest = {1, i, j};
                    nearest_square = square;
                }
            }
        }
    if (!object || !ground || object_here == ground_here) return scaled;
    return object_here ? Still{0, x, y} : nearest;
}

void hold_still_reference(std::map<Role, ImageD>& planes, int matte) {
    const auto plane = [&](Role role) {
        const auto found = planes.find(role);
        return found == planes.end() ? nullptr : &found->second;
    };
    const ImageD& mattes = *plane(Role::mattes);
    const ImageD* depth = plane(Role::inverse_depth);
    for (const Role role : {Role::motion, Role::motion_back}) {
        ImageD* vectors = plane(role);
        if (!vectors) continue;
        const ImageD given = *vectors;
        for (int y = 0; y < given.height; ++y)
            for (int x = 0; x < given.width; ++x) {
                const Still still = still_at(mattes, depth, matte, given.width, given.height, x, y);
                for (int c = 0; c < 2; ++c)
                    vectors->at(x, y, c) = still.part * given.at(still.x, still.y, c);
            }
    }
    for (const Neighbor neighbor : kNeighbors) {
        const ImageD* of_neighbor = plane(role_of(neighbor, Role::mattes));
        ImageD* hidden = plane(role_of(neighbor, Role::inverse_depth));
        if (!of_neighbor || !hidden) continue;
        for (int y = 0; y < hidden->height; ++y)
            for (int x = 0; x < hidden->width; ++x)
                if (matte_at(*of_neighbor, matte, hidden->height, x, y) > 0) hidden->at(x, y) = -1;
    }
}

class Unmoved final : public MattedPass {
  public:
    using MattedPass::MattedPass;

    void plan(PassPlanner& planner) const override {
        const PlanContext still_context = seen(planner.context());
        PassPlanner inside = planner.seeing(still_context);
        const PlanesBefore before(planner, kStillRoles);
        hold_still(inside, matte());
        plan_pass(pass(), inside);
        before.restore(planner);
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        const std::map<Role, ImageD> before = frame.planes;
        hold_still_reference(frame.planes, matte());
        pass().reference(seen(context), frame);
        restore(kStillRoles, before, frame.planes);
    }
};

}  // namespace

ResolvedPass unmoved(ResolvedPass pass, MattedPass::Seen frame, int matte) {
    return Unmoved(std::move(pass), std::move(frame), matte);
}

FrameDescription with_still_objects(const FrameDescription& frame, int matte) {
    FrameDescription still = frame;
    const auto known = frame.speeds_beside.find(matte);
    if (known == frame.speeds_beside.end()) return still;
    FrameBounds& bounds = still.bounds;
    bounds.max_speed_px = std::min(bounds.max_speed_px, known->second.px);
    bounds.max_speed_back_px = std::min(bounds.max_speed_back_px, known->second.back_px);
    return still;
}

void find_speeds(const Chain& chain, const PlaneView& planes, FrameDescription& frame) {
    const ImageF* mattes = planes.find(Role::mattes);
    const ImageF *motion = planes.find(Role::motion), *back = planes.find(Role::motion_back);
    if (!mattes || !motion) return;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const int matte = matte_of(frame, i);
        if (matte < 0 || !chain.links[i].keeps_still()) continue;
        // At soft pixels a vector may be that of a pixel beside the object, which counts too.
        Speeds speeds;
        for (int y = 0; y < motion->height; ++y)
            for (int x = 0; x < motion->width; ++x) {
                const double kept = 1 - matte_at(*mattes, matte, motion->height, x, y);
                speeds.px = std::max(speeds.px, kept * length_of(*motion, x, y));
                if (back) speeds.back_px = std::max(speeds.back_px, kept * length_of(*back, x, y));
            }
        frame.speeds_beside[matte] = speeds;
    }
}

}  // namespace postchain
