#include "passes/depth_of_field/depth_of_field.h"

#include "passes/common/circle_of_confusion.h"
#include "passes/common/lens_samples.h"
#include "passes/depth_of_field/gilham.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::depth_of_field {
namespace {

using shared::kSharpRadiusPx;

const ParameterTable& table() {
    const ReadIf gilham = {{{"method", {"gilham"}}}};
    const ReadIf warp = {{{"method", {"inverse_warp"}}}};
    static const ParameterTable rows =
        ParameterTableBuilder<Parameters>()
            .choice("method", &Parameters::method, {"gilham", "inverse_warp"},
                    {.help = "gilham: a downsampled Gaussian blur, mixed in by the circle of "
                             "confusion; inverse_warp: the surface that each lens sample sees at "
                             "the pixel, in the shape of the aperture"})
            .rows<lens::Parameters>(&Parameters::lens, lens::parameter_table())
            .integer("downsample", &Parameters::downsample,
                     {.min = 1,
                      .max = 4,
                      .allowed = {1, 2, 4},
                      .unit = "px",
                      .help = "edge of the box that one pixel of the downsampled image covers",
                      .unset_means = "the largest that is at most the Gaussian's standard "
                                     "deviation, otherwise 1",
                      .read_if = gilham,
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
                                    "largest radius; always at least downsample / 2",
                     .read_if = gilham})
            .choice("leak", &Parameters::leak, {"none", "depth", "coc"},
                    {.help = "neighbors kept out of the blur: none, neighbors in front, or "
                             "neighbors sharper than the pixel",
                     .read_if = gilham})
            .boolean("hdr_weight", &Parameters::hdr_weight,
                     {.help = "downsample with weights 1/(1 + max(rgb)): highlights flicker "
                              "less and lose energy",
                      .read_if = {{{"method", {"gilham"}}, {"downsample", {"1"}, true}}}})
            .integer("samples", &Parameters::samples,
                     {.min = 1,
                      .max = lens::kMaxLensSamples,
                      .soft_max = 128,
                      .unit = "points",
                      .help = "lens samples per pixel",
                      .read_if = warp,
                      .convergence = Convergence::set,
                      .converged = 512})
            .rows<inverse_warp::SearchParameters>(&Parameters::search, inverse_warp::search_table(),
                                                  warp)
            .boolean("denoise", &Parameters::denoise,
                     {.help = "remove the noise of the samples if the blur is wider than a few "
                              "pixels",
                      .read_if = warp})
            .rows<lens::ApertureParameters>(&Parameters::aperture, lens::aperture_parameter_table(),
                                            warp)
            .rows<noise::Parameters>(&Parameters::noise, noise::parameter_table(), warp)
            .table();
    return rows;
}

inverse_warp::Settings warp_settings(const Parameters& parameters, const FrameDescription& frame,
                                     const lens::CircleOfConfusion& coc) {
    return {.parameters = parameters,
            .lens = inverse_warp::lens_on(frame, parameters, coc),
            .still_rule = kRuleFocusBlocks};
}

// The pass with either filter, Gilham or the inverse warp.
template <class Filter>
class DepthOfFieldOnFrame final : public Filter {
  public:
    template <class... OfFilter>
    DepthOfFieldOnFrame(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                        const FrameDescription& frame, const OfFilter&... of_filter)
        : Filter(of_filter...), parameters_(parameters), coc_(coc), frame_(frame) {}

    // The color is exact up to a radius of 0.5 px; gilham's hint only if the radius is 0.
    std::optional<Identity> identity(const PlanContext& context) const override {
        const bool hint = context.available.has(Role::hint) && context.wanted.has(Role::hint);
        const double exact_px = hint && !warps() ? 0 : kSharpRadiusPx;
        if (const double largest = coc_.largest_radius_px(); largest <= exact_px)
            return Identity{kRuleConfiguration,
                            {.name = "largest circle-of-confusion radius at any "
                                     "depth",
                             .value = largest,
                             .limit = exact_px,
                             .unit = "px"}};
        const FrameBounds& bounds = frame_.bounds;
        // The downsampled image of a color that a half cannot hold would be rounded.
        const bool copy_is_exact =
            warps() || context.precision == Precision::fp32 || bounds.color_is_half;
        if (context.has_one_color() && copy_is_exact && !hint)
            return Identity{kRuleFacts, {"all pixels have one color"}};
        if constexpr (std::is_base_of_v<inverse_warp::WarpOnFrame, Filter>)
            if (inverse_warp::uses_hidden_surfaces(this->settings(), context)) return std::nullopt;
        const double largest =
            coc_.largest_radius_px(bounds.min_inverse_depth, bounds.max_inverse_depth);
        if (!(largest <= exact_px)) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest circle-of-confusion radius",
                         .value = largest,
                         .limit = exact_px,
                         .unit = "px"}};
    }

  private:
    bool warps() const { return parameters_.method == Method::inverse_warp; }

    const Parameters& parameters_;
    const lens::CircleOfConfusion coc_;
    const FrameDescription& frame_;
};

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

    Guarantees guarantees() const override {
        Guarantees guarantees;
        if (warps()) {
            const FrameDescription any;
            guarantees = inverse_warp::guarantees_of(warp_settings(parameters_, any, {}));
        } else {
            guarantees.keeps_constants = true;
            guarantees.convex = 1e-6;
            // If unset it follows the camera: 1, 2 or 4.
            guarantees.lattice_px = parameters_.downsample.value_or(4);
            guarantees.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn,
                                     Symmetry::shift};
            guarantees.light = parameters_.hdr_weight ? Light::not_more : Light::kept;
        }
        // The camera decides what is in focus; planes and ranges are the pass's own.
        if (parameters_.lens.coc == lens::CocSource::lens)
            guarantees.driven_by = {Role::inverse_depth};
        return guarantees;
    }

    std::vector<Place> depth_places() const override {
        return lens::depth_places(parameters_.lens);
    }

    Result<ResolvedPass> resolve(const FrameDescription& frame) const override {
        ASSIGN_OR_RETURN(const auto coc,
                         lens::circle_of_confusion(
                             parameters_.lens, frame,
                             warps() ? lens::kMaxRadiusFraction : lens::kSmallMaxRadiusFraction));
        if (warps()) {
            Status status = lens::check_aperture(parameters_.aperture, frame.camera);
            return status.ok() ? Result<ResolvedPass>(warp(coc, frame)) : status;
        }
        const auto sizes = gilham_sizes(parameters_, coc, frame);
        return sizes.ok() ? Result<ResolvedPass>(gilham(coc, frame, *sizes)) : sizes.status();
    }

    std::vector<ResolvedPass> every_shape(const FrameDescription& frame) const override {
        std::vector<ResolvedPass> shapes;
        const lens::CircleOfConfusion coc = lens::any_circle_of_confusion(parameters_.lens);
        if (!warps()) {
            for (const GilhamSizes& sizes : every_gilham_size(parameters_, frame))
                shapes.push_back(gilham(coc, frame, sizes));
        } else if (lens::check_aperture(parameters_.aperture, frame.camera).ok()) {
            shapes.push_back(warp(coc, frame));
        }
        return shapes;
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    bool warps() const { return parameters_.method == Method::inverse_warp; }

    ResolvedPass warp(const lens::CircleOfConfusion& coc, const FrameDescription& frame) const {
        return DepthOfFieldOnFrame<inverse_warp::WarpOnFrame>(
            parameters_, coc, frame, warp_settings(parameters_, frame, coc), frame);
    }
    ResolvedPass gilham(const lens::CircleOfConfusion& coc, const FrameDescription& frame,
                        const GilhamSizes& sizes) const {
        return DepthOfFieldOnFrame<Gilham>(parameters_, coc, frame, parameters_, coc, frame, sizes);
    }

    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type = {
        .name = "depth_of_field",
        .title = "Depth of field",
        .help = "Depth of field by a signed circle of confusion from the depth plane.",
        .parameters = &table(),
        .create = [] { return std::make_unique<DepthOfField>(); },
        .rules = {
            {kRuleFocusBlocks, true,
             "the blurred image in blocks that do not show it, color and radius in blocks that "
             "show only it"}}};
    return type;
}

}  // namespace postchain::depth_of_field
