// The pass: mode inverse_warp is passes/inverse_warp/inverse_warp.h, the others guertin.h.
#include "passes/motion_blur/motion_blur.h"

#include <algorithm>

#include "passes/motion_blur/guertin.h"
#include "passes/motion_blur/parameters.h"

namespace postchain::motion_blur {
namespace {

// The pass with either filter, Guertin or the inverse warp.
template <class Filter>
class MotionBlurOnFrame final : public Filter {
  public:
    template <class... OfFilter>
    MotionBlurOnFrame(const Parameters& parameters, const FrameDescription& frame,
                      const OfFilter&... of_filter)
        : Filter(of_filter...), parameters_(parameters), frame_(frame) {}

    std::vector<UsedValue> used_values() const override {
        return shutter::used_values(parameters_.shutter, frame_);
    }

    std::vector<Cut> cuts() const override {
        const bool warps = parameters_.mode == Mode::inverse_warp;
        std::vector<Cut> cuts =
            shutter::cuts(parameters_.shutter, frame_,
                          warps ? max_path_px(parameters_, frame_) : tile_px(parameters_, frame_));
        if (!warps)
            for (Cut& cut : cuts) cut.planes = {Role::motion};
        return cuts;
    }

    std::optional<Identity> identity(const PlanContext& context) const override {
        const double shutter = shutter::open_frames(parameters_.shutter, frame_.camera);
        const FrameBounds& bounds = frame_.bounds;
        if (shutter == 0)
            return Identity{kRuleConfiguration, {.name = "shutter_frames", .value = 0}};
        if (bounds.camera_cut) return Identity{kRuleCameraCut, {"motion leads across a cut"}};
        if (context.has_one_color()) return Identity{kRuleFacts, {"all pixels have one color"}};
        const bool reads_back =
            parameters_.mode == Mode::inverse_warp && context.available.has(Role::motion_back);
        const double largest = 0.5 * shutter * bounds.fastest_px(reads_back);
        if (!(largest <= parameters_.min_speed_px)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest half-velocity",
                         .value = largest,
                         .limit = parameters_.min_speed_px,
                         .unit = "px"}};
    }

  private:
    const Parameters& parameters_;
    const FrameDescription& frame_;
};

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

    Guarantees guarantees() const override {
        Guarantees guarantees;
        if (warps()) {
            const FrameDescription any;
            guarantees = inverse_warp::guarantees_of(warp_settings(parameters_, any));
        } else {
            guarantees.keeps_constants = true;
            guarantees.convex = 1e-6;
            // If unset: of a frame up to 640 px wide.
            guarantees.lattice_px = least_tile_px(parameters_);
            guarantees.light = Light::kept;
            // Random numbers belong to places.
            if (jitters_tiles(parameters_) || jitters_taps(parameters_))
                guarantees.light = Light::any;
            else if (!parameters_.shutter.max_blur_fraction)
                guarantees.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn,
                                         Symmetry::shift};
        }
        if (parameters_.min_speed_px >= kQuietSpeedPx) guarantees.driven_by = {Role::motion};
        return guarantees;
    }

    Result<ResolvedPass> resolve(const FrameDescription& frame) const override {
        if (warps()) return ResolvedPass(warp(warp_settings(parameters_, frame), frame));
        return ResolvedPass(guertin(Guertin::depths_of(frame.bounds), frame));
    }

    std::vector<ResolvedPass> every_shape(const FrameDescription& frame) const override {
        std::vector<ResolvedPass> shapes;
        if (warps()) {
            for (const auto& settings :
                 inverse_warp::every_shape(warp_settings(parameters_, frame)))
                shapes.push_back(warp(settings, frame));
        } else {
            for (const auto depths : {Guertin::Depths{true, false}, {false, false}, {false, true}})
                shapes.push_back(guertin(depths, frame));
        }
        return shapes;
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    bool warps() const { return parameters_.mode == Mode::inverse_warp; }

    MotionBlurOnFrame<inverse_warp::WarpOnFrame> warp(const inverse_warp::Settings& settings,
                                                      const FrameDescription& frame) const {
        return {parameters_, frame, settings, frame};
    }
    MotionBlurOnFrame<Guertin> guertin(Guertin::Depths depths,
                                       const FrameDescription& frame) const {
        return {parameters_, frame, parameters_, frame, depths};
    }

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
        .rules = {{kRuleStillBlocks, true, "the blur of blocks that nothing moves into"},
                  {kRuleSkyBlocks, true,
                   "comparing depths in blocks around which there is one depth"},
                  {kRuleUniformBlocks, false,
                   "reading motion and depth of the samples in blocks around which both hardly "
                   "change"}},
        .variants = {{"guertin without jitter",
                      {{"mode", "guertin"}, {"jitter", 0.0}, {"tile_jitter", false}}}}};
    return type;
}

}  // namespace postchain::motion_blur
