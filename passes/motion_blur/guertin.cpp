// The report's filter (modes guertin and single): its plan.
//
//   motion         --tile_max------> tile_max [, half_velocity]   the latter if v is stored
//   tile_max       --neighbor_max--> neighbor_max
//   tile_max       --tile_variance-> tile_variance   only with sample_split: variance
//   frame number   --noise---------> noise           only with a jitter
//   neighbor_max [, tile_depth]
//                  --classify------> work lists of blocks: still, sky, full
//   motion or half_velocity, neighbor_max, tile_variance, noise, color, inverse_depth
//                  --gather--------> color, hint     the hint only if a later pass reads it
//                                                    keep, gather_sky: their lists
//
// Tile textures are fp32 whatever the precision: they are small, and the squared length they carry
// beside v does not fit a half.
#include "passes/motion_blur/guertin.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "chain/pass/pass.h"
#include "chain/pass/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/noise.h"
#include "passes/motion_blur/reference.h"
#include "shaders/shared/motion_blur_uniforms.h"

namespace postchain::motion_blur {
namespace {

using shared::MotionBlurUniforms;

// The classes of blocks that are told apart (classify.comp).
struct Classes {
    bool still = false, sky = false;
    bool depth = false;  // inverse depths are compared at all
};

Classes classes_of(const Parameters& parameters, Guertin::Depths depths,
                   const PlanContext& context) {
    Classes classes;
    classes.still = context.uses(kRuleStillBlocks);
    const bool look = context.uses(kRuleSkyBlocks);
    classes.depth = compares_depth(parameters) && !(look && depths.one);
    // Without sky there is nothing to look for.
    classes.sky = look && classes.depth && depths.sky;
    return classes;
}

struct Tiles {
    int x, y;
};
Tiles tiles_of(const Parameters& parameters, const FrameDescription& frame) {
    const int edge = tile_px(parameters, frame);
    return {(frame.width + edge - 1) / edge, (frame.height + edge - 1) / edge};
}

MotionBlurUniforms uniforms_of(const Parameters& parameters, const FrameDescription& frame) {
    const Tiles tiles = tiles_of(parameters, frame);
    MotionBlurUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.tiles = {tiles.x, tiles.y};
    uniforms.tile_px = tile_px(parameters, frame);
    uniforms.samples = parameters.samples;
    uniforms.half_shutter = float(0.5 * shutter::open_frames(parameters.shutter, frame.camera));
    uniforms.still_limit_px = float(still_limit_px(parameters, uniforms.tile_px));
    uniforms.jitter = float(parameters.jitter);
    uniforms.tile_jitter_slope = float(parameters.tile_jitter_slope);
    uniforms.center_total = float(parameters.samples / parameters.center_weight);
    uniforms.variance_threshold_px = float(parameters.variance_threshold_px);
    uniforms.depth_softness = float(parameters.depth_softness);
    return uniforms;
}

class Planner {
  public:
    Planner(PassPlanner& planner, const Parameters& parameters, Classes classes)
        : planner_(planner),
          parameters_(parameters),
          classes_(classes),
          pixels_(planner.context().frame.pixels()),
          tiles_(tiles_of(parameters, planner.context().frame)) {}

    void plan() {
        if (compares_depth(parameters_) && !classes_.depth)
            planner_.elide({.kind = ElisionKind::plane,
                            .item = "depth",
                            .rule = kRuleSkyBlocks,
                            .fact = {"the frame has one depth"},
                            .saving = {.taps = pixels_ * uint64_t(parameters_.samples + 1)}});
        Planes planes;
        if (stored()) planes.half_velocity = picture("half_velocity", velocity_format());
        const TextureId tile_depth = add_tiles(planes);
        planes.tile_variance = add_variance(planes.tile_max);
        if (!jitters() && parameters_.noise.noise != noise::Kind::none)
            planner_.unused("noise", {"neither tiles nor taps are jittered"});
        planes.noise = noise::add_table(planner_, parameters_.noise);
        planes.color = picture("color", planner_.context().color_format());
        if (planner_.has(Role::layers))
            planes.layers = planner_.layers("layers", planner_.context().layers_format());
        planes.hint = add_hint();
        if (classes_.still || classes_.sky)
            add_classed_gathers(planes, tile_depth);
        else
            add_gather(planes, {"gather", -1, classes_.depth});
        planner_.output(Role::color, planes.color);
        if (planes.hint >= 0) planner_.output(Role::hint, planes.hint);
        if (planes.layers >= 0) planner_.output(Role::layers, planes.layers);
    }

  private:
    // -1 = not needed.
    struct Planes {
        TextureId half_velocity = -1, tile_max = -1, neighbor_max = -1, tile_variance = -1;
        TextureId noise = -1, color = -1, hint = -1, layers = -1;
    };
    // One launch of the gather: over a list, or over the whole frame.
    struct Gather {
        const char* name;
        TextureId list;
        bool depth;  // inverse depths are compared
    };

    bool single() const { return parameters_.mode == Mode::single; }
    bool jitters() const { return jitters_tiles(parameters_) || jitters_taps(parameters_); }
    bool stored() const { return parameters_.velocity_storage != VelocityStorage::automatic; }
    Format velocity_format() const {
        const VelocityStorage storage = parameters_.velocity_storage;
        if (storage == VelocityStorage::fp16) return Format::rg16f;
        return storage == VelocityStorage::unorm8 ? Format::rg8 : Format::rg32f;
    }
    std::string storage_define() const {
        switch (parameters_.velocity_storage) {
            case VelocityStorage::fp16:
                return "1";
            case VelocityStorage::unorm8:
                return "2";
            case VelocityStorage::fp32:
                return "3";
            default:
                return "0";
        }
    }

    TextureId picture(const char* name, Format format) { return planner_.texture(name, format); }
    TextureId tile_texture(const char* name, Format format) {
        return planner_.texture(name, format, Area::tiles());
    }
    // Named as its shader.
    Step make_step(const std::string& file, std::map<std::string, std::string> defines) const {
        Step step;
        step.name = std::filesystem::path(file).stem().string();
        step.program = {file, std::move(defines)};
        planner_.context().choose_form(step.program);
        step.take_uniforms<MotionBlurUniforms>();
        return step;
    }

    // motion [, inverse_depth] -> tile_max, neighbor_max [, half_velocity] [, tile_depth]. Returns
    // tile_depth.
    TextureId add_tiles(Planes& planes) {
        planes.tile_max = tile_texture("tile_max", Format::rgba32f);
        planes.neighbor_max = tile_texture("neighbor_max", Format::rgba32f);
        TextureId tile_depth = -1;
        Step tiles = make_step("motion_blur/tile_max.comp",
                               {{"STORAGE", storage_define()}, {"DEPTH", flag(classes_.sky)}});
        tiles.bindings = {{0, planner_.input(Role::motion)}, {0, planes.tile_max, Access::write}};
        tiles.spread = Area::tiles();
        tiles.taps = pixels_ * (classes_.sky ? 2 : 1);
        if (stored()) tiles.bindings.push_back({1, planes.half_velocity, Access::write});
        if (classes_.sky) {
            tile_depth = tile_texture("tile_depth", Format::rg32f);
            tiles.bindings.push_back({1, planner_.input(Role::inverse_depth)});
            tiles.bindings.push_back({3, tile_depth, Access::write});
        }
        planner_.step(std::move(tiles));

        Step neighbors = make_step("motion_blur/neighbor_max.comp", {{"SINGLE", flag(single())}});
        neighbors.bindings = {{0, planes.tile_max}, {0, planes.neighbor_max, Access::write}};
        neighbors.spread = groups_for(Area::tiles());
        neighbors.taps = 9 * uint64_t(tiles_.x) * uint64_t(tiles_.y);
        planner_.step(std::move(neighbors));
        return tile_depth;
    }

    TextureId add_variance(TextureId tile_max) {
        if (!splits_by_variance(parameters_))
            planner_.unused("tile_variance",
                            {single() ? "mode is single: one direction" : "sample_split is even"});
        const TextureId variance = tile_texture("tile_variance", Format::r32f);
        Step step = make_step("motion_blur/tile_variance.comp", {});
        step.bindings = {{0, tile_max}, {0, variance, Access::write}};
        step.spread = groups_for(Area::tiles());
        step.taps = 9 * uint64_t(tiles_.x) * uint64_t(tiles_.y);
        planner_.step(std::move(step));
        return variance;
    }

    TextureId add_hint() {
        // Both gates are 0 or 1: 8 bits hold them exactly.
        if (planner_.wanted(Role::hint)) return picture("hint", Format::rg8);
        planner_.elide({.kind = ElisionKind::output,
                        .item = "hint",
                        .rule = kRuleUnusedStep,
                        .fact = {"no later pass reads it"},
                        .saving = {.bytes = 2 * pixels_}});
        return -1;
    }

    // Blocks are sorted into lists, and each list has a launch of its own.
    void add_classed_gathers(const Planes& planes, TextureId tile_depth) {
        Step classify = make_step("motion_blur/classify.comp",
                                  {{"STORAGE", storage_define()},
                                   {"STILL", flag(classes_.still)},
                                   {"SKY", flag(classes_.sky)},
                                   {"TILE_JITTER", flag(jitters_tiles(parameters_))}});
        classify.bindings = {{0, planes.neighbor_max}};
        if (tile_depth >= 0) classify.bindings.push_back({1, tile_depth});
        classify.spread = groups_for(groups_for(Area()));
        const auto add_list = [&](const char* name, int unit) {
            return add_work_list(planner_, classify, unit, name);
        };
        const TextureId full_blocks = add_list("full_blocks", 0);
        const TextureId still_blocks = classes_.still ? add_list("still_blocks", 1) : -1;
        const TextureId sky_blocks = classes_.sky ? add_list("sky_blocks", 2) : -1;
        planner_.step(std::move(classify));

        const int taps = parameters_.samples + 1;
        if (classes_.still) {
            elide_blocks(planner_, "gather in still blocks", kRuleStillBlocks,
                         {.name = "half-velocities that reach them",
                          .limit = float(still_limit_px(
                              parameters_, tile_px(parameters_, planner_.context().frame))),
                          .unit = "px"},
                         still_blocks, (classes_.depth ? 3 : 2) * taps);
            add_keep(planner_, still_blocks,
                     {.color = planes.color, .hint = planes.hint, .layers = planes.layers});
        }
        if (classes_.sky) {
            elide_blocks(planner_, "depth in sky blocks", kRuleSkyBlocks,
                         {"one depth as far as taps reach"}, sky_blocks, taps);
            add_gather(planes, {"gather_sky", sky_blocks, false});
        }
        add_gather(planes, {"gather", full_blocks, classes_.depth});
    }

    void add_gather(const Planes& planes, const Gather& gather) {
        Step step = make_step(
            "motion_blur/gather.comp",
            {{"STORAGE", storage_define()},
             {"SINGLE", flag(single())},
             {"VARIANCE", flag(splits_by_variance(parameters_))},
             {"TILE_JITTER", flag(jitters_tiles(parameters_))},
             {"TAP_JITTER", flag(jitters_taps(parameters_))},
             {"CLAMP", flag(parameters_.border == Border::clamp)},
             {"DOMINANT", flag(parameters_.static_direction == StaticDirection::dominant)},
             {"DEPTH", flag(gather.depth)},
             {"HINT", flag(planes.hint >= 0)}});
        step.name = gather.name;
        step.bindings = {{0, planner_.input(Role::color)},
                         {1, stored() ? planes.half_velocity : planner_.input(Role::motion)},
                         {2, planes.neighbor_max},
                         {0, planes.color, Access::write}};
        if (gather.depth) step.bindings.push_back({3, planner_.input(Role::inverse_depth)});
        if (splits_by_variance(parameters_)) step.bindings.push_back({4, planes.tile_variance});
        if (jitters()) step.bindings.push_back({5, planes.noise});
        if (planes.hint >= 0) step.bindings.push_back({1, planes.hint, Access::write});
        launch_by(step, gather.list);
        // Color, velocity, depth of each sample and of the pixel, and the tile. The lengths of the
        // lists are not known here: all blocks count for the last one, which costs most.
        const uint64_t taps = uint64_t(parameters_.samples + 1);
        const bool counts = step.name == "gather";
        if (counts) step.taps = pixels_ * ((gather.depth ? 3 : 2) * taps + 1);
        step.group_taps = uint64_t(kBlockPx * kBlockPx) * ((gather.depth ? 3 : 2) * taps + 1);
        std::vector<Binding> arrays;
        if (planes.layers >= 0)
            arrays = {{6, planner_.input(Role::layers)}, {2, planes.layers, Access::write}};
        add_layered_step(planner_, std::move(step), arrays, counts ? pixels_ * taps : 0);
    }

    PassPlanner& planner_;
    const Parameters& parameters_;
    const Classes classes_;
    const uint64_t pixels_;
    const Tiles tiles_;
};

}  // namespace

int tile_px(const Parameters& parameters, const FrameDescription& frame) {
    if (const auto limit = shutter::limit_px(parameters.shutter, parameters.max_blur_px, frame))
        return std::clamp(int(std::lround(*limit)), least_tile_px(parameters), 1024);
    return std::clamp((frame.display_width + 8) / 16, kMinTilePx, 512);
}

int least_tile_px(const Parameters& parameters) {
    if (parameters.shutter.max_blur_fraction) return kMinFractionTilePx;
    return parameters.max_blur_px.value_or(kMinTilePx);
}

double still_limit_px(const Parameters& parameters, int tile_px) {
    switch (parameters.velocity_storage) {
        case VelocityStorage::fp16:  // 11 significant bits per component, subnormal step 2^-24
            return parameters.min_speed_px * (1 + 0x1p-10) + 0x1p-24;
        case VelocityStorage::unorm8:  // half a step of r/127 per component, times sqrt(2)
            return parameters.min_speed_px * (1 + 0x1p-20) + 0.70711 * tile_px / 127.0;
        default:  // a few roundings of 2^-24
            return parameters.min_speed_px * (1 + 0x1p-20);
    }
}

bool compares_depth(const Parameters& parameters) {
    return parameters.depth_softness > 0;
}

bool splits_by_variance(const Parameters& parameters) {
    return parameters.sample_split == SampleSplit::variance && parameters.mode != Mode::single;
}

bool jitters_tiles(const Parameters& parameters) {
    return parameters.tile_jitter && parameters.noise.noise != noise::Kind::none;
}

bool jitters_taps(const Parameters& parameters) {
    return parameters.jitter > 0 && parameters.noise.noise != noise::Kind::none;
}

Guertin::Depths Guertin::depths_of(const FrameBounds& bounds) {
    return {bounds.min_inverse_depth == bounds.max_inverse_depth, bounds.min_inverse_depth <= 0};
}

std::vector<UsedValue> Guertin::used_values() const {
    return shutter::used_values(parameters_.shutter, frame_);
}

std::vector<ExceededLimit> Guertin::exceeded_limits() const {
    std::vector<ExceededLimit> limits =
        shutter::exceeded_limits(parameters_.shutter, frame_, tile_px(parameters_, frame_));
    for (ExceededLimit& limit : limits) limit.planes = {Role::motion};
    return limits;
}

// A pixel's tile takes the longest vector of the tiles around it, whose far sides lie up to two
// tiles away; a tile chosen across the nearer border, or variances of four tiles, half a tile
// more. Taps lie at most r away, and a vector stored in 8 bits may be longer by sqrt(2)/2
// r/127.
Reach Guertin::reach() const {
    const double edge = tile_px(parameters_, frame_);
    const bool further = jitters_tiles(parameters_) || splits_by_variance(parameters_);
    return {(further ? 2.5 : 2) * edge, 1.006 * edge + 0.5};
}

TileEdge Guertin::tile_edge() const {
    return {tile_px(parameters_, frame_), least_tile_px(parameters_)};
}

ShapeNumbers Guertin::shape(const PlanContext& context) const {
    const Classes classes = classes_of(parameters_, depths_, context);
    return {classes.depth, classes.sky};
}

void Guertin::plan(PassPlanner& planner) const {
    Planner(planner, parameters_, classes_of(parameters_, depths_, planner.context())).plan();
}

void Guertin::write_uniforms(const PlanContext&, UniformWriter& uniforms) const {
    uniforms.set(uniforms_of(parameters_, frame_));
    noise::write_uniforms(parameters_.noise, frame_.frame_number, uniforms);
}

void Guertin::reference(const PlanContext& context, ReferenceFrame& frame) const {
    run_reference(parameters_, context, frame);
}

}  // namespace postchain::motion_blur
