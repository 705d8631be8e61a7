#include "chain/matte.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "chain/convert.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain {
namespace {

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
    step.taps = uint64_t(frame.width) * uint64_t(frame.height) * uint64_t(layers + 2);
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
    const int width = context.frame.width, height = context.frame.height;
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
    step.taps = uint64_t(width) * uint64_t(height) * uint64_t(3 * context.frame.layers + 7);
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
        const PlanesBefore before(planner, kHeldRoles);
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

}  // namespace

int matte_of(const FrameDescription& frame, size_t pass) {
    return pass < frame.mattes.size() ? frame.mattes[pass] : -1;
}

PlanContext MattedPass::seen(const PlanContext& context) const {
    return {*frame_,        context.precision,      planes(context),
            context.wanted, context.color_is_input, context.rules};
}

RoleSet MattedPass::planes(const PlanContext& context) const {
    // The layer behind may show the object too.
    RoleSet planes = context.available - RoleSet{Role::behind};
    for (const Neighbor neighbor : kNeighbors) {
        const bool layers =
            !context.frame.planes.has(Role::layers) || planes.has(role_of(neighbor, Role::layers));
        if (layers && planes.has(role_of(neighbor, Role::mattes))) continue;
        for (const Role role : kNeighborRoles) planes.remove(role_of(neighbor, role));
    }
    return planes;
}

PlanesBefore::PlanesBefore(const PassPlanner& planner, std::span<const Role> roles) {
    for (const Role role : roles) planes_.emplace_back(role, planner.input(role));
}

void PlanesBefore::restore(PassPlanner& planner) const {
    for (const auto& [role, plane] : planes_) planner.output(role, plane);
}

void restore(std::span<const Role> roles, const std::map<Role, ImageD>& before,
             std::map<Role, ImageD>& planes) {
    for (const Role role : roles) {
        planes.erase(role);
        if (const auto found = before.find(role); found != before.end()) planes.insert(*found);
    }
}

ResolvedPass unblurred(ResolvedPass pass, MattedPass::Seen frame, int matte) {
    return Unblurred(std::move(pass), std::move(frame), matte);
}

FrameDescription with_held_layers(const FrameDescription& frame) {
    FrameDescription held = frame;
    held.layers += 2;
    if (held.fill_layer >= 0) held.fill_layer += 2;
    held.bounds.layers_are_half = false;
    return held;
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

}  // namespace postchain
