// The method `gilham`. After D. Gilham, ShaderX5, 2006; docs/depth_of_field.md.
//
//   inverse_depth --coc--> guide, coc (full size) --------------------------+
//   color --downsample--> small; guide --blur_x--> --blur_y--> blur_y --+   |
//   color --------------------------------------------------------------+---+--composite--> color
//   hint ----------------------------------------------------------------------(composite)-> hint
//
//   coc            signed radius R, pixels of the full image
//   small          box mean of the color, at 1/downsample of the size
//   small_depth    leak: depth   box mean of w = 1/d
//   small_radius   leak: coc     box mean of |R|
//   blur_x, blur_y Gaussian along x, then y, in-bounds and permitted taps renormalized
//   color          mix(sharp, bilinear(blur_y), smoothstep(0.5, max(2 sigma, 1), |R|))
//
// For a lens an unset blur_sigma_px is a quarter of the radius that the lens gives what is far
// away, and not the more obvious max_radius_px / 2. Both depend on parameters and camera alone, so
// neither flickers with the content; docs/depth_of_field.md has what each costs.
//
// Ours, because the chapter is not public: the Gaussian and its width, the guides of the leak
// tests and their being plain box means, and that non-finite colors do not count.
#include "passes/depth_of_field/gilham.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "chain/layered_step.h"
#include "chain/work_list.h"
#include "passes/depth_of_field/focus_blocks.h"
#include "shaders/shared/depth_of_field_blur_uniforms.h"
#include "shaders/shared/depth_of_field_uniforms.h"

namespace postchain::depth_of_field {
namespace {

using shared::DepthOfFieldBlurUniforms;
using shared::DepthOfFieldUniforms;

// The deviation of the blur of downsampling and upsampling alone, in box edges: a box has
// a variance of 1/12, the triangle of the bilinear weights 1/6.
constexpr double kDownsampleSigma = 0.5;

// A quarter of the lens's typical radius: a background at twice the focus distance has half the
// radius of infinity, and a disc of radius R has a deviation of R/2 along each axis. The ramps of
// planes and range end in large areas of their largest radius, whose deviation is half of it.
double lens_sigma_px(const Parameters& parameters, const FrameDescription& frame) {
    const auto coc = lens::circle_of_confusion(parameters.lens, frame);
    assert(coc.ok());
    return coc->lens ? coc->typical_radius_px() / 4 : coc->largest_radius_px() / 2;
}

struct Widths {
    int factor;       // of the downsampling
    double sigma_px;  // of the Gaussian
};

// Unset the box edge is at most the Gaussian's deviation: the box then adds at most a quarter to
// its variance (kDownsampleSigma).
Widths widths_of(const Parameters& parameters, const FrameDescription& frame) {
    const double sigma =
        parameters.blur_sigma_px ? *parameters.blur_sigma_px : lens_sigma_px(parameters, frame);
    const int factor = parameters.downsample.value_or(sigma >= 4 ? 4 : sigma >= 2 ? 2 : 1);
    return {factor, parameters.blur_sigma_px ? sigma : std::max(sigma, kDownsampleSigma * factor)};
}

DepthOfFieldUniforms uniforms_of(const lens::CircleOfConfusion& coc, const GilhamSizes& sizes,
                                 const FrameDescription& frame) {
    DepthOfFieldUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.low_size = {sizes.low_width, sizes.low_height};
    lens::set_uniforms(coc, uniforms);
    uniforms.full_blur_px = float(sizes.full_blur_px);
    return uniforms;
}

DepthOfFieldBlurUniforms blur_uniforms_of(const GilhamSizes& sizes) {
    DepthOfFieldBlurUniforms uniforms{};
    uniforms.size = {sizes.low_width, sizes.low_height};
    uniforms.quads = (sizes.taps + 3) / 4;
    for (int i = 1; i <= sizes.taps; ++i) {
        const double x = i / sizes.low_sigma;
        uniforms.weights[(i - 1) / 4][(i - 1) % 4] = float(std::exp(-0.5 * x * x));
    }
    return uniforms;
}

uint64_t pixels_of(const PlanTexture& texture) {
    return uint64_t(texture.width) * uint64_t(texture.height);
}

// Color and its further layers; -1 = none.
struct Pictures {
    TextureId color = -1, layers = -1;
};

// A blur of one direction: "blur_x" or "blur_y".
Pictures add_blur(PassPlanner& planner, const Parameters& parameters, const GilhamSizes& sizes,
                  const char* name, const char* direction, Pictures source, TextureId guide,
                  TextureId list) {
    const TextureId blurred = planner.texture(name, plane_format(4, planner.context().precision),
                                              sizes.low_width, sizes.low_height);
    Step step;
    step.name = name;
    step.program = {"depth_of_field/gilham_blur.comp", {{"STEP", direction}}};
    step.bindings = {{0, source.color, Access::sample_nearest}, {0, blurred, Access::write}};
    if (parameters.leak != Leak::none) {
        step.program.defines.emplace(parameters.leak == Leak::depth ? "LEAK_DEPTH" : "LEAK_COC",
                                     "1");
        step.bindings.push_back({1, guide, Access::sample_nearest});
    }
    step.set_uniforms(blur_uniforms_of(sizes));
    step.groups = groups_for(sizes.low_width, sizes.low_height);
    step.taps = pixels_of(planner.describe(blurred)) * uint64_t(2 * sizes.taps + 1) *
                (parameters.leak == Leak::none ? 1 : 2);
    launch_by(step, list);
    TextureId layers = -1;
    std::vector<Binding> arrays;
    if (source.layers >= 0) {
        layers = planner.layers(std::string(name) + "_layers", planner.describe(blurred).format,
                                sizes.low_width, sizes.low_height);
        arrays = {{2, source.layers}, {1, layers, Access::write}};
    }
    const uint64_t taps = pixels_of(planner.describe(blurred)) * uint64_t(2 * sizes.taps + 1);
    add_layered_step(planner, std::move(step), arrays, taps);
    return {blurred, layers};
}

struct CompositeInputs {
    TextureId sharp, radius, low, hint;  // -1 = not read
    TextureId result, hint_result;
    TextureId sharp_layers = -1, low_layers = -1, layers_result = -1;
};

// The composite of the whole picture, or of the blocks of a list, all of one `kind` (a define of
// gilham_composite.comp; null: any).
void add_composite(PassPlanner& planner, const DepthOfFieldUniforms& uniforms,
                   const GilhamSizes& sizes, const CompositeInputs& inputs, const char* name,
                   TextureId list, const char* kind) {
    Step step;
    step.name = name;
    step.program = {"depth_of_field/gilham_composite.comp",
                    {{"FACTOR", std::to_string(sizes.factor)}}};
    if (kind) step.program.defines.emplace(kind, "1");
    step.bindings = {{0, inputs.result, Access::write}};
    const std::pair<int, TextureId> reads[] = {
        {0, inputs.sharp}, {1, inputs.radius}, {2, inputs.low}, {3, inputs.hint}};
    for (const auto& [unit, texture] : reads)
        if (texture >= 0) step.bindings.push_back({unit, texture, Access::sample_nearest});
    if (inputs.hint_result >= 0) {
        step.program.defines.emplace("WITH_HINT", "1");
        step.bindings.push_back({1, inputs.hint_result, Access::write});
    }
    step.set_uniforms(uniforms);
    step.groups = groups_for(uniforms.size.x, uniforms.size.y);
    // How many blocks are in which list is not known here: all count as mixed ones.
    if (!kind)
        step.taps = pixels_of(planner.describe(inputs.result)) *
                    uint64_t(2 + (sizes.factor == 1 ? 1 : 4) + (inputs.hint >= 0 ? 1 : 0));
    launch_by(step, list);
    std::vector<Binding> arrays;
    if (inputs.layers_result >= 0) {
        arrays = {{2, inputs.layers_result, Access::write}};
        if (inputs.sharp_layers >= 0) arrays.push_back({4, inputs.sharp_layers});
        if (inputs.low_layers >= 0) arrays.push_back({5, inputs.low_layers});
    }
    const uint64_t taps =
        kind ? 0 : pixels_of(planner.describe(inputs.result)) * (sizes.factor == 1 ? 2 : 5);
    add_layered_step(planner, std::move(step), arrays, taps);
}

}  // namespace

GilhamSizes gilham_sizes(const Parameters& parameters, const FrameDescription& frame) {
    GilhamSizes sizes;
    const auto [factor, sigma] = widths_of(parameters, frame);
    sizes.factor = factor;
    sizes.low_width = (frame.width + sizes.factor - 1) / sizes.factor;
    sizes.low_height = (frame.height + sizes.factor - 1) / sizes.factor;
    sizes.low_sigma = sigma / sizes.factor;
    sizes.taps = int(std::ceil(3 * sizes.low_sigma));
    sizes.full_blur_px = std::max(2 * sigma, 1.0);
    return sizes;
}

Reach gilham_reach(const Parameters& parameters, const FrameDescription& frame) {
    const GilhamSizes sizes = gilham_sizes(parameters, frame);
    const double px = double(sizes.factor) * (sizes.taps + 2);
    return {px, px};
}

Status check_gilham(const Parameters& parameters, const FrameDescription& frame) {
    const auto [factor, sigma] = widths_of(parameters, frame);
    const double taps = std::ceil(3 * sigma / factor);
    if (taps <= DEPTH_OF_FIELD_MAX_TAPS) return Status();
    return Status(
        StatusCode::chain,
        concat("blur_sigma_px: ", sigma, " px", parameters.blur_sigma_px ? "" : " (auto)",
               " at downsample ", factor, " needs ", taps, " taps on each side, more than ",
               DEPTH_OF_FIELD_MAX_TAPS, "; set a smaller blur_sigma_px or a larger downsample"));
}

void plan_gilham(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                 PassPlanner& planner) {
    const PlanContext& context = planner.context();
    const FrameDescription& frame = context.frame;
    const GilhamSizes sizes = gilham_sizes(parameters, frame);
    const DepthOfFieldUniforms uniforms = uniforms_of(coc, sizes, frame);
    const bool half = context.precision == Precision::fp16;
    const TextureId sharp = planner.input(Role::color);
    const TextureId depth = planner.input(Role::inverse_depth);

    const bool by_blocks = context.uses(kRuleFocusBlocks);
    const TextureId radius =
        planner.texture("coc", plane_format(1, context.precision), frame.width, frame.height);
    Step coc_step;
    coc_step.name = "coc";
    coc_step.program = {"depth_of_field/coc.comp", {{coc.lens ? "COC_LENS" : "COC_PLANES", "1"}}};
    coc_step.bindings = {{0, depth, Access::sample_nearest}, {0, radius, Access::write}};
    TextureId guide = -1;
    if (parameters.leak != Leak::none) {
        const bool by_depth = parameters.leak == Leak::depth;
        // Always 32 bits: a ratio of two depths 2 % apart decides.
        guide = planner.texture(by_depth ? "small_depth" : "small_radius", Format::r32f,
                                sizes.low_width, sizes.low_height);
        coc_step.program.defines.emplace(by_depth ? "GUIDE_DEPTH" : "GUIDE_RADIUS", "1");
        coc_step.program.defines.emplace("FACTOR", std::to_string(sizes.factor));
        coc_step.bindings.push_back({1, guide, Access::write});
    }
    FocusBlocks blocks;
    if (by_blocks) blocks = sort_focus_blocks(planner, coc_step, frame.width, frame.height);
    coc_step.set_uniforms(uniforms);
    coc_step.groups = groups_for(frame.width, frame.height);
    coc_step.taps = pixels_of(planner.describe(radius)) * (guide < 0 ? 1 : 2);
    planner.step(std::move(coc_step));
    if (by_blocks) add_needed_blocks(planner, blocks, uniforms, sizes, guide >= 0);

    const TextureId small = planner.texture("small", plane_format(4, context.precision),
                                            sizes.low_width, sizes.low_height);
    Step down;
    down.name = "downsample";
    down.program = {"depth_of_field/gilham_downsample.comp",
                    {{"FACTOR", std::to_string(sizes.factor)}}};
    if (half) down.program.defines.emplace("HALF_STORAGE", "1");
    if (parameters.hdr_weight) down.program.defines.emplace("HDR_WEIGHT", "1");
    down.bindings = {{0, sharp, Access::sample_nearest}, {0, small, Access::write}};
    down.set_uniforms(uniforms);
    down.groups = groups_for(sizes.low_width, sizes.low_height);
    down.taps = uint64_t(frame.width) * uint64_t(frame.height);
    launch_by(down, blocks.small);
    const bool layered = planner.has(Role::layers);
    const TextureId layers = layered ? planner.input(Role::layers) : -1;
    TextureId small_layers = -1, layers_result = -1;
    std::vector<Binding> arrays;
    if (layered) {
        small_layers = planner.layers("small_layers", plane_format(4, context.precision),
                                      sizes.low_width, sizes.low_height);
        layers_result =
            planner.layers("layers", context.layers_format(), frame.width, frame.height);
        arrays = {{1, layers}, {1, small_layers, Access::write}};
    }
    add_layered_step(planner, std::move(down), arrays,
                     uint64_t(frame.width) * uint64_t(frame.height));

    const Pictures blur_x = add_blur(planner, parameters, sizes, "blur_x", "ivec2(1,0)",
                                     {small, small_layers}, guide, blocks.blur_x);
    const Pictures blur_y =
        add_blur(planner, parameters, sizes, "blur_y", "ivec2(0,1)", blur_x, guide, blocks.blur_y);

    const TextureId result =
        planner.texture("color", context.color_format(), frame.width, frame.height);
    const bool carry_hint = planner.has(Role::hint) && planner.wanted(Role::hint);
    TextureId given = -1, hint = -1;
    if (carry_hint) {
        given = planner.input(Role::hint);
        hint = planner.texture("hint", planner.describe(given).format, frame.width, frame.height);
    }
    if (by_blocks) {
        add_composite(
            planner, uniforms, sizes,
            {sharp, carry_hint ? radius : -1, -1, given, result, hint, layers, -1, layers_result},
            "keep_sharp", blocks.sharp, "SHARP");
        add_composite(planner, uniforms, sizes,
                      {-1, -1, blur_y.color, -1, result, hint, -1, blur_y.layers, layers_result},
                      "keep_blurred", blocks.blurred, "BLURRED");
    }
    add_composite(
        planner, uniforms, sizes,
        {sharp, radius, blur_y.color, given, result, hint, layers, blur_y.layers, layers_result},
        "composite", blocks.mixed, nullptr);
    planner.output(Role::color, result);
    if (layered) planner.output(Role::layers, layers_result);
    if (carry_hint) planner.output(Role::hint, hint);
}

// Sizes and programs follow the factor of the downsampling, and that an unset blur_sigma_px.
ShapeNumbers gilham_shape(const Parameters& parameters, const PlanContext& context) {
    return {uint64_t(gilham_sizes(parameters, context.frame).factor)};
}

void write_gilham_values(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                         const PlanContext& context, UniformWriter& uniforms) {
    const GilhamSizes sizes = gilham_sizes(parameters, context.frame);
    uniforms.set(uniforms_of(coc, sizes, context.frame));
    uniforms.set(blur_uniforms_of(sizes));
    if (context.uses(kRuleFocusBlocks)) write_focus_values(sizes, uniforms);
}

}  // namespace postchain::depth_of_field
