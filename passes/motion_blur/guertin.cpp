// Plans the report's filter (modes guertin and single).
//
//   motion         --tile_max------> tile_max [, half_velocity]   the latter where v is stored
//   tile_max       --neighbor_max--> neighbor_max
//   tile_max       --tile_variance-> tile_variance   only with sample_split: variance
//   frame number   --noise---------> noise           only with a jitter
//   neighbor_max [, tile_depth] [, tile_range]
//                  --classify------> work lists of blocks: still, sky, uniform, full
//   motion or half_velocity, neighbor_max, tile_variance, noise, color, inverse_depth
//                  --gather--------> color, hint     the hint only where a later pass reads it
//                                                    keep, gather_sky, gather_uniform: their lists
//
// Tile textures are fp32 whatever the precision: they are small, and the squared length they carry
// beside v does not fit a half.
#include "passes/motion_blur/guertin.h"

#include "chain/layered_step.h"
#include "chain/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/noise.h"
#include "passes/motion_blur/motion_blur.h"
#include "shaders/shared/motion_blur_uniforms.h"

namespace postchain::motion_blur {
namespace {

std::string flag(bool on) {
    return on ? "1" : "0";
}

class Guertin {
  public:
    explicit Guertin(const Parameters& parameters) : parameters_(parameters) {}

    void plan(PassPlanner& planner) const {
        const PlanContext& context = planner.context();
        const shared::MotionBlurUniforms uniforms = make_uniforms(context);
        const Classes classes = classes_of(context);
        if (compares_depth(parameters_) && !classes.depth)
            planner.elide(
                {.kind = ElisionKind::plane,
                 .item = "depth",
                 .rule = kRuleSkyBlocks,
                 .fact = {"the frame has one depth"},
                 .saving = {.taps = pixels_of(context) * uint64_t(parameters_.samples + 1)}});

        Planes planes;
        if (stored())
            planes.half_velocity = planner.texture("half_velocity", velocity_format(),
                                                   context.frame.width, context.frame.height);
        add_tiles(planner, uniforms, classes, planes);
        add_variance(planner, uniforms, planes);
        if (!jitters() && parameters_.noise.noise != noise::Kind::none)
            planner.unused("noise", {"neither tiles nor taps are jittered"});
        planes.noise = noise::add_table(planner, parameters_.noise);
        planes.color = planner.texture("color", context.color_format(), context.frame.width,
                                       context.frame.height);
        if (planner.has(Role::layers))
            planes.layers = planner.layers("layers", context.layers_format(), context.frame.width,
                                           context.frame.height);
        if (planner.wanted(Role::hint)) {
            // Both gates are 0 or 1: 8 bits hold them exactly.
            planes.hint =
                planner.texture("hint", Format::rg8, context.frame.width, context.frame.height);
        } else {
            planner.elide({.kind = ElisionKind::output,
                           .item = "hint",
                           .rule = kRuleUnusedStep,
                           .fact = {"no later pass reads it"},
                           .saving = {.bytes = 2 * pixels_of(context)}});
        }
        if (classes.any())
            add_classed_gathers(planner, uniforms, classes, planes);
        else
            add_gather(planner, uniforms, planes, {"gather", -1, classes.depth, false});
        planner.output(Role::color, planes.color);
        if (planes.hint >= 0) planner.output(Role::hint, planes.hint);
        if (planes.layers >= 0) planner.output(Role::layers, planes.layers);
    }

    // Which depths are compared follows the frame's bounds.
    ShapeNumbers shape(const PlanContext& context) const {
        const Classes classes = classes_of(context);
        return {classes.depth, classes.sky};
    }

    void write_values(const PlanContext& context, UniformWriter& uniforms) const {
        uniforms.set(make_uniforms(context));
        noise::write_values(parameters_.noise, context.frame.frame_number, uniforms);
    }

  private:
    // Which classes of blocks are told apart (classify.comp).
    struct Classes {
        bool still = false, sky = false, uniform = false;
        bool depth = false;  // inverse depths are compared at all
        bool any() const { return still || sky || uniform; }
    };
    // -1 = not needed.
    struct Planes {
        TextureId half_velocity = -1, tile_max = -1, tile_range = -1, tile_depth = -1;
        TextureId neighbor_max = -1, tile_variance = -1, noise = -1;
        TextureId color = -1, hint = -1, layers = -1;
    };
    // One launch of the gather: over a list, or over the whole picture.
    struct Gather {
        const char* name;
        TextureId list;
        bool depth;    // inverse depths are compared
        bool uniform;  // samples are taken to move as the pixel does
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

    static Step make_step(const std::string& name, std::map<std::string, std::string> defines,
                          const shared::MotionBlurUniforms& uniforms) {
        Step step;
        step.name = name;
        step.program = {"motion_blur/" + name + ".comp", std::move(defines)};
        step.set_uniforms(uniforms);
        return step;
    }

    shared::MotionBlurUniforms make_uniforms(const PlanContext& context) const {
        const FrameDescription& frame = context.frame;
        const int edge = parameters_.max_blur_px;
        shared::MotionBlurUniforms uniforms{};
        uniforms.size = {frame.width, frame.height};
        uniforms.tiles = {(frame.width + edge - 1) / edge, (frame.height + edge - 1) / edge};
        uniforms.tile_px = edge;
        uniforms.samples = parameters_.samples;
        uniforms.half_shutter =
            float(0.5 * shutter::open_frames(parameters_.shutter, frame.camera));
        uniforms.still_limit_px = float(still_limit_px(parameters_));
        uniforms.jitter = float(parameters_.jitter);
        uniforms.tile_jitter_slope = float(parameters_.tile_jitter_slope);
        uniforms.center_total = float(parameters_.samples / parameters_.center_weight);
        uniforms.variance_threshold_px = float(parameters_.variance_threshold_px);
        uniforms.depth_softness = float(parameters_.depth_softness);
        return uniforms;
    }

    static uint64_t pixels_of(const PlanContext& context) {
        return uint64_t(context.frame.width) * uint64_t(context.frame.height);
    }

    Classes classes_of(const PlanContext& context) const {
        Classes classes;
        classes.still = context.uses(kRuleStillBlocks);
        const FrameBounds& bounds = context.frame.bounds;
        const bool look = context.uses(kRuleSkyBlocks);
        classes.depth = compares_depth(parameters_) &&
                        !(look && bounds.min_inverse_depth == bounds.max_inverse_depth);
        // Where no pixel is sky there is nothing to look for.
        classes.sky = look && classes.depth && bounds.min_inverse_depth <= 0;
        // With fewer samples one of them weighs too much for the bound (docs/motion_blur.md).
        classes.uniform = context.uses(kRuleUniformBlocks) && parameters_.samples >= 5;
        return classes;
    }

    // motion [, inverse_depth] -> tile_max, neighbor_max [, half_velocity, tile_range, tile_depth]
    void add_tiles(PassPlanner& planner, const shared::MotionBlurUniforms& uniforms,
                   const Classes& classes, Planes& planes) const {
        const int tiles_x = uniforms.tiles.x, tiles_y = uniforms.tiles.y;
        const bool depth = classes.depth && (classes.sky || classes.uniform);
        const auto texture = [&](const char* name, Format format) {
            return planner.texture(name, format, tiles_x, tiles_y);
        };
        planes.tile_max = texture("tile_max", Format::rgba32f);
        planes.neighbor_max = texture("neighbor_max", Format::rgba32f);

        Step tiles = make_step("tile_max",
                               {{"STORAGE", storage_define()},
                                {"RANGE", flag(classes.uniform)},
                                {"DEPTH", flag(depth)}},
                               uniforms);
        tiles.bindings = {{0, planner.input(Role::motion)}, {0, planes.tile_max, Access::write}};
        tiles.groups = {tiles_x, tiles_y, 1};
        tiles.taps = pixels_of(planner.context()) * (depth ? 2 : 1);
        if (stored()) tiles.bindings.push_back({1, planes.half_velocity, Access::write});
        if (classes.uniform) {
            planes.tile_range = texture("tile_range", Format::rgba32f);
            tiles.bindings.push_back({2, planes.tile_range, Access::write});
        }
        if (depth) {
            planes.tile_depth = texture("tile_depth", Format::rg32f);
            tiles.bindings.push_back({1, planner.input(Role::inverse_depth)});
            tiles.bindings.push_back({3, planes.tile_depth, Access::write});
        }
        planner.step(std::move(tiles));

        Step neighbors = make_step("neighbor_max", {{"SINGLE", flag(single())}}, uniforms);
        neighbors.bindings = {{0, planes.tile_max}, {0, planes.neighbor_max, Access::write}};
        neighbors.groups = groups_for(tiles_x, tiles_y);
        neighbors.taps = 9 * uint64_t(tiles_x) * uint64_t(tiles_y);
        planner.step(std::move(neighbors));
    }

    void add_variance(PassPlanner& planner, const shared::MotionBlurUniforms& uniforms,
                      Planes& planes) const {
        if (!splits_by_variance(parameters_))
            planner.unused("tile_variance",
                           {single() ? "mode is single: one direction" : "sample_split is even"});
        planes.tile_variance =
            planner.texture("tile_variance", Format::r32f, uniforms.tiles.x, uniforms.tiles.y);
        Step step = make_step("tile_variance", {}, uniforms);
        step.bindings = {{0, planes.tile_max}, {0, planes.tile_variance, Access::write}};
        step.groups = groups_for(uniforms.tiles.x, uniforms.tiles.y);
        step.taps = 9 * uint64_t(uniforms.tiles.x) * uint64_t(uniforms.tiles.y);
        planner.step(std::move(step));
    }

    // Blocks are sorted into lists, and each list has a launch of its own.
    void add_classed_gathers(PassPlanner& planner, const shared::MotionBlurUniforms& uniforms,
                             const Classes& classes, const Planes& planes) const {
        const FrameDescription& frame = planner.context().frame;
        const auto blocks = groups_for(frame.width, frame.height);
        const bool depth = classes.depth && (classes.sky || classes.uniform);
        Step classify = make_step("classify",
                                  {{"STORAGE", storage_define()},
                                   {"STILL", flag(classes.still)},
                                   {"SKY", flag(classes.sky)},
                                   {"UNIFORM", flag(classes.uniform)},
                                   {"DEPTH", flag(depth)},
                                   {"TILE_JITTER", flag(jitters_tiles(parameters_))}},
                                  uniforms);
        classify.bindings = {{0, planes.neighbor_max}};
        if (depth) classify.bindings.push_back({1, planes.tile_depth});
        if (classes.uniform) classify.bindings.push_back({2, planes.tile_range});
        classify.groups = groups_for(blocks[0], blocks[1]);
        const auto add_list = [&](const char* name, int unit) {
            return add_work_list(planner, classify, unit, name, frame.width, frame.height);
        };
        const TextureId full_blocks = add_list("full_blocks", 0);
        const TextureId still_blocks = classes.still ? add_list("still_blocks", 1) : -1;
        const TextureId sky_blocks = classes.sky ? add_list("sky_blocks", 2) : -1;
        const TextureId uniform_blocks = classes.uniform ? add_list("uniform_blocks", 3) : -1;
        planner.step(std::move(classify));

        const int taps = parameters_.samples + 1;
        if (classes.still) {
            elide_blocks(planner, "gather in still blocks", kRuleStillBlocks,
                         {.name = "half-velocities that reach them",
                          .limit = uniforms.still_limit_px,
                          .unit = "px"},
                         still_blocks, (classes.depth ? 3 : 2) * taps);
            add_keep(planner, still_blocks,
                     {.color = planes.color, .hint = planes.hint, .layers = planes.layers});
        }
        if (classes.sky) {
            elide_blocks(planner, "depth in sky blocks", kRuleSkyBlocks,
                         {"one depth as far as taps reach"}, sky_blocks, taps);
            add_gather(planner, uniforms, planes, {"gather_sky", sky_blocks, false, false});
        }
        if (classes.uniform) {
            elide_blocks(planner, "motion and depth in uniform blocks", kRuleUniformBlocks,
                         {.name = "one motion and one depth layer as far as taps reach; error",
                          .limit = 1e-3},
                         uniform_blocks, (classes.depth ? 2 : 1) * taps - 1);
            add_gather(planner, uniforms, planes, {"gather_uniform", uniform_blocks, false, true});
        }
        add_gather(planner, uniforms, planes, {"gather", full_blocks, classes.depth, false});
    }

    void add_gather(PassPlanner& planner, const shared::MotionBlurUniforms& uniforms,
                    const Planes& planes, const Gather& gather) const {
        const PlanContext& context = planner.context();
        Step step = make_step(
            "gather",
            {{"STORAGE", storage_define()},
             {"SINGLE", flag(single())},
             {"VARIANCE", flag(splits_by_variance(parameters_))},
             {"TILE_JITTER", flag(jitters_tiles(parameters_))},
             {"TAP_JITTER", flag(jitters_taps(parameters_))},
             {"CLAMP", flag(parameters_.border == Border::clamp)},
             {"DOMINANT", flag(parameters_.static_direction == StaticDirection::dominant)},
             {"DEPTH", flag(gather.depth)},
             {"HINT", flag(planes.hint >= 0)},
             {"UNIFORM", flag(gather.uniform)}},
            uniforms);
        step.name = gather.name;
        step.bindings = {{0, planner.input(Role::color)},
                         {1, stored() ? planes.half_velocity : planner.input(Role::motion)},
                         {2, planes.neighbor_max},
                         {0, planes.color, Access::write}};
        if (gather.depth) step.bindings.push_back({3, planner.input(Role::inverse_depth)});
        if (splits_by_variance(parameters_)) step.bindings.push_back({4, planes.tile_variance});
        if (jitters()) step.bindings.push_back({5, planes.noise});
        if (planes.hint >= 0) step.bindings.push_back({1, planes.hint, Access::write});
        launch_by(step, gather.list);
        step.groups = groups_for(context.frame.width, context.frame.height);
        // Color, velocity, depth of each sample and of the pixel, and the tile. How many blocks
        // are in which list is not known here: all count for the last, which costs most.
        const uint64_t taps = uint64_t(parameters_.samples + 1);
        if (step.name == "gather")
            step.taps = pixels_of(context) * ((gather.depth ? 3 : 2) * taps + 1);
        std::vector<Binding> arrays;
        if (planes.layers >= 0)
            arrays = {{6, planner.input(Role::layers)}, {2, planes.layers, Access::write}};
        const uint64_t of_layer = step.name == "gather" ? pixels_of(context) * taps : 0;
        add_layered_step(planner, std::move(step), arrays, of_layer);
    }

    const Parameters& parameters_;
};

}  // namespace

void plan_guertin(const Parameters& parameters, PassPlanner& planner) {
    Guertin(parameters).plan(planner);
}

ShapeNumbers guertin_shape(const Parameters& parameters, const PlanContext& context) {
    return Guertin(parameters).shape(context);
}

void write_guertin_values(const Parameters& parameters, const PlanContext& context,
                          UniformWriter& uniforms) {
    Guertin(parameters).write_values(context, uniforms);
}

}  // namespace postchain::motion_blur
