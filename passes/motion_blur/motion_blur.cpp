// The pass: mode inverse_warp is passes/inverse_warp/inverse_warp.h, the others guertin.h.
#include "passes/motion_blur/motion_blur.h"

#include <algorithm>

#include "passes/inverse_warp/reference.h"
#include "passes/motion_blur/guertin.h"
#include "passes/motion_blur/parameters.h"
#include "passes/motion_blur/reference.h"

namespace postchain::motion_blur {
namespace {

class MotionBlur final : public Pass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.on_demand = {Role::hint};
        if (warps()) {
            use.required = inverse_warp::required_planes(true);
            use.optional = inverse_warp::optional_planes(true, parameters_.search.neighbors);
            return use;
        }
        use.required = {Role::color, Role::motion};
        if (compares_depth(parameters_)) use.required.add(Role::inverse_depth);
        return use;
    }

    Promises promises() const override {
        Promises promises;
        if (warps()) {
            promises = inverse_warp::promises_of(warp_settings(parameters_, {}));
        } else {
            promises.keeps_constants = true;
            promises.convex = 1e-6;
            promises.lattice_px = parameters_.max_blur_px;
            promises.light = Light::kept;
            // Random numbers belong to places.
            if (jitters_tiles(parameters_) || jitters_taps(parameters_))
                promises.light = Light::any;
            else
                promises.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn,
                                       Symmetry::shift};
        }
        if (parameters_.min_speed_px >= kQuietSpeedPx) promises.driven_by = {Role::motion};
        return promises;
    }

    // A pixel's tile takes the longest vector of the tiles around it, whose far sides lie up to two
    // tiles away; a tile chosen across the nearer border, or variances of four tiles, half a tile
    // more. Taps lie at most r away, and a vector stored in 8 bits may be longer by sqrt(2)/2
    // r/127.
    Reach reach(const FrameDescription& frame) const override {
        if (warps()) return inverse_warp::reach_of(warp_settings(parameters_, frame.camera), frame);
        const double edge = parameters_.max_blur_px;
        const bool further = jitters_tiles(parameters_) || splits_by_variance(parameters_);
        return {(further ? 2.5 : 2) * edge, 1.006 * edge + 0.5};
    }

    Status check(const FrameDescription&) const override { return Status(); }

    std::vector<UsedValue> used_values(const FrameDescription& frame) const override {
        return shutter::used_values(parameters_.shutter, frame, parameters_.max_blur_px);
    }

    std::optional<Identity> identity(const PlanContext& context) const override {
        const FrameDescription& frame = context.frame;
        const double shutter = shutter::open_frames(parameters_.shutter, frame.camera);
        if (shutter == 0)
            return Identity{kRuleConfiguration, {.name = "shutter_frames", .value = 0}};
        if (frame.bounds.camera_cut && context.uses(kRuleCameraCut))
            return Identity{kRuleCameraCut, {"motion leads across a cut"}};
        // Of further layers nothing is known by it.
        if (context.color_is_input && frame.bounds.one_color && context.frame.layers == 0)
            return Identity{kRuleFacts, {"all pixels have one color"}};
        double fastest = frame.bounds.max_speed_px;
        if (warps() && context.available.has(Role::motion_back))
            fastest = std::max(fastest, frame.bounds.max_speed_back_px);
        const double largest = 0.5 * shutter * fastest;
        if (!(largest <= parameters_.min_speed_px)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest half-velocity",
                         .value = largest,
                         .limit = parameters_.min_speed_px,
                         .unit = "px"}};
    }

    void plan(PassPlanner& planner) const override {
        if (!warps()) return plan_guertin(parameters_, planner);
        inverse_warp::plan_warp(planner,
                                warp_settings(parameters_, planner.context().frame.camera));
    }

    ShapeNumbers shape(const PlanContext& context) const override {
        if (!warps()) return guertin_shape(parameters_, context);
        return inverse_warp::shape_of(warp_settings(parameters_, context.frame.camera), context);
    }

    void values(const PlanContext& context, UniformWriter& uniforms) const override {
        if (!warps()) return write_guertin_values(parameters_, context, uniforms);
        inverse_warp::write_values(warp_settings(parameters_, context.frame.camera), context,
                                   uniforms);
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        if (!warps()) return run_reference(parameters_, context, frame);
        inverse_warp::warp_reference(context, warp_settings(parameters_, context.frame.camera),
                                     frame);
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    bool warps() const { return parameters_.mode == Mode::inverse_warp; }

    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type{
        .name = "motion_blur",
        .title = "Motion blur",
        .help = "Feature-aware motion blur from motion vectors and depth (Guertin et al., 2013).",
        .parameters = &parameter_table(),
        .create = [] { return std::make_unique<MotionBlur>(); },
        .rules = {{kRuleStillBlocks, true, "the blur of blocks that nothing moves into",
                   "still_tiles"},
                  {kRuleSkyBlocks, true,
                   "comparing depths in blocks around which there is one depth", "sky_tiles"},
                  {kRuleUniformBlocks, false,
                   "reading motion and depth of the samples in blocks around which both hardly "
                   "change",
                   "uniform_tiles"}},
        .variants = {{"guertin without jitter",
                      {{"mode", "guertin"}, {"jitter", 0.0}, {"tile_jitter", false}}}},
        .known_limits = {
            {"motion", "mode=inverse_warp", "/radiance/firefly", 24, inverse_warp::kBrightPixel},
            {"motion", "mode=inverse_warp", "/nonfinite/inf in color, clamped/", 6.2,
             inverse_warp::kBrightPixel},
            {"motion", "mode=inverse_warp", "/paths/apart, nothing found/fp32", 4.8,
             inverse_warp::kApart},
            {"motion", "", "/radiance/firefly*fp16", 26,
             "few taps: a single pixel's streak is no more than the taps that meet it, and after a "
             "change of 1 % some round the other way"}}};
    return type;
}

}  // namespace postchain::motion_blur
