#include "passes/common/inverse_warp.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"
#include "passes/common/keep.h"
#include "shaders/shared/inverse_warp_block.h"

namespace postchain::inverse_warp {
namespace {

using shared::InverseWarpBlock;

// Tiles on each side whose surfaces can reach a tile. A surface of a tile may differ by a tenth of
// its path from what its tile has chosen (starts.comp).
int ring_of(double max_path_px) {
    return int(std::ceil(1.1 * max_path_px / kBlockPx)) + 1;
}

InverseWarpBlock block_of(const ShutterSettings& settings, const FrameDescription& frame) {
    const auto tiles = groups_for(frame.width, frame.height);
    InverseWarpBlock block{};
    block.size = {frame.width, frame.height};
    block.tiles = {tiles[0], tiles[1]};
    block.ring = ring_of(settings.max_path_px);
    block.samples = settings.samples;
    block.half_shutter = float(settings.half_shutter);
    block.max_path_px = float(settings.max_path_px);
    block.still_limit_px = float(settings.still_limit_px);
    block.time_jitter = float(settings.time_jitter);
    block.path_px_per_time = float(settings.path_px_per_time);
    return block;
}

Step make_step(const std::string& name, const InverseWarpBlock& block) {
    Step step;
    step.name = name;
    step.program.file = "inverse_warp/" + name + ".comp";
    step.set_block(block);
    return step;
}

std::string flag(bool on) {
    return on ? "1" : "0";
}

}  // namespace

// The tiles that can reach a pixel's tile end `ring` tiles from it, and a surface at their edge is
// told from the pixel next to it. Every position of the search lies on a path that ends at the
// pixel; colors are bilinear.
Reach shutter_reach(double max_path_px) {
    return {kBlockPx * (ring_of(max_path_px) + 1) + 2.0, max_path_px + 2};
}

ShutterPlanes plan_shutter(PassPlanner& planner, const ShutterSettings& settings, TextureId noise) {
    const PlanContext& context = planner.context();
    const FrameDescription& frame = context.frame;
    const InverseWarpBlock block = block_of(settings, frame);
    const uint64_t pixels = uint64_t(frame.width) * uint64_t(frame.height);
    const uint64_t tiles = uint64_t(block.tiles.x) * uint64_t(block.tiles.y);
    const bool back = planner.has(Role::motion_back);
    const bool by_blocks = !settings.still_rule.empty() && context.uses(settings.still_rule);

    const TextureId surfaces =
        planner.texture("surfaces", Format::rgba32ui, frame.width, frame.height);
    Step pack = make_step("surfaces", block);
    pack.program.defines["BACK"] = flag(back);
    pack.bindings = {{0, planner.input(Role::inverse_depth)},
                     {1, planner.input(Role::motion)},
                     {0, surfaces, Access::write}};
    if (back) pack.bindings.push_back({2, planner.input(Role::motion_back)});
    pack.groups = groups_for(frame.width, frame.height);
    pack.taps = pixels * (back ? 15 : 10);
    planner.step(std::move(pack));

    const TextureId tile_surfaces =
        planner.texture("tile_surfaces", Format::rgba32ui, 3 * block.tiles.x, block.tiles.y);
    Step pick_surfaces = make_step("tile_surfaces", block);
    pick_surfaces.bindings = {{0, surfaces}, {0, tile_surfaces, Access::write}};
    pick_surfaces.groups = groups_for(block.tiles.x, block.tiles.y);
    pick_surfaces.taps = 3 * pixels;
    planner.step(std::move(pick_surfaces));

    const std::string count = std::to_string(settings.starts);
    const TextureId starts = planner.texture("starts", Format::rgba32ui,
                                             (settings.starts + 1) * block.tiles.x, block.tiles.y);
    Step pick = make_step("starts", block);
    pick.program.defines = {{"STARTS", count}, {"LISTS", flag(by_blocks)}};
    pick.bindings = {{0, tile_surfaces}, {0, starts, Access::write}};
    pick.groups = groups_for(block.tiles.x, block.tiles.y);
    const uint64_t around = uint64_t(2 * block.ring + 1) * uint64_t(2 * block.ring + 1);
    pick.taps = tiles * 3 * around * uint64_t(std::max(settings.starts, 1));
    TextureId moving = -1, still = -1;
    if (by_blocks) {
        moving = add_work_list(planner, pick, 0, "moving_blocks", frame.width, frame.height);
        still = add_work_list(planner, pick, 1, "still_blocks", frame.width, frame.height);
    }
    planner.step(std::move(pick));

    ShutterPlanes planes;
    planes.color = planner.texture("color", context.color_format(), frame.width, frame.height);
    if (planner.wanted(Role::hint))
        planes.hint = planner.texture("hint", Format::rg8, frame.width, frame.height);
    if (planes.hint < 0)
        planner.elide({.kind = ElisionKind::output,
                       .item = "hint",
                       .rule = kRuleUnusedStep,
                       .fact = {"no later pass reads it"},
                       .saving = {.bytes = 2 * pixels}});
    const auto write = [&](Step& step) {
        step.bindings.push_back({0, planes.color, Access::write});
        step.program.defines["HINT"] = flag(planes.hint >= 0);
        if (planes.hint >= 0) step.bindings.push_back({1, planes.hint, Access::write});
        step.groups = groups_for(frame.width, frame.height);
    };
    if (by_blocks) {
        elide_blocks(
            planner, "search in still blocks", settings.still_rule,
            {.name = "paths that reach them", .limit = settings.still_limit_px, .unit = "px"},
            still, 3 * std::max(settings.samples, kLeastTimes));
        add_keep(planner, still, planes.color, planes.hint);
    }
    Step expose = make_step("shutter", block);
    expose.program.defines = {{"STARTS", count}, {"JITTER", flag(noise >= 0)}};
    expose.bindings = {
        {0, planner.input(Role::color), Access::sample_linear}, {1, surfaces}, {2, starts}};
    if (noise >= 0) expose.bindings.push_back({3, noise});
    write(expose);
    // Two positions and a color for each time, where the first start is right.
    expose.taps = pixels * uint64_t(3 * std::max(settings.samples, kLeastTimes));
    launch_by(expose, moving);
    planner.step(std::move(expose));
    return planes;
}

}  // namespace postchain::inverse_warp
