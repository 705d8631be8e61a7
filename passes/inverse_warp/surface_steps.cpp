#include "passes/inverse_warp/surface_steps.h"

#include <utility>

#include "passes/inverse_warp/uniforms.h"

namespace postchain::inverse_warp {
namespace {

std::string frame_of(Neighbor neighbor) {
    return neighbor == Neighbor::before ? "-1" : "1";
}

Role role_in(std::optional<Neighbor> neighbor, Role role) {
    return neighbor ? role_of(*neighbor, role) : role;
}

std::string suffix_of(std::optional<Neighbor> neighbor) {
    return neighbor ? concat("_", name_of(*neighbor)) : std::string();
}

}  // namespace

std::string flag(bool on) {
    return on ? "1" : "0";
}

SurfacePlanner::SurfacePlanner(PassPlanner& planner, const Settings& settings)
    : planner_(planner),
      settings_(settings),
      frame_(planner.context().frame),
      motion_(holds_motion(settings, planner.context())),
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

Step SurfacePlanner::make_block_step(const std::string& name) const {
    Step step = make_surface_step(name);
    step.spread = groups_for(kBlocks);
    return step;
}

TextureId SurfacePlanner::add_surfaces() {
    const TextureId of_planes = add_surfaces_of_planes({});
    return add_shown_surfaces({}, of_planes, {});
}

TextureId SurfacePlanner::add_surfaces_of(Neighbor neighbor, TextureId surfaces_here) {
    const TextureId of_planes = add_surfaces_of_planes(neighbor);
    const TextureId light = add_light(neighbor, of_planes, surfaces_here);
    return add_shown_surfaces(neighbor, of_planes, {{2, surfaces_here}, {3, light}});
}

Step SurfacePlanner::make_surface_step_of(std::optional<Neighbor> neighbor,
                                          const std::string& name) const {
    Step step = make_surface_step(name);
    step.name += suffix_of(neighbor);
    return step;
}

TextureId SurfacePlanner::add_surfaces_of_planes(std::optional<Neighbor> neighbor) {
    const auto role = [&](Role of) { return role_in(neighbor, of); };
    const TextureId of_planes =
        planner_.texture("surfaces_of_planes" + suffix_of(neighbor), surface_format());
    const bool back = motion_ && planner_.has(role(Role::motion_back));
    Step step = make_surface_step_of(neighbor, "surfaces");
    step.program.defines["BACK"] = flag(back);
    step.program.defines["NEIGHBOR"] = flag(neighbor.has_value());
    step.bindings = {{0, planner_.input(role(Role::inverse_depth))}, {0, of_planes, Access::write}};
    if (motion_) step.bindings.push_back({1, planner_.input(role(Role::motion))});
    if (back) step.bindings.push_back({2, planner_.input(role(Role::motion_back))});
    step.taps = pixels_ * (motion_ ? (back ? 15 : 10) : 5);
    planner_.step(std::move(step));
    return of_planes;
}

TextureId SurfacePlanner::add_light(Neighbor neighbor, TextureId of_planes,
                                    TextureId surfaces_here) {
    constexpr Area kCells = Area().in_squares(INVERSE_WARP_LIGHT_CELL_PX);
    const TextureId light =
        planner_.texture("light" + suffix_of(neighbor), Format::rgba32f, kCells);
    Step step = make_surface_step_of(neighbor, "light");
    step.program.defines["FRAME"] = frame_of(neighbor);
    step.spread = groups_for(kCells);
    step.bindings = {{0, planner_.input(role_of(neighbor, Role::color))},
                     {1, of_planes},
                     {2, planner_.input(Role::color)},
                     {3, surfaces_here},
                     {0, light, Access::write}};
    step.taps = pixels_;  // four of each fourth pixel
    planner_.step(std::move(step));
    return light;
}

TextureId SurfacePlanner::add_shown_surfaces(std::optional<Neighbor> neighbor, TextureId of_planes,
                                             std::vector<Binding> light) {
    const std::string suffix = suffix_of(neighbor);
    const TextureId shown = planner_.texture("shown" + suffix, Format::r32ui);
    Step edges = make_surface_step_of(neighbor, "bright_edges");
    edges.bindings = {{0, planner_.input(role_in(neighbor, Role::color))},
                      {1, of_planes},
                      {0, shown, Access::write}};
    edges.taps = 10 * pixels_;
    planner_.step(std::move(edges));

    const TextureId surfaces = planner_.texture("surfaces" + suffix, surface_format());
    Step step = make_surface_step_of(neighbor, "shown_surfaces");
    step.program.defines["NEIGHBOR"] = flag(neighbor.has_value());
    if (neighbor) step.program.defines["FRAME"] = frame_of(*neighbor);
    step.bindings = {{0, of_planes}, {1, shown}, {0, surfaces, Access::write}};
    step.bindings.insert(step.bindings.end(), light.begin(), light.end());
    step.taps = (neighbor ? 12 : 10) * pixels_;
    planner_.step(std::move(step));
    return surfaces;
}

}  // namespace postchain::inverse_warp
