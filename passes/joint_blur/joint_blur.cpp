#include "passes/joint_blur/joint_blur.h"

#include "passes/common/lens_samples.h"
#include "passes/inverse_warp/inverse_warp.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::joint_blur {
namespace {

using shared::kSharpRadiusPx;  // of displacements too: up to here a pixel keeps its color

struct Parameters : inverse_warp::Parameters {
    Parameters() {
        samples = 64;
        noise.noise = noise::Kind::ign;
    }
};

const ParameterTable& table() {
    using P = Parameters;
    static const ParameterTable rows =
        ParameterTableBuilder<P>()
            .integer("samples", &P::samples,
                     {.min = 1,
                      .max = lens::kMaxLensSamples,
                      .soft_max = 128,
                      .unit = "samples",
                      .help = "samples per pixel, each with a shutter time and a lens sample",
                      .convergence = Convergence::set,
                      .converged = 512})
            .rows<inverse_warp::SearchParameters>(&P::search, inverse_warp::search_table())
            .integer("max_blur_px", &P::max_blur_px,
                     {.min = 1,
                      .max = 1024,
                      .soft_max = 64,
                      .unit = "px",
                      .help = "largest half-length of a streak",
                      .unset_means = inverse_warp::kDefaultMaxPathText})
            .rows<shutter::Parameters>(&P::shutter, shutter::parameter_table())
            .rows<lens::Parameters>(&P::lens, lens::parameter_table())
            .boolean("denoise", &P::denoise,
                     {.help = "remove the noise of the samples if the blur is wider than a few "
                              "pixels"})
            .rows<lens::ApertureParameters>(&P::aperture, lens::aperture_parameter_table())
            .rows<noise::Parameters>(&P::noise, noise::parameter_table())
            .table();
    return rows;
}

inverse_warp::Settings settings_of(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                                   const FrameDescription& frame) {
    inverse_warp::Settings settings{parameters};
    settings.shutter = inverse_warp::shutter_on(frame, parameters);
    if (frame.bounds.camera_cut) settings.shutter->half_open = 0;
    settings.lens = inverse_warp::lens_on(frame, parameters, coc);
    // A few roundings of 2^-24, so that blocks unblurred by the frame's bounds are unblurred here
    // too.
    settings.still_limit_px = kSharpRadiusPx * (1 + 0x1p-18);
    settings.still_rule = kRuleUnblurredBlocks;
    return settings;
}

class JointBlurOnFrame final : public inverse_warp::WarpOnFrame {
  public:
    using WarpOnFrame::WarpOnFrame;

    std::optional<Identity> identity(const PlanContext& context) const override {
        const lens::CircleOfConfusion& coc = settings().lens->coc;
        const FrameBounds& bounds = frame().bounds;
        const double half_open = settings().shutter->half_open;
        if (half_open == 0 && coc.largest_radius_px() <= kSharpRadiusPx)
            return Identity{bounds.camera_cut ? kRuleCameraCut : kRuleConfiguration,
                            {.name = bounds.camera_cut
                                         ? "motion leads across a cut; largest circle-of-confusion "
                                           "radius at any depth"
                                         : "shutter_frames is 0; largest circle-of-confusion "
                                           "radius at any depth",
                             .value = coc.largest_radius_px(),
                             .limit = kSharpRadiusPx,
                             .unit = "px"}};
        if (context.has_one_color()) return Identity{kRuleFacts, {"all pixels have one color"}};
        if (inverse_warp::uses_hidden_surfaces(settings(), context)) return std::nullopt;
        const double largest =
            half_open * bounds.fastest_px(context.available.has(Role::motion_back)) +
            coc.largest_radius_px(bounds.min_inverse_depth, bounds.max_inverse_depth);
        if (!(largest <= kSharpRadiusPx)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest half-velocity and circle-of-confusion radius together",
                         .value = largest,
                         .limit = kSharpRadiusPx,
                         .unit = "px"}};
    }
};

class JointBlur final : public Pass {
  public:
    RoleUse roles() const override {
        return {.required = inverse_warp::required_planes(true),
                .optional = inverse_warp::optional_planes(true, parameters_.search.neighbors),
                .on_demand = {Role::hint},
                .carried = {}};
    }

    Guarantees guarantees() const override {
        const FrameDescription any;
        return inverse_warp::guarantees_of(settings_of(parameters_, {}, any));
    }

    std::vector<Place> depth_places() const override {
        return lens::depth_places(parameters_.lens);
    }

    Result<ResolvedPass> resolve(const FrameDescription& frame) const override {
        ASSIGN_OR_RETURN(const auto coc, lens::circle_of_confusion(parameters_.lens, frame));
        RETURN_IF_ERROR(lens::check_aperture(parameters_.aperture, frame.camera));
        return ResolvedPass(JointBlurOnFrame(settings_of(parameters_, coc, frame), frame));
    }

    std::vector<ResolvedPass> every_shape(const FrameDescription& frame) const override {
        std::vector<ResolvedPass> shapes;
        if (!lens::check_aperture(parameters_.aperture, frame.camera).ok()) return shapes;
        const lens::CircleOfConfusion coc = lens::any_circle_of_confusion(parameters_.lens);
        for (const auto& settings : inverse_warp::every_shape(settings_of(parameters_, coc, frame)))
            shapes.push_back(JointBlurOnFrame(settings, frame));
        return shapes;
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type = {
        .name = "joint_blur",
        .title = "Joint blur",
        .help =
            "Motion blur and depth of field in one: the surface seen at the pixel for each "
            "shutter time and lens sample.",
        .parameters = &table(),
        .create = [] { return std::make_unique<JointBlur>(); },
        .rules = {
            {kRuleUnblurredBlocks, true, "the joint blur of blocks that nothing is blurred into"}}};
    return type;
}

}  // namespace postchain::joint_blur
