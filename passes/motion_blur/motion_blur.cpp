// The pass: mode inverse_warp is passes/inverse_warp/inverse_warp.h, the others guertin.h.
#include "passes/motion_blur/motion_blur.h"

#include "passes/motion_blur/guertin.h"

namespace postchain::motion_blur {
namespace {

const ParameterTable& table() {
    using P = Parameters;
    const RowValue report = {"mode", {"guertin", "single"}};
    const RowValue guertin = {"mode", {"guertin"}};
    const RowValue warp = {"mode", {"inverse_warp"}};
    const RowValue noise = {"noise", {"none"}, true};
    const RowValue time_jitter = {"time_jitter", {"0"}, true};
    const RowValue jitter = {"jitter", {"0"}, true};
    const RowValue tile_jitter = {"tile_jitter", {"true"}};
    static const ParameterTable rows =
        ParameterTableBuilder<P>()
            .choice("mode", &P::mode, {"guertin", "single", "inverse_warp"},
                    {.help = "guertin: the 2013 report's filter; single: every tap along the "
                             "dominant direction, for comparison; inverse_warp: the surface seen "
                             "at the pixel at each shutter time"})
            .integer("samples", &P::samples,
                     {.min = 1,
                      .max = 1023,
                      .soft_max = 33,
                      .odd = true,
                      .unit = "taps",
                      .help = "taps per pixel; inverse_warp: largest number of time samples",
                      .convergence = Convergence::set,
                      .converged = 401})
            .integer("max_blur_px", &P::max_blur_px,
                     {.min = 1,
                      .max = 1024,
                      .soft_max = 64,
                      .unit = "px",
                      .help = "largest half-length of a streak; guertin, single: also the edge "
                              "of a tile",
                      .unset_means = std::string(inverse_warp::kDefaultMaxPathText) +
                                     "; guertin, single: a sixteenth"})
            .rows<shutter::Parameters>(&P::shutter, shutter::parameter_table())
            .number("jitter", &P::jitter,
                    {.min = 0,
                     .max = 1,
                     .soft_min = 0.01,
                     .unit = "tap spacings",
                     .help = "largest shift of a pixel's taps along the streak, either way",
                     .read_if = {{report, noise}}})
            .boolean("tile_jitter", &P::tile_jitter,
                     {.help = "near a tile border, take the neighboring tile's direction at "
                              "random, which hides the tile grid",
                      .read_if = {{report, noise}}})
            .number("tile_jitter_slope", &P::tile_jitter_slope,
                    {.min = 0,
                     .max = 100,
                     .soft_max = 5,
                     .unit = "1/tile",
                     .help = "how fast the probability of the neighboring tile falls from 0.5 "
                             "with the distance to the border",
                     .read_if = {{report, noise, tile_jitter}}})
            .number("center_weight", &P::center_weight,
                    {.min = 0.1,
                     .max = 10000,
                     .soft_max = 1000,
                     .help = "kappa: the pixel's own color weighs samples / (kappa max(|v|, 0.5 "
                             "px)); larger is blurrier",
                     .read_if = {{report}}})
            .number("variance_threshold_px", &P::variance_threshold_px,
                    {.min = 0.01,
                     .max = 100,
                     .soft_max = 10,
                     .unit = "px",
                     .help = "gamma: half-velocities from 0.5 px to this much more fade from the "
                             "static direction to their own",
                     .read_if = {{guertin}}})
            .number("depth_softness", &P::depth_softness,
                    {.min = 0,
                     .max = 100,
                     .soft_min = 0.01,
                     .soft_max = 30,
                     .help = "s: how fast a surface becomes occluded with the ratio of depths; 1 "
                             "is the report, 20 a hard edge, 0 ignores depth",
                     .read_if = {{report}}})
            .choice("sample_split", &P::sample_split, {"even", "variance"},
                    {.help = "taps that follow the pixel's own velocity: every second, or more if "
                             "directions around the tile vary more",
                     .read_if = {{guertin}}})
            .rows<noise::Parameters>(&P::noise, noise::parameter_table(),
                                     {{report, jitter}, {report, tile_jitter}, {warp, time_jitter}})
            .choice("border", &P::border, {"skip", "clamp"},
                    {.help = "taps outside the frame: dropped, or moved to the border",
                     .read_if = {{report}}})
            .choice("static_direction", &P::static_direction, {"perpendicular", "dominant"},
                    {.help = "direction of the second half of the taps at a slow pixel: across "
                             "the dominant motion, or along it",
                     .read_if = {{guertin}}})
            .number("min_speed_px", &P::min_speed_px,
                    {.min = 0,
                     .max = 100,
                     .soft_max = 3,
                     .unit = "px",
                     .help = "half-velocity up to which a tile or block is left unchanged"})
            .rows<inverse_warp::SearchParameters>(&P::search, inverse_warp::search_table(),
                                                  {{warp}})
            .number("path_px_per_time", &P::path_px_per_time,
                    {.min = 0.1,
                     .max = 1000,
                     .soft_max = 8,
                     .unit = "px",
                     .help = "pixels of the longest path in a block per time sample; at least 5 "
                             "time samples, at most samples",
                     .read_if = {{warp}},
                     .convergence = Convergence::set,
                     .converged = 0.1})
            .number("time_jitter", &P::time_jitter,
                    {.min = 0,
                     .max = 1,
                     .unit = "spacings",
                     .help = "random spread of a pixel's time samples; 0 shows steps in long "
                             "streaks, 1 noise",
                     .read_if = {{warp, noise}}})
            .choice("velocity_storage", &P::velocity_storage, {"auto", "fp16", "fp32", "unorm8"},
                    {.help = "storage of half-velocities: auto stores none and reads the motion, "
                             "unorm8 is the report's encoding, for comparison",
                     .read_if = {{report}}})
            .table();
    return rows;
}

// Settings of mode: inverse_warp.
inverse_warp::Settings warp_settings(const Parameters& parameters, const FrameDescription& frame) {
    return {.parameters = parameters,
            .shutter = inverse_warp::shutter_on(frame, parameters),
            // A few roundings of 2^-24, so that motion that is still by the frame's bounds is still
            // here too.
            .still_limit_px = parameters.min_speed_px * (1 + 0x1p-18),
            .still_rule = kRuleStillBlocks};
}

// The pass with either filter, Guertin or the inverse warp.
template <class Filter>
class MotionBlurOnFrame final : public Filter {
  public:
    template <class... OfFilter>
    MotionBlurOnFrame(const Parameters& parameters, const FrameDescription& frame,
                      const OfFilter&... of_filter)
        : Filter(of_filter...), parameters_(parameters), frame_(frame) {}

    std::optional<Identity> identity(const PlanContext& context) const override {
        const double shutter = shutter::open_frames(parameters_.shutter, frame_.camera);
        const FrameBounds& bounds = frame_.bounds;
        if (shutter == 0)
            return Identity{kRuleConfiguration, {.name = "shutter_frames", .value = 0}};
        if (bounds.camera_cut) return Identity{kRuleCameraCut, {"motion leads across a cut"}};
        if (context.has_one_color()) return Identity{kRuleFacts, {"all pixels have one color"}};
        if constexpr (std::is_base_of_v<inverse_warp::WarpOnFrame, Filter>)
            if (inverse_warp::uses_hidden_surfaces(this->settings(), context)) return std::nullopt;
        const bool reads_back =
            parameters_.mode == Mode::inverse_warp && context.available.has(Role::motion_back);
        const double side = shutter::interval(parameters_.shutter, frame_.camera).longer_side();
        const double largest = side * bounds.fastest_px(reads_back);
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
        if (frame.camera.shutter_position.value_or(ShutterPosition::center) !=
            ShutterPosition::center)
            return Status(StatusCode::chain,
                          concat("shutter_position: ",
                                 shutter_position_names()[size_t(*frame.camera.shutter_position)],
                                 " is only supported by mode: inverse_warp; set that, or "
                                 "camera.shutter_position=center for streaks centered on the "
                                 "frame"));
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
        .parameters = &table(),
        .create = [] { return std::make_unique<MotionBlur>(); },
        .rules = {{kRuleStillBlocks, true, "the blur of blocks that nothing moves into"},
                  {kRuleSkyBlocks, true,
                   "comparing depths in blocks around which there is one depth"}},
        .variants = {{"guertin without jitter",
                      {{"mode", "guertin"}, {"jitter", 0.0}, {"tile_jitter", false}}}}};
    return type;
}

}  // namespace postchain::motion_blur
