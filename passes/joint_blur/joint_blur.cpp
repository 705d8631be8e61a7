#include "passes/joint_blur/joint_blur.h"

#include <algorithm>

#include "passes/common/lens.h"
#include "passes/common/lens_samples.h"
#include "passes/common/shutter.h"
#include "passes/inverse_warp/inverse_warp.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::joint_blur {
namespace {

using shared::kSharpRadiusPx;  // of displacements too: up to here a pixel keeps its color

struct Parameters {
    int samples = 64;
    int max_samples = 0;
    inverse_warp::Parameters search;
    std::optional<int> max_blur_px;
    shutter::Parameters shutter;
    lens::Parameters lens;
    bool denoise = true;
    lens::ApertureParameters aperture;
    noise::Parameters noise = {.noise = noise::Kind::ign};
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
            .integer("max_samples", &P::max_samples,
                     {.min = 0,
                      .max = lens::kMaxLensSamples,
                      .soft_max = 256,
                      .unit = "samples",
                      .help = "adaptive sampling: samples per pixel in blocks whose samples "
                              "disagree; off unless larger than samples"})
            .rows(&P::search, inverse_warp::parameter_table())
            .integer("max_blur_px", &P::max_blur_px,
                     {.min = 1,
                      .max = 1024,
                      .soft_max = 64,
                      .unit = "px",
                      .help = "largest half-length of a streak",
                      .unset_means = inverse_warp::kDefaultMaxPathText})
            .rows(&P::shutter, shutter::parameter_table())
            .rows(&P::lens, lens::parameter_table())
            .boolean("denoise", &P::denoise,
                     {.help = "remove the noise of the samples if the blur is wider than a few "
                              "pixels"})
            .rows(&P::aperture, lens::aperture_parameter_table())
            .rows(&P::noise, noise::parameter_table())
            .table();
    return rows;
}

inverse_warp::Settings settings_of(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                                   const FrameDescription& frame) {
    const Camera& camera = frame.camera;
    inverse_warp::Settings settings;
    const double open_frames =
        frame.bounds.camera_cut ? 0 : shutter::open_frames(parameters.shutter, camera);
    settings.shutter = {
        .half_open = 0.5 * open_frames,
        .max_path_px = shutter::limit_px(parameters.shutter, parameters.max_blur_px, frame)
                           .value_or(inverse_warp::default_max_path_px(frame))};
    settings.lens = {.coc = coc,
                     .aperture = lens::aperture_of(parameters.aperture, camera, coc.axes)};
    settings.samples = parameters.samples;
    settings.more_samples = std::max(parameters.max_samples - parameters.samples, 0);
    settings.search = parameters.search;
    settings.denoise = parameters.denoise;
    // A few roundings of 2^-24, so that blocks unblurred by the frame's bounds are unblurred here
    // too.
    settings.still_limit_px = kSharpRadiusPx * (1 + 0x1p-18);
    settings.noise = parameters.noise;
    settings.still_rule = kRuleUnblurredBlocks;
    return settings;
}

class JointBlurOnFrame final : public inverse_warp::WarpOnFrame {
  public:
    JointBlurOnFrame(const Parameters& parameters, const inverse_warp::Settings& settings,
                     const FrameDescription& frame)
        : WarpOnFrame(settings, frame), parameters_(parameters) {}

    std::vector<UsedValue> used_values() const override {
        std::vector<UsedValue> values = shutter::used_values(parameters_.shutter, frame());
        for (UsedValue& value :
             lens::used_values(parameters_.lens, settings().lens->coc, frame(), kSharpRadiusPx))
            values.push_back(std::move(value));
        for (UsedValue& value : lens::used_values(parameters_.aperture, frame().camera))
            values.push_back(std::move(value));
        return values;
    }

    std::vector<Cut> cuts() const override {
        std::vector<Cut> cuts =
            shutter::cuts(parameters_.shutter, frame(), settings().shutter->max_path_px);
        for (Cut& cut : lens::cuts(settings().lens->coc, frame())) cuts.push_back(std::move(cut));
        return cuts;
    }

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

  private:
    const Parameters& parameters_;
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
        return ResolvedPass(
            JointBlurOnFrame(parameters_, settings_of(parameters_, coc, frame), frame));
    }

    std::vector<ResolvedPass> every_shape(const FrameDescription& frame) const override {
        std::vector<ResolvedPass> shapes;
        if (!lens::check_aperture(parameters_.aperture, frame.camera).ok()) return shapes;
        const lens::CircleOfConfusion coc = lens::any_circle_of_confusion(parameters_.lens);
        for (const auto& settings : inverse_warp::every_shape(settings_of(parameters_, coc, frame)))
            shapes.push_back(JointBlurOnFrame(parameters_, settings, frame));
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
