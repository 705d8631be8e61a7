#include "passes/depth_of_field/depth_of_field.h"

#include "passes/common/circle_of_confusion.h"
#include "passes/common/lens_points.h"
#include "passes/depth_of_field/gilham.h"
#include "passes/depth_of_field/gilham_reference.h"
#include "passes/inverse_warp/reference.h"

namespace postchain::depth_of_field {
namespace {

constexpr double kSharpRadiusPx = 0.5;  // up to here a pixel returns its color bit for bit

const ParameterTable& table() {
    static const ParameterTable rows =
        ParameterTableBuilder<Parameters>()
            .choice("method", &Parameters::method, {"gilham", "inverse_warp"},
                    {.help = "gilham: a downsampled Gaussian blur, mixed in by the circle of "
                             "confusion; inverse_warp: for every point of the lens the surface "
                             "that it sees at the pixel, in the shape of its aperture"})
            .rows(&Parameters::lens, lens::parameter_table())
            .integer("downsample", &Parameters::downsample,
                     {.min = 1,
                      .max = 4,
                      .allowed = {1, 2, 4},
                      .unit = "px",
                      .help = "edge of the box that one pixel of the downsampled image covers",
                      .unset_means = "the largest that is at most the Gaussian's standard "
                                     "deviation, else 1",
                      .convergence = Convergence::set,
                      .converged = 1})
            .number("blur_sigma_px", &Parameters::blur_sigma_px,
                    {.min = 0,
                     .max = 500,
                     .soft_max = 12,
                     .unit = "px",
                     .help = "standard deviation of the Gaussian, in pixels of the full image",
                     .unset_means = "coc: lens: 1/4 of the radius at infinity, or at 20 "
                                    "focal lengths if that is larger; planes, range: 1/2 of the "
                                    "largest radius; always at least downsample / 2"})
            .choice("leak", &Parameters::leak, {"none", "depth", "coc"},
                    {.help = "neighbors kept out of the blur: none, those in front, or those "
                             "sharper than the pixel"})
            .boolean("hdr_weight", &Parameters::hdr_weight,
                     {.help = "downsample with weights 1/(1 + max(rgb)): highlights flicker "
                              "less and lose energy"})
            .integer("samples", &Parameters::samples,
                     {.min = 1,
                      .max = lens::kMaxPoints,
                      .soft_max = 128,
                      .unit = "points",
                      .help = "inverse_warp: points of the lens for each pixel",
                      .convergence = Convergence::set,
                      .converged = 512})
            .rows(&Parameters::search, inverse_warp::parameter_table())
            .boolean("denoise", &Parameters::denoise,
                     {.help = "inverse_warp: take the noise of the samples away where the blur "
                              "is wider than a few pixels"})
            .rows(&Parameters::aperture, lens::aperture_parameter_table())
            .rows(&Parameters::noise, noise::parameter_table())
            .table();
    return rows;
}

inverse_warp::Settings warp_settings(const Parameters& parameters, const Camera& camera,
                                     const lens::CircleOfConfusion& coc) {
    inverse_warp::Settings settings;
    settings.lens = {.coc = coc, .aperture = lens::aperture_of(parameters.aperture, camera)};
    settings.samples = parameters.samples;
    settings.search = parameters.search;
    settings.denoise = parameters.denoise;
    settings.still_limit_px = kSharpRadiusPx;
    settings.noise = parameters.noise;
    settings.still_rule = kRuleFocusBlocks;
    return settings;
}

class DepthOfField final : public Pass {
  public:
    RoleUse roles() const override {
        return {.required = {Role::color, Role::inverse_depth},
                .optional = warps()
                                ? inverse_warp::optional_planes(false, parameters_.search.neighbors)
                                : RoleSet{},
                .on_demand = {},
                .carried = {Role::hint}};
    }

    Promises promises() const override {
        Promises promises;
        if (warps()) {
            promises = inverse_warp::promises_of(warp_settings(parameters_, {}, {}));
        } else {
            promises.keeps_constants = true;
            promises.convex = 1e-6;
            // Unset it follows the camera: 1, 2 or 4.
            promises.lattice_px = parameters_.downsample.value_or(4);
            promises.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn,
                                   Symmetry::shift};
            promises.light = parameters_.hdr_weight ? Light::not_more : Light::kept;
        }
        // In focus is what the camera says; planes and ranges are the pass's own.
        if (parameters_.lens.coc == lens::CocSource::lens)
            promises.driven_by = {Role::inverse_depth};
        return promises;
    }

    Reach reach(const FrameDescription& frame) const override {
        if (!check(frame).ok()) return {};
        if (!warps()) return gilham_reach(parameters_, frame);
        return inverse_warp::reach_of(
            warp_settings(parameters_, frame.camera,
                          *lens::circle_of_confusion(parameters_.lens, frame)),
            frame);
    }

    std::vector<Place> depth_places() const override {
        return lens::depth_places(parameters_.lens);
    }

    Status check(const FrameDescription& frame) const override {
        if (const auto coc = lens::circle_of_confusion(parameters_.lens, frame); !coc.ok())
            return coc.status();
        return warps() ? lens::check_aperture(parameters_.aperture, frame.camera)
                       : check_gilham(parameters_, frame);
    }

    std::vector<UsedValue> used_values(const FrameDescription& frame) const override {
        std::vector<UsedValue> values = lens::used_values(parameters_.lens, frame, kSharpRadiusPx);
        if (warps())
            for (UsedValue& value : lens::used_values(parameters_.aperture, frame.camera))
                values.push_back(std::move(value));
        return values;
    }

    // The color is exact up to a radius of 0.5 px; gilham's hint is so only where the radius is 0.
    std::optional<Identity> identity(const PlanContext& context) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        if (!coc.ok()) return std::nullopt;  // check() says why
        const bool hint = context.available.has(Role::hint) && context.wanted.has(Role::hint);
        const double exact_px = hint && !warps() ? 0 : kSharpRadiusPx;
        if (const double largest = coc->largest_radius_px(); largest <= exact_px)
            return Identity{kRuleConfiguration,
                            {.name = "largest circle-of-confusion radius at any "
                                     "depth",
                             .value = largest,
                             .limit = exact_px,
                             .unit = "px"}};
        const FrameBounds& bounds = context.frame.bounds;
        // The downsampled image of a color that no half holds would be rounded.
        const bool copy_is_exact =
            warps() || context.precision == Precision::fp32 || bounds.color_is_half;
        // Of further layers nothing is known by it.
        if (context.color_is_input && bounds.one_color && copy_is_exact && !hint &&
            context.frame.layers == 0)
            return Identity{kRuleFacts, {"all pixels have one color"}};
        const double largest =
            coc->largest_radius_px(bounds.min_inverse_depth, bounds.max_inverse_depth);
        if (!(largest <= exact_px)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest circle-of-confusion radius",
                         .value = largest,
                         .limit = exact_px,
                         .unit = "px"}};
    }

    void plan(PassPlanner& planner) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, planner.context().frame);
        assert(coc.ok());
        switch (parameters_.method) {
            case Method::gilham:
                plan_gilham(parameters_, *coc, planner);
                break;
            case Method::inverse_warp:
                inverse_warp::plan_warp(
                    planner, warp_settings(parameters_, planner.context().frame.camera, *coc));
                break;
        }
    }

    ShapeNumbers shape(const PlanContext& context) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        if (!warps()) return gilham_shape(parameters_, context);
        return inverse_warp::shape_of(warp_settings(parameters_, context.frame.camera, *coc),
                                      context);
    }

    void values(const PlanContext& context, UniformWriter& uniforms) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        if (!warps()) return write_gilham_values(parameters_, *coc, context, uniforms);
        inverse_warp::write_values(warp_settings(parameters_, context.frame.camera, *coc), context,
                                   uniforms);
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        const auto coc = lens::circle_of_confusion(parameters_.lens, context.frame);
        assert(coc.ok());
        switch (parameters_.method) {
            case Method::gilham:
                gilham_reference(parameters_, context, frame);
                break;
            case Method::inverse_warp:
                inverse_warp::warp_reference(
                    context, warp_settings(parameters_, context.frame.camera, *coc), frame);
                break;
        }
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    bool warps() const { return parameters_.method == Method::inverse_warp; }

    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const char* const order =
        "rows before columns: with a leak test the second pass weighs what the first has mixed";
    static const char* const boxes = "boxes: the downsampled image moves in steps of its boxes";
    static const PassType type = {
        .name = "depth_of_field",
        .title = "Depth of field",
        .help = "Blurs what is out of focus, by a signed circle of confusion from the depth plane.",
        .parameters = &table(),
        .create = [] { return std::make_unique<DepthOfField>(); },
        .rules = {{kRuleFocusBlocks, true,
                   "the blurred image where it is not visible, color and radius where only it is",
                   "focus_tiles"}},
        .known_limits = {
            {"depth", "method=inverse_warp", "/crossed/*near plane, 16384x3/fp32", 1100,
             inverse_warp::kSteepLens},
            {"depth", "method=inverse_warp", "/crossed/*f/0.1 at the near plane", 168,
             inverse_warp::kSteepLens},
            {"turn", "leak=coc", "/crossed/", 0.03, order},
            {"turn", "leak=coc", "", 0.0024, order},
            {"grid", "", "/radiance/firefly", 0.76, boxes},
            {"grid", "", "/nonfinite/inf in color, clamped/", 0.058, boxes},
            {"grid", "", "/crossed/", 0.53, boxes},
            {"depth", "", "/crossed/*f/0.1", 86,
             "steep lens: at f/0.1, focused at the near plane, 1 % of depth is 22 px of "
             "radius"}}};
    return type;
}

}  // namespace postchain::depth_of_field
