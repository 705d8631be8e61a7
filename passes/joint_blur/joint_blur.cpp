#include "passes/joint_blur/joint_blur.h"

#include <algorithm>
#include <cassert>

#include "passes/common/lens.h"
#include "passes/common/lens_points.h"
#include "passes/common/shutter.h"
#include "passes/inverse_warp/reference.h"

namespace postchain::joint_blur {
namespace {

constexpr double kUnblurredPx = 0.5;  // up to here a pixel returns its color bit for bit

struct Parameters {
    int samples = 64;
    int max_samples = 0;
    inverse_warp::Parameters search;
    int max_blur_px = 40;
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
                      .max = lens::kMaxPoints,
                      .soft_max = 128,
                      .unit = "samples",
                      .help = "instants, each with a point of the lens, for each pixel",
                      .convergence = Convergence::set,
                      .converged = 512})
            .integer("max_samples", &P::max_samples,
                     {.min = 0,
                      .max = lens::kMaxPoints,
                      .soft_max = 256,
                      .unit = "samples",
                      .help = "adaptive sampling: so many in tiles whose samples disagree; up to "
                              "samples: as many everywhere"})
            .rows(&P::search, inverse_warp::parameter_table())
            .integer("max_blur_px", &P::max_blur_px,
                     {.min = 1,
                      .max = 1024,
                      .soft_max = 64,
                      .unit = "px",
                      .help = "largest half-length of a streak"})
            .rows(&P::shutter, shutter::parameter_table())
            .rows(&P::lens, lens::parameter_table())
            .boolean("denoise", &P::denoise,
                     {.help = "take the noise of the samples away where the blur is wider than a "
                              "few pixels"})
            .rows(&P::aperture, lens::aperture_parameter_table())
            .rows(&P::noise, noise::parameter_table())
            .table();
    return rows;
}

class JointBlur final : public Pass {
  public:
    RoleUse roles() const override {
        return {.required = inverse_warp::required_planes(true),
                .optional = inverse_warp::optional_planes(true, parameters_.search.neighbors),
                .on_demand = {Role::hint},
                .carried = {}};
    }

    Promises promises() const override { return inverse_warp::promises_of(settings({}, {})); }

    Reach reach(const FrameDescription& frame) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, frame);
        if (!coc.ok()) return {};
        return inverse_warp::reach_of(settings(frame.camera, *coc), frame);
    }

    std::vector<Place> depth_places() const override {
        return lens::depth_places(parameters_.lens);
    }

    Status check(const FrameDescription& frame) const override {
        if (const auto coc = lens::circle_of_confusion(parameters_.lens, frame); !coc.ok())
            return coc.status();
        return lens::check_aperture(parameters_.aperture, frame.camera);
    }

    std::vector<UsedValue> used_values(const FrameDescription& frame) const override {
        std::vector<UsedValue> values =
            shutter::used_values(parameters_.shutter, frame, parameters_.max_blur_px);
        for (UsedValue& value : lens::used_values(parameters_.lens, frame, kUnblurredPx))
            values.push_back(std::move(value));
        for (UsedValue& value : lens::used_values(parameters_.aperture, frame.camera))
            values.push_back(std::move(value));
        return values;
    }

    std::optional<Identity> identity(const PlanContext& context) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        if (!coc.ok()) return std::nullopt;  // check() says why
        const FrameBounds& bounds = context.frame.bounds;
        const double shutter = shutter::open_frames(parameters_.shutter, context.frame.camera);
        if (shutter == 0 && coc->largest_radius_px() <= kUnblurredPx)
            return Identity{kRuleConfiguration,
                            {.name = "shutter_frames is 0; largest circle-of-confusion radius at "
                                     "any depth",
                             .value = coc->largest_radius_px(),
                             .limit = kUnblurredPx,
                             .unit = "px"}};
        // Of further layers nothing is known by it.
        if (context.color_is_input && bounds.one_color && context.frame.layers == 0)
            return Identity{kRuleFacts, {"all pixels have one color"}};
        double fastest = bounds.max_speed_px;
        if (context.available.has(Role::motion_back))
            fastest = std::max(fastest, bounds.max_speed_back_px);
        const double largest =
            0.5 * shutter * fastest +
            coc->largest_radius_px(bounds.min_inverse_depth, bounds.max_inverse_depth);
        if (!(largest <= kUnblurredPx)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest half-velocity and circle-of-confusion radius together",
                         .value = largest,
                         .limit = kUnblurredPx,
                         .unit = "px"}};
    }

    void plan(PassPlanner& planner) const override {
        const FrameDescription& frame = planner.context().frame;
        const auto coc = lens::circle_of_confusion(parameters_.lens, frame);
        assert(coc.ok());
        inverse_warp::plan_warp(planner, settings(frame.camera, *coc));
    }

    ShapeNumbers shape(const PlanContext& context) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        return inverse_warp::shape_of(settings(context.frame.camera, *coc), context);
    }

    void values(const PlanContext& context, UniformWriter& uniforms) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        inverse_warp::write_values(settings(context.frame.camera, *coc), context, uniforms);
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        inverse_warp::warp_reference(context, settings(context.frame.camera, *coc), frame);
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    inverse_warp::Settings settings(const Camera& camera,
                                    const lens::CircleOfConfusion& coc) const {
        inverse_warp::Settings settings;
        settings.shutter = {.half_open = 0.5 * shutter::open_frames(parameters_.shutter, camera),
                            .max_path_px = double(parameters_.max_blur_px)};
        settings.lens = {.coc = coc, .aperture = lens::aperture_of(parameters_.aperture, camera)};
        settings.samples = parameters_.samples;
        settings.more_samples = std::max(parameters_.max_samples - parameters_.samples, 0);
        settings.search = parameters_.search;
        settings.denoise = parameters_.denoise;
        // A few roundings of 2^-24, so that what is unblurred by the frame's bounds is so here too.
        settings.still_limit_px = kUnblurredPx * (1 + 0x1p-18);
        settings.noise = parameters_.noise;
        settings.still_rule = kRuleUnblurredBlocks;
        return settings;
    }

    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type = {
        .name = "joint_blur",
        .title = "Joint blur",
        .help =
            "Motion blur and depth of field in one: for every instant and point of the lens "
            "the surface that stood at the pixel.",
        .parameters = &table(),
        .create = [] { return std::make_unique<JointBlur>(); },
        .rules = {{kRuleUnblurredBlocks, true,
                   "the joint blur of blocks that nothing is blurred into", "unblurred_tiles"}},
        .known_limits = {
            {"motion", "", "/radiance/firefly", 10.5, inverse_warp::kBrightPixel},
            {"depth", "", "/paths/apart, nothing found/fp32", 17.5, inverse_warp::kApart},
            {"depth", "", "/lens/f/0.", 27, inverse_warp::kSteepLens},
            {"depth", "", "/crossed/*firefly 1e10, f/0.1 at the near plane/fp32", 480,
             inverse_warp::kSteepLens},
            {"depth", "", "/crossed/*f/0.1 at the near plane", 255, inverse_warp::kSteepLens}}};
    return type;
}

}  // namespace postchain::joint_blur
