#include "chain/pass/matte.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "chain/frame/convert.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain {
namespace {

// Index of the matte that holds for this pass of the chain (FrameDescription::mattes); -1: none.
int matte_of(const FrameDescription& frame, size_t pass) {
    return pass < frame.mattes.size() ? frame.mattes[pass] : -1;
}

// The matte of this index at a pixel of a frame `height` pixels high, in 0..1; NaN counts as 0.
template <class Image>
double matte_at(const Image& mattes, int index, int height, int x, int y) {
    const double m = mattes.at(x, y + index * height);
    return m > 0 ? std::min(m, 1.0) : 0;
}

// A pass on a frame with the effect of a matte around it. The pass sees a frame of its own.
class MattedPass : public PassOnFrame {
  public:
    // The frame that the pass sees and was resolved with.
    using SeenFrame = std::shared_ptr<const FrameDescription>;

    MattedPass(ResolvedPass pass, SeenFrame frame, int matte)
        : pass_(std::make_unique<ResolvedPass>(std::move(pass))),
          frame_(std::move(frame)),
          matte_(matte) {}

    Reach reach() const override { return pass().reach(); }
    std::vector<UsedValue> used_values() const override { return pass().used_values(); }
    std::vector<ExceededLimit> exceeded_limits() const override { return pass().exceeded_limits(); }
    TileEdge tile_edge() const override { return pass().tile_edge(); }
    std::optional<Identity> identity(const PlanContext& context) const override {
        return pass().identity(seen(context));
    }
    ShapeNumbers shape(const PlanContext& context) const override {
        return pass().shape(seen(context));
    }
    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override {
        pass().write_uniforms(seen(context), uniforms);
    }

  protected:
    const PassOnFrame& pass() const { return **pass_; }
    int matte() const { return matte_; }
    PlanContext seen(const PlanContext& context) const {
        return {*frame_,        context.precision,      planes(context),
                context.wanted, context.color_is_input, context.rules,
                context.device};
    }
    // The planes that the pass sees. A neighbor's are available only if its mattes are too.
    virtual RoleSet planes(const PlanContext& context) const {
        // The layer behind may show the object too.
        RoleSet planes = context.available - RoleSet{Role::behind};
        for (const Neighbor neighbor : kNeighbors) {
            const bool layers = !context.frame.planes.has(Role::layers) ||
                                planes.has(role_of(neighbor, Role::layers));
            if (layers && planes.has(role_of(neighbor, Role::mattes))) continue;
            for (const Role role : kNeighborRoles) planes.remove(role_of(neighbor, role));
        }
        return planes;
    }

  private:
    std::unique_ptr<ResolvedPass> pass_;
    SeenFrame frame_;
    int matte_;
};

// The planes of some roles before a pass. restore() puts them in the place of the pass's own.
class SavedPlanes {
  public:
    SavedPlanes(const PassPlanner& planner, std::span<const Role> roles) {
        for (const Role role : roles) planes_.emplace_back(role, planner.input(role));
    }
    void restore(PassPlanner& planner) const {
        for (const auto& [role, plane] : planes_) planner.output(role, plane);
    }

  private:
    std::vector<std::pair<Role, TextureId>> planes_;  // -1: there was none
};

// Likewise in the reference.
void restore(std::span<const Role> roles, const std::map<Role, ImageD>& before,
             std::map<Role, ImageD>& planes) {
    for (const Role role : roles) {
        planes.erase(role);
        if (const auto found = before.find(role); found != before.end()) planes.insert(*found);
    }
}

// If less of a pixel than this is not the object, the filtered color fades to the pixel's own.
constexpr double kMinCoverage = 1.0 / 32;

// Beside the object a soft pixel shows the mean of the pixels around it, each weighted by a
// Gaussian of its distance times (1 - m)^16. Its own color weighs kOwn (1 - m)^16/m, and what the
// sum of weights lacks of kMinWeight.
constexpr int kSpreadReach = 2;
constexpr double kSpreadPx = 1.25;
constexpr double kOwn = 1.0 / 16, kMinWeight = 1.0 / 16;

// The least part of the pixel's own color that its ground must have so that the object's light, c -
// (1 - m) ground, is not below 0.
double own_share(double c, double ground, double kept) {
    if (kept * ground <= c) return 0;
    return ground > c ? std::min((kept * ground - c) / (kept * (ground - c)), 1.0) : 1;
}

// The roles of the planes that hold_out() replaces.
constexpr std::array<Role, 3> kHeldRoles = {Role::layers, Role::layers_before, Role::layers_after};

// The layers that hold_out() makes of a frame or a neighbor.
ImageD held_reference(const std::map<Role, ImageD>& planes, Role color_role, Role matte_role,
                      Role layers_role, int matte) {
    const ImageD &color = planes.at(color_role), &mattes = planes.at(matte_role);
    const int width = color.width, height = color.height;
    const auto own = planes.find(layers_role);
    const int layers = own == planes.end() ? 0 : own->second.height / height;
    ImageD held(width, height * (layers + 2), 4);
    struct Part {
        int x, y;
        double weight;
    };
    const auto parts_of = [&](int x, int y, double m) {
        if (m == 0 || m == 1) return std::vector<Part>{{x, y, 1}};
        std::vector<Part> parts;
        double total = 0;
        for (int j = std::max(y - kSpreadReach, 0); j <= std::min(y + kSpreadReach, height - 1);
             ++j)
            for (int i = std::max(x - kSpreadReach, 0); i <= std::min(x + kSpreadReach, width - 1);
                 ++i) {
                const double square = (i - x) * (i - x) + (j - y) * (j - y);
                const double other = matte_at(mattes, matte, height, i, j);
                const double near =
                    square > 0 ? std::exp(-square / (2 * kSpreadPx * kSpreadPx)) : kOwn / m;
                parts.push_back({i, j, near * std::pow(1 - other, 16)});
                total += parts.back().weight;
            }
        parts.push_back({x, y, std::max(kMinWeight - total, 0.0)});
        for (Part& part : parts) part.weight /= std::max(total, kMinWeight);
        return parts;
    };
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double m = matte_at(mattes, matte, height, x, y);
            const std::vector<Part> parts = parts_of(x, y, m);
            for (int c = 0; c < 4; ++c) {
                // The mean of a plane whose first row here is `row`.
                const auto around = [&](const ImageD& plane, int row) {
                    double sum = 0;
                    for (const Part& part : parts)
                        sum += part.weight * plane.at(part.x, part.y + row, c);
                    return sum;
                };
                const double ground = around(color, 0);
                const double share = own_share(color.at(x, y, c), ground, 1 - m);
                const auto hold = [&](const ImageD& plane, int row, double mean) {
                    return (1 - m) * (mean + share * (plane.at(x, y + row, c) - mean));
                };
                held.at(x, y, c) = hold(color, 0, ground);
                for (int i = 0; i < layers; ++i)
                    held.at(x, y + (i + 2) * height, c) =
                        hold(own->second, i * height, around(own->second, i * height));
            }
            held.at(x, y + height) = 1 - m;
        }
    return held;
}

void hold_out_of(PassPlanner& planner, std::optional<Neighbor> neighbor, int matte, int layers) {
    const auto role = [&](Role own) { return neighbor ? role_of(*neighbor, own) : own; };
    const FrameDescription& frame = planner.context().frame;
    const std::string suffix = neighbor ? concat("_", name_of(*neighbor)) : std::string();
    const TextureId held = planner.layers("held" + suffix, planner.context().layers_format());
    Step step;
    step.name = "hold_out" + suffix;
    step.program = {"common/hold_out.comp", {{"MATTE", std::to_string(matte)}}};
    step.bindings = {{0, planner.input(role(Role::color))},
                     {1, planner.input(role(Role::mattes))},
                     {0, held, Access::write}};
    if (layers > 0) {
        step.program.defines["LAYERS"] = "1";
        step.bindings.push_back({2, planner.input(role(Role::layers))});
    }
    step.take_uniforms<shared::FrameUniforms>();
    step.taps = frame.pixels() * uint64_t(layers + 2);
    planner.step(std::move(step));
    planner.output(role(Role::layers), held);
}

// Adds the steps that make the held layers of this frame and of the neighbors that the context has,
// and hands them on as the frame's layers. `layers`: how many the frame has of its own.
void hold_out(PassPlanner& planner, int matte, int layers) {
    for (const Neighbor neighbor : kNeighbors)
        if (planner.has(role_of(neighbor, Role::layers)))
            hold_out_of(planner, neighbor, matte, layers);
    hold_out_of(planner, {}, matte, layers);
}

// Before and after a pass that filtered held layers.
struct Filtered {
    TextureId color, filtered_color;
    TextureId held, filtered_held;
    TextureId layers;  // the frame's own, unfiltered; -1: it has none
};

// Adds the step that lays the object over the filtered image, and hands on color and layers.
void lay_over(PassPlanner& planner, int matte, const Filtered& filtered) {
    const PlanContext& context = planner.context();
    const TextureId result = planner.texture("matted", context.color_format());
    Step step;
    step.name = "lay_over";
    step.program = {"common/lay_over.comp", {{"MATTE", std::to_string(matte)}}};
    step.bindings = {{0, filtered.color},          {1, planner.input(Role::mattes)},
                     {2, filtered.filtered_color}, {3, filtered.held},
                     {4, filtered.filtered_held},  {0, result, Access::write}};
    if (filtered.layers >= 0) {
        const TextureId layers = planner.layers("matted_layers", context.layers_format());
        step.program.defines["LAYERS"] = "1";
        step.bindings.push_back({5, filtered.layers});
        step.bindings.push_back({1, layers, Access::write});
        planner.output(Role::layers, layers);
    }
    step.take_uniforms<shared::FrameUniforms>();
    step.taps = context.frame.pixels() * uint64_t(3 * context.frame.layers + 7);
    planner.step(std::move(step));
    planner.output(Role::color, result);
}

void lay_over_reference(std::map<Role, ImageD>& planes, const std::map<Role, ImageD>& before,
                        int matte) {
    const ImageD filtered = planes.at(Role::layers);
    const ImageD held = held_reference(before, Role::color, Role::mattes, Role::layers, matte);
    const int height = before.at(Role::color).height, width = filtered.width;
    const int layers = filtered.height / height - 2;
    restore(kHeldRoles, before, planes);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double kept = held.at(x, y + height);
            const double coverage = filtered.at(x, y + height);
            const double trust = std::clamp(coverage / kMinCoverage, 0.0, 1.0);
            const auto lay = [&](ImageD& result, int row, const ImageD& own, int held_row) {
                for (int c = 0; c < 4; ++c) {
                    const double behind = coverage > 0 ? filtered.at(x, held_row, c) / coverage : 0;
                    result.at(x, row, c) =
                        own.at(x, row, c) + trust * (kept * behind - held.at(x, held_row, c));
                }
            };
            lay(planes.at(Role::color), y, before.at(Role::color), y);
            for (int i = 0; i < layers; ++i)
                lay(planes.at(Role::layers), y + i * height, before.at(Role::layers),
                    y + (i + 2) * height);
        }
}

class Unblurred final : public MattedPass {
  public:
    using MattedPass::MattedPass;

    void plan(PassPlanner& planner) const override {
        const PlanContext held_context = seen(planner.context());
        PassPlanner inside = planner.seeing(held_context);
        const SavedPlanes before(planner, kHeldRoles);
        Filtered filtered{};
        filtered.color = planner.input(Role::color);
        filtered.layers = planner.input(Role::layers);
        hold_out(inside, matte(), planner.context().frame.layers);
        filtered.held = inside.input(Role::layers);
        plan_pass(pass(), inside);
        filtered.filtered_color = inside.input(Role::color);
        filtered.filtered_held = inside.input(Role::layers);
        before.restore(planner);
        lay_over(planner, matte(), filtered);
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        for (auto& [role, plane] : frame.planes)
            if (role == Role::color || role == Role::color_before || role == Role::color_after)
                plane = finite_color(std::move(plane));
        const std::map<Role, ImageD> before = frame.planes;
        hold_out_reference(frame.planes, matte());
        pass().reference(seen(context), frame);
        lay_over_reference(frame.planes, before, matte());
        frame.stages.clear();  // they have the held layers
    }

  private:
    RoleSet planes(const PlanContext& context) const override {
        RoleSet planes = MattedPass::planes(context);
        planes.add(Role::layers);
        for (const Neighbor neighbor : kNeighbors)
            if (planes.has(role_of(neighbor, Role::mattes)))
                planes.add(role_of(neighbor, Role::layers));
        return planes;
    }
};

// If object and ground are at two depths and both within kAround pixels of a soft pixel, the pixel
// has the motion of the one whose depth it has. Inverse depths up to this ratio count as one.
constexpr int kAround = 2;
constexpr double kOneDepth = 1.05;

void hold_frame_still(PassPlanner& planner, int matte) {
    const FrameDescription& frame = planner.context().frame;
    const bool back = planner.has(Role::motion_back), depth = planner.has(Role::inverse_depth);
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
    step.taps = frame.pixels() * (back ? 3 : 2);
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
    step.taps = frame.pixels() * 2;
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
        const SavedPlanes before(planner, kStillRoles);
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

FrameDescription with_held_layers(const FrameDescription& frame) {
    FrameDescription held = frame;
    held.layers += 2;
    if (held.fill_layer >= 0) held.fill_layer += 2;
    held.bounds.layers_are_half = false;
    return held;
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

// The frame that a pass with a matte sees, and the effect around the pass.
struct Matted {
    MattedPass::SeenFrame seen;
    ResolvedPass (*effect)(ResolvedPass pass, MattedPass::SeenFrame seen, int matte);
};

template <class Effect>
ResolvedPass with_effect(ResolvedPass pass, MattedPass::SeenFrame frame, int matte) {
    return Effect(std::move(pass), std::move(frame), matte);
}

Matted matted(const ChainLink& link, const FrameDescription& frame, int matte) {
    if (link.keeps_still())
        return {std::make_shared<FrameDescription>(with_still_objects(frame, matte)),
                with_effect<Unmoved>};
    return {std::make_shared<FrameDescription>(with_held_layers(frame)), with_effect<Unblurred>};
}

}  // namespace

Result<ResolvedPass> resolve_link(const Chain& chain, size_t link, const FrameDescription& frame) {
    const ChainLink& one = chain.links[link];
    RETURN_IF_ERROR(one.check_matte());
    const int matte = matte_of(frame, link);
    if (matte < 0 && !one.matte.empty() && !frame.without_mattes)
        return Status(
            StatusCode::input,
            concat("matte ", one.matte, " was not handed in with frame ", frame.frame_number));
    if (matte < 0) return one.pass->resolve(frame);
    const auto [seen, effect] = matted(one, frame, matte);
    ASSIGN_OR_RETURN(auto pass, one.pass->resolve(*seen));
    return effect(std::move(pass), seen, matte);
}

std::vector<ResolvedPass> every_shape(const Chain& chain, size_t link,
                                      const FrameDescription& frame) {
    const ChainLink& one = chain.links[link];
    const int matte = matte_of(frame, link);
    if (matte < 0) return one.pass->every_shape(frame);
    const auto [seen, effect] = matted(one, frame, matte);
    std::vector<ResolvedPass> shapes;
    for (ResolvedPass& pass : one.pass->every_shape(*seen))
        shapes.push_back(effect(std::move(pass), seen, matte));
    return shapes;
}

void hold_out_reference(std::map<Role, ImageD>& planes, int matte) {
    const auto hold = [&](Role color_role, Role matte_role, Role layers_role) {
        if (!planes.count(color_role) || !planes.count(matte_role)) return;
        planes[layers_role] = held_reference(planes, color_role, matte_role, layers_role, matte);
    };
    hold(Role::color, Role::mattes, Role::layers);
    hold(Role::color_before, Role::mattes_before, Role::layers_before);
    hold(Role::color_after, Role::mattes_after, Role::layers_after);
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
