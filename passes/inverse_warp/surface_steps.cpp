#include "passes/inverse_warp/surface_steps.h"

#include <string_view>
#include <utility>

#include "passes/inverse_warp/uniforms.h"

namespace postchain::inverse_warp {
namespace {

constexpr Area kSquares = Area().in_squares(INVERSE_WARP_SQUARE_PX);

Role role_in(std::optional<Neighbor> neighbor, Role role) {
    return neighbor ? role_of(*neighbor, role) : role;
}

std::string suffix_of(std::optional<Neighbor> neighbor) {
    return neighbor ? concat("_", name_of(*neighbor)) : std::string();
}

// The steps of a neighbor: constants, because uniforms are written without an allocation.
constexpr std::array<std::string_view, 4> steps_of(Neighbor neighbor) {
    if (neighbor == Neighbor::before)
        return {"surfaces_before", "light_before", "bright_edges_before", "shown_surfaces_before"};
    return {"surfaces_after", "light_after", "bright_edges_after", "shown_surfaces_after"};
}

}  // namespace

void write_surface_uniforms(const NeighborList& neighbors, shared::InverseWarpUniforms uniforms,
                            UniformWriter& writer) {
    uniforms.second_half = 1;
    writer.set("second_surfaces", uniforms);
    for (const Neighbor neighbor : neighbors) {
        uniforms.neighbor = frames_to(neighbor);
        uniforms.second_half = neighbor == *neighbors.begin() ? 0 : 1;
        for (const std::string_view step : steps_of(neighbor)) writer.set(step, uniforms);
    }
}

std::string flag(bool on) {
    return on ? "1" : "0";
}

SurfacePlanner::SurfacePlanner(PassPlanner& planner, const Settings& settings)
    : planner_(planner),
      settings_(settings),
      frame_(planner.context().frame),
      motion_(holds_motion(settings, planner.context())),
      second_layer_(uses_second_layer(settings, planner.context())),
      blocks_(groups_for(frame_.width, frame_.height)),
      pixels_(frame_.pixels()) {}

Step SurfacePlanner::make_step(const std::string& name) const {
    Step step;
    step.name = name;
    step.program.file = "inverse_warp/" + name + ".comp";
    step.take_uniforms<shared::InverseWarpUniforms>();
    return step;
}

Step SurfacePlanner::make_surface_step(const std::string& name) const {
    Step step = make_step(name);
    step.program.defines = {{"SHUTTER", flag(settings_.shutter.has_value())},
                            {"LENS", flag(settings_.lens.has_value())},
                            {"MOTION", flag(motion_)}};
    if (settings_.lens)
        step.program.defines[settings_.lens->coc.lens ? "COC_LENS" : "COC_PLANES"] = "1";
    return step;
}

TextureId SurfacePlanner::add_surfaces() {
    Packed packed = {
        planner_.texture("surfaces", surface_format(), second_layer_ ? Area().two() : Area())};
    add_packed(packed);
    add_shown(packed);
    if (second_layer_) add_second_surfaces(packed.surfaces);
    return packed.surfaces;
}

void SurfacePlanner::add_second_surfaces(TextureId surfaces) {
    Step step = make_surface_step("second_surfaces");
    step.program.defines["SECOND_LAYER"] = "1";
    step.program.defines["NEIGHBOR"] = step.program.defines["BACK"] = "0";
    step.bindings = {{0, planner_.input(Role::behind)}, {0, surfaces, Access::write}};
    step.taps = 9 * pixels_;
    planner_.step(std::move(step));
}

TextureId SurfacePlanner::add_surfaces_of(const NeighborList& neighbors, TextureId surfaces_here) {
    if (neighbors.empty()) return -1;
    const TextureId surfaces = planner_.texture("neighbor_surfaces", surface_format(),
                                                neighbors.size() == 2 ? Area().two() : Area());
    for (const Neighbor neighbor : neighbors) {
        Packed packed = {surfaces, neighbor, surfaces_here};
        add_packed(packed);
        add_light(packed);
        add_shown(packed);
    }
    return surfaces;
}

Step SurfacePlanner::make_surface_step_of(const Packed& packed, const std::string& name) const {
    Step step = make_surface_step(name);
    step.name += suffix_of(packed.neighbor);
    return step;
}

Step SurfacePlanner::make_plane_step(const Packed& packed, const std::string& name) const {
    const auto role = [&](Role of) { return role_in(packed.neighbor, of); };
    const bool back = motion_ && planner_.has(role(Role::motion_back));
    Step step = make_surface_step_of(packed, name);
    step.spread = groups_for(kSquares);
    step.program.defines["BACK"] = flag(back);
    step.program.defines["NEIGHBOR"] = flag(packed.neighbor.has_value());
    step.bindings = {{0, planner_.input(role(Role::inverse_depth))},
                     {0, packed.surfaces, Access::write}};
    if (motion_) step.bindings.push_back({1, planner_.input(role(Role::motion))});
    if (back) step.bindings.push_back({2, planner_.input(role(Role::motion_back))});
    return step;
}

void SurfacePlanner::add_packed(Packed& packed) {
    packed.marks = planner_.texture("marks" + suffix_of(packed.neighbor), Format::r32ui, kSquares);
    Step step = make_plane_step(packed, "surfaces");
    step.bindings.push_back({1, packed.marks, Access::write});
    if (packed.neighbor) step.bindings.push_back({3, packed.here});
    // All pixels and, at most, all once more as edges.
    step.taps = pixels_ * 20;
    planner_.step(std::move(step));
}

void SurfacePlanner::add_light(Packed& packed) {
    constexpr Area kCells = Area().in_squares(INVERSE_WARP_LIGHT_CELL_PX);
    const Neighbor neighbor = *packed.neighbor;
    packed.light = planner_.texture("light" + suffix_of(neighbor), Format::rgba32f, kCells);
    Step step = make_surface_step_of(packed, "light");
    step.spread = groups_for(kCells);
    step.bindings = {{0, planner_.input(role_of(neighbor, Role::color))},
                     {1, packed.surfaces},
                     {2, planner_.input(Role::color)},
                     {3, packed.here},
                     {0, packed.light, Access::write}};
    step.taps = pixels_;  // four of each fourth pixel
    planner_.step(std::move(step));
}

void SurfacePlanner::add_shown(const Packed& packed) {
    const TextureId shown =
        planner_.texture("shown" + suffix_of(packed.neighbor), Format::r32ui, kSquares.times(2, 1));
    Step edges = make_surface_step_of(packed, "bright_edges");
    edges.spread = groups_for(kSquares);
    edges.bindings = {{0, planner_.input(role_in(packed.neighbor, Role::color))},
                      {1, packed.surfaces},
                      {2, packed.marks},
                      {0, shown, Access::write}};
    edges.taps = 10 * pixels_;
    planner_.step(std::move(edges));

    Step step = make_plane_step(packed, "shown_surfaces");
    step.bindings.push_back({3, shown});
    if (packed.neighbor) {
        step.bindings.push_back({4, packed.here});
        step.bindings.push_back({5, packed.light});
        step.bindings.push_back({6, packed.marks});
    }
    step.taps = 10 * pixels_;
    planner_.step(std::move(step));
}

}  // namespace postchain::inverse_warp
