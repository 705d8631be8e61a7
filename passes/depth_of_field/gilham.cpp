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
// For a lens an unset blur_sigma_px is a quarter of the lens's radius at far distances, and not the
// more obvious max_radius_px / 2. Both depend only on parameters and camera, so neither flickers
// with the content; docs/depth_of_field.md compares their cost.
//
// Our own choices, because the chapter is not public: the Gaussian and its width, the guides of the
// leak tests as plain box means.
#include "passes/depth_of_field/gilham.h"

#include <algorithm>
#include <cmath>

#include "chain/pass/pass.h"
#include "chain/pass/work_list.h"
#include "passes/depth_of_field/gilham_reference.h"
#include "shaders/shared/depth_of_field_blur_uniforms.h"
#include "shaders/shared/depth_of_field_needed_uniforms.h"
#include "shaders/shared/depth_of_field_uniforms.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::depth_of_field {
namespace {

using shared::DepthOfFieldBlurUniforms;
using shared::DepthOfFieldUniforms;

// The standard deviation of downsampling and upsampling without the Gaussian, in box edges: a box
// has a variance of 1/12, the triangle of the bilinear weights 1/6.
constexpr double kDownsampleSigma = 0.5;

// A quarter of the lens's typical radius: a background at twice the focus distance has half the
// radius of infinity, and a disc of radius R has a deviation of R/2 along each axis. The ramps of
// planes and range end in large areas of their largest radius, whose deviation is half of it.
double lens_sigma_px(const lens::CircleOfConfusion& coc) {
    return coc.lens ? coc.typical_radius_px() / 4 : coc.largest_radius_px() / 2;
}

struct Widths {
    int factor;       // of the downsampling
    double sigma_px;  // of the Gaussian
};

// An unset box edge is at most the Gaussian's deviation: the box then adds at most a quarter to its
// variance (kDownsampleSigma).
Widths widths_of(const Parameters& parameters, const lens::CircleOfConfusion& coc) {
    const double sigma = parameters.blur_sigma_px ? *parameters.blur_sigma_px : lens_sigma_px(coc);
    const int factor = parameters.downsample.value_or(sigma >= 4 ? 4 : sigma >= 2 ? 2 : 1);
    return {factor, parameters.blur_sigma_px ? sigma : std::max(sigma, kDownsampleSigma * factor)};
}

GilhamSizes sizes_of(const Widths& widths, const FrameDescription& frame) {
    const auto axes = lens::pixel_axes(frame);
    const auto [factor, sigma] = widths;
    GilhamSizes sizes;
    sizes.factor = factor;
    sizes.width = frame.width;
    sizes.height = frame.height;
    sizes.low_width = (frame.width + sizes.factor - 1) / sizes.factor;
    sizes.low_height = (frame.height + sizes.factor - 1) / sizes.factor;
    for (size_t i = 0; i < 2; ++i) {
        sizes.low_sigma[i] = axes[i] * sigma / sizes.factor;
        sizes.taps[i] = int(std::ceil(3 * sizes.low_sigma[i]));
    }
    sizes.full_blur_px = std::max(2 * sigma, 1.0);
    return sizes;
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

// axis 0: along x, 1: along y
DepthOfFieldBlurUniforms blur_uniforms_of(const GilhamSizes& sizes, size_t axis) {
    DepthOfFieldBlurUniforms uniforms{};
    uniforms.size = {sizes.low_width, sizes.low_height};
    uniforms.quads = (sizes.taps[axis] + 3) / 4;
    for (int i = 1; i <= sizes.taps[axis]; ++i) {
        const double x = i / sizes.low_sigma[axis];
        uniforms.weights[(i - 1) / 4][(i - 1) % 4] = float(std::exp(-0.5 * x * x));
    }
    return uniforms;
}

// Blocks of 16 x 16 pixels are sorted by their circles of confusion (rule focus_blocks): blocks
// that return their color, blocks that show only the blurred image, and blocks of the blurred image
// that are read at all. Found on the device; no bit of the result depends on it.
//
//   depth     --coc----------> sharp, blurred, mixed; blurs
//   blurs     --needed_y-----> blur_y blocks; needed_y     read by the image's bilinear taps
//   needed_y  --needed_x-----> blur_x blocks; needed_x     read by the Gaussian along y
//   needed_x  --needed_small-> small blocks                read by the Gaussian along x
//
// Work lists; -1 = none, and the whole image is filtered.
struct FocusBlocks {
    TextureId sharp = -1, blurred = -1, mixed = -1;  // of the frame
    TextureId small = -1, blur_x = -1, blur_y = -1;  // of the downsampled image
    TextureId blurs = -1;                            // mask: 1 where a block of the frame blurs
};

// One texel for each block of a plane.
TextureId add_mask(PassPlanner& planner, const char* name, const Area& pixels) {
    return planner.texture(name, Format::r8, groups_for(pixels));
}

// A search of a mask for the blocks that need a block of the downsampled image.
struct Search {
    const char* step;
    const char* list;
    int factor;
    glm::ivec2 reach;
    std::array<int, 3> readers;  // blocks of the reader's plane
};

// The frame's bilinear taps reach one more pixel of the downsampled image, less than a block. The
// Gaussian's taps come in fours; the last of them have weight 0, but are read.
std::array<Search, 3> searches_of(const GilhamSizes& sizes) {
    const auto of_frame = groups_for(sizes.width, sizes.height);
    const auto of_small = groups_for(sizes.low_width, sizes.low_height);
    const auto reach = [&](size_t axis) {
        return (4 * ((sizes.taps[axis] + 3) / 4) + kBlockPx - 1) / kBlockPx;
    };
    return {{{"needed_y", "blur_y_blocks", sizes.factor, {1, 1}, of_frame},
             {"needed_x", "blur_x_blocks", 1, {0, reach(1)}, of_small},
             {"needed_small", "small_blocks", 1, {reach(0), 0}, of_small}}};
}

shared::DepthOfFieldNeededUniforms uniforms_of(const Search& search, const GilhamSizes& sizes) {
    const auto grid = groups_for(sizes.low_width, sizes.low_height);
    shared::DepthOfFieldNeededUniforms uniforms{};
    uniforms.blocks = {grid[0], grid[1]};
    uniforms.reach = search.reach;
    uniforms.reader_blocks = {search.readers[0], search.readers[1]};
    uniforms.factor = search.factor;
    return uniforms;
}

// Makes `sort`, a step of coc.comp over width x height pixels, fill the frame's lists and mask.
FocusBlocks sort_focus_blocks(PassPlanner& planner, Step& sort) {
    FocusBlocks blocks;
    sort.program.defines.emplace("SORT", "1");
    if (planner.context().precision == Precision::fp16)
        sort.program.defines.emplace("HALF_RADIUS", "1");
    blocks.sharp = add_work_list(planner, sort, 0, "sharp_blocks");
    blocks.blurred = add_work_list(planner, sort, 1, "blurred_blocks");
    blocks.mixed = add_work_list(planner, sort, 2, "mixed_blocks");
    blocks.blurs = add_mask(planner, "blurs", {});
    sort.bindings.push_back({2, blocks.blurs, Access::write});
    return blocks;
}

// Adds the steps that fill the lists of the downsampled image. `guided`: the Gaussian reads a guide
// plane (leak: depth or coc).
void add_needed_blocks(PassPlanner& planner, FocusBlocks& blocks, const GilhamSizes& sizes,
                       bool guided) {
    TextureId read = blocks.blurs;
    const auto needed = [&](const Search& search) {
        Step step;
        step.name = search.step;
        step.program = {"depth_of_field/needed_blocks.comp", {}};
        const TextureId list = add_work_list(planner, step, 0, search.list, sizes.low());
        const TextureId mask = add_mask(planner, search.step, sizes.low());
        step.bindings.push_back({0, read});
        step.bindings.push_back({0, mask, Access::write});
        step.take_uniforms<shared::DepthOfFieldNeededUniforms>();
        step.spread = groups_for(groups_for(sizes.low()));
        const glm::ivec2 texels = search.factor + 2 * search.reach;
        step.group_taps = uint64_t(kBlockPx * kBlockPx) * uint64_t(texels.x) * uint64_t(texels.y);
        planner.step(std::move(step));
        read = mask;
        return list;
    };
    const auto [for_picture, for_columns, for_rows] = searches_of(sizes);
    blocks.blur_y = needed(for_picture);
    blocks.blur_x = needed(for_columns);
    blocks.small = needed(for_rows);

    const auto elide = [&](const char* item, TextureId list, bool outside, int taps_px, Fact why) {
        elide_blocks(planner, item, kRuleFocusBlocks, std::move(why), list, taps_px, outside);
    };
    elide("blurred image in sharp blocks", blocks.sharp, false, sizes.factor == 1 ? 1 : 4,
          {.name = "largest radius", .limit = shared::kSharpRadiusPx, .unit = "px"});
    elide("color and radius in blurred blocks", blocks.blurred, false, 2,
          {.name = "smallest radius",
           .limit = float(sizes.full_blur_px),
           .unit = "px",
           .relation = Fact::Relation::at_least});
    // Fetches per pixel of the downsampled image: for downsampling, and for the Gaussian along x or
    // y.
    const int down = sizes.factor * sizes.factor;
    const auto along = [&](size_t axis) { return (2 * sizes.taps[axis] + 1) * (guided ? 2 : 1); };
    const Fact unread = {"no block of the result reads them"};
    elide("downsample", blocks.small, true, down, unread);
    elide("blur_x", blocks.blur_x, true, along(0), unread);
    elide("blur_y", blocks.blur_y, true, along(1), unread);
}

// Color and its extra layers; -1 = none.
struct Pictures {
    TextureId color = -1, layers = -1;
};

// Plans the steps of the diagram above; -1 is a texture that is not needed.
class Planner {
  public:
    Planner(PassPlanner& planner, const Parameters& parameters, const lens::CircleOfConfusion& coc,
            const GilhamSizes& sizes)
        : planner_(planner),
          parameters_(parameters),
          lens_(coc.lens),
          sizes_(sizes),
          pixels_(planner.context().frame.pixels()),
          low_pixels_(uint64_t(sizes.low_width) * uint64_t(sizes.low_height)),
          layered_(planner.has(Role::layers)),
          sharp_{planner.input(Role::color), layered_ ? planner.input(Role::layers) : -1} {}

    void plan() {
        const bool by_blocks = planner_.context().uses(kRuleFocusBlocks);
        FocusBlocks blocks;
        const Radius radius = add_coc(by_blocks ? &blocks : nullptr);
        if (by_blocks) add_needed_blocks(planner_, blocks, sizes_, radius.guide >= 0);
        Made result;
        const Pictures small = add_downsample(result, blocks.small);
        const Pictures blur_x = add_blur(0, small, radius.guide, blocks.blur_x);
        const Pictures blurred = add_blur(1, blur_x, radius.guide, blocks.blur_y);
        result.color.color = planner_.texture("color", planner_.context().color_format());
        if (planner_.has(Role::hint) && planner_.wanted(Role::hint)) {
            result.given_hint = planner_.input(Role::hint);
            result.hint = planner_.texture("hint", planner_.describe(result.given_hint).format);
        }
        const bool hint = result.hint >= 0;
        if (by_blocks) {
            add_composite({"keep_sharp", "SHARP", blocks.sharp},
                          {sharp_, {}, hint ? radius.full : -1, result.given_hint}, result);
            add_composite({"keep_blurred", "BLURRED", blocks.blurred}, {{}, blurred, -1, -1},
                          result);
        }
        add_composite({"composite", nullptr, blocks.mixed},
                      {sharp_, blurred, radius.full, result.given_hint}, result);
        planner_.output(Role::color, result.color.color);
        if (layered_) planner_.output(Role::layers, result.color.layers);
        if (hint) planner_.output(Role::hint, result.hint);
    }

  private:
    struct Radius {
        TextureId full = -1, guide = -1;  // of the frame; of the downsampled image
    };
    struct Made {
        Pictures color;
        TextureId given_hint = -1, hint = -1;
    };
    // The textures that a composite reads.
    struct Composed {
        Pictures sharp, blurred;
        TextureId radius, hint;
    };
    // The composite of the whole frame, or of the blocks of a list, all of one kind.
    struct Composite {
        const char* name;
        const char* kind;  // a define of gilham_composite.comp; null: any
        TextureId list;
    };

    Format low_format() const { return plane_format(4, planner_.context().precision); }

    Radius add_coc(FocusBlocks* blocks) {
        Radius radius;
        radius.full = planner_.texture("coc", plane_format(1, planner_.context().precision));
        Step step;
        step.name = "coc";
        step.program = {"depth_of_field/coc.comp", {{lens_ ? "COC_LENS" : "COC_PLANES", "1"}}};
        step.bindings = {{0, planner_.input(Role::inverse_depth), Access::sample_nearest},
                         {0, radius.full, Access::write}};
        if (parameters_.leak != Leak::none) {
            const bool by_depth = parameters_.leak == Leak::depth;
            // Always 32 bits: a ratio of two depths 2 % apart decides.
            radius.guide = planner_.texture(by_depth ? "small_depth" : "small_radius", Format::r32f,
                                            sizes_.low());
            step.program.defines.emplace(by_depth ? "GUIDE_DEPTH" : "GUIDE_RADIUS", "1");
            step.program.defines.emplace("FACTOR", std::to_string(sizes_.factor));
            step.bindings.push_back({1, radius.guide, Access::write});
        }
        if (blocks) *blocks = sort_focus_blocks(planner_, step);
        step.take_uniforms<DepthOfFieldUniforms>();
        step.taps = pixels_ * (radius.guide < 0 ? 1 : 2);
        planner_.step(std::move(step));
        return radius;
    }

    // Makes the result's layers too: they come before the blur's textures in the plan.
    Pictures add_downsample(Made& result, TextureId list) {
        Pictures small;
        small.color = planner_.texture("small", low_format(), sizes_.low());
        Step step;
        step.name = "downsample";
        step.program = {"depth_of_field/gilham_downsample.comp",
                        {{"FACTOR", std::to_string(sizes_.factor)}}};
        if (planner_.context().precision == Precision::fp16)
            step.program.defines.emplace("HALF_STORAGE", "1");
        if (parameters_.hdr_weight) step.program.defines.emplace("HDR_WEIGHT", "1");
        step.bindings = {{0, sharp_.color, Access::sample_nearest},
                         {0, small.color, Access::write}};
        step.take_uniforms<DepthOfFieldUniforms>();
        step.spread = groups_for(sizes_.low());
        step.taps = pixels_;
        launch_by(step, list);
        std::vector<Binding> arrays;
        if (layered_) {
            small.layers = planner_.layers("small_layers", low_format(), sizes_.low());
            result.color.layers = planner_.layers("layers", planner_.context().layers_format());
            arrays = {{1, sharp_.layers}, {1, small.layers, Access::write}};
        }
        add_layered_step(planner_, std::move(step), arrays, pixels_);
        return small;
    }

    // A blur of one direction: "blur_x", axis 0, or "blur_y", axis 1.
    Pictures add_blur(size_t axis, const Pictures& source, TextureId guide, TextureId list) {
        const char* name = axis == 0 ? "blur_x" : "blur_y";
        const char* direction = axis == 0 ? "ivec2(1,0)" : "ivec2(0,1)";
        Pictures blurred;
        blurred.color = planner_.texture(name, low_format(), sizes_.low());
        Step step;
        step.name = name;
        step.program = {"depth_of_field/gilham_blur.comp", {{"STEP", direction}}};
        step.bindings = {{0, source.color, Access::sample_nearest},
                         {0, blurred.color, Access::write}};
        if (parameters_.leak != Leak::none) {
            step.program.defines.emplace(
                parameters_.leak == Leak::depth ? "LEAK_DEPTH" : "LEAK_COC", "1");
            step.bindings.push_back({1, guide, Access::sample_nearest});
        }
        step.take_uniforms<DepthOfFieldBlurUniforms>();
        step.spread = groups_for(sizes_.low());
        const uint64_t taps = low_pixels_ * uint64_t(2 * sizes_.taps[axis] + 1);
        step.taps = taps * (parameters_.leak == Leak::none ? 1 : 2);
        launch_by(step, list);
        std::vector<Binding> arrays;
        if (layered_) {
            blurred.layers =
                planner_.layers(std::string(name) + "_layers", low_format(), sizes_.low());
            arrays = {{2, source.layers}, {1, blurred.layers, Access::write}};
        }
        add_layered_step(planner_, std::move(step), arrays, taps);
        return blurred;
    }

    void add_composite(const Composite& composite, const Composed& from, const Made& result) {
        Step step;
        step.name = composite.name;
        step.program = {"depth_of_field/gilham_composite.comp",
                        {{"FACTOR", std::to_string(sizes_.factor)}}};
        if (composite.kind) step.program.defines.emplace(composite.kind, "1");
        step.bindings = {{0, result.color.color, Access::write}};
        const std::pair<int, TextureId> reads[] = {
            {0, from.sharp.color}, {1, from.radius}, {2, from.blurred.color}, {3, from.hint}};
        for (const auto& [unit, texture] : reads)
            if (texture >= 0) step.bindings.push_back({unit, texture, Access::sample_nearest});
        if (result.hint >= 0) {
            step.program.defines.emplace("WITH_HINT", "1");
            step.bindings.push_back({1, result.hint, Access::write});
        }
        step.take_uniforms<DepthOfFieldUniforms>();
        // The lengths of the lists are not known here: all blocks count as mixed.
        const bool counts = !composite.kind;
        const auto taps = uint64_t(2 + (sizes_.factor == 1 ? 1 : 4) + (from.hint >= 0 ? 1 : 0));
        if (counts) step.taps = pixels_ * taps;
        step.group_taps = uint64_t(kBlockPx * kBlockPx) * taps;
        launch_by(step, composite.list);
        std::vector<Binding> arrays;
        if (layered_) {
            arrays = {{2, result.color.layers, Access::write}};
            if (from.sharp.layers >= 0) arrays.push_back({4, from.sharp.layers});
            if (from.blurred.layers >= 0) arrays.push_back({5, from.blurred.layers});
        }
        add_layered_step(planner_, std::move(step), arrays,
                         counts ? pixels_ * (sizes_.factor == 1 ? 2 : 5) : 0);
    }

    PassPlanner& planner_;
    const Parameters& parameters_;
    const bool lens_;  // the kind of the circle of confusion
    const GilhamSizes& sizes_;
    const uint64_t pixels_, low_pixels_;
    const bool layered_;
    const Pictures sharp_;
};

}  // namespace

Result<GilhamSizes> gilham_sizes(const Parameters& parameters, const lens::CircleOfConfusion& coc,
                                 const FrameDescription& frame) {
    const Widths widths = widths_of(parameters, coc);
    const auto [factor, sigma] = widths;
    const double taps = std::ceil(3 * sigma / factor);
    if (taps <= DEPTH_OF_FIELD_MAX_TAPS) return sizes_of(widths, frame);
    return Status(
        StatusCode::chain,
        concat("blur_sigma_px: ", sigma, " px", parameters.blur_sigma_px ? "" : " (auto)",
               " at downsample ", factor, " needs ", taps, " taps on each side, more than ",
               DEPTH_OF_FIELD_MAX_TAPS, "; set a smaller blur_sigma_px or a larger downsample"));
}

std::vector<GilhamSizes> every_gilham_size(const Parameters& parameters,
                                           const FrameDescription& frame) {
    std::vector<GilhamSizes> sizes;
    for (const int factor : {1, 2, 4})
        if (parameters.downsample.value_or(factor) == factor)
            sizes.push_back(sizes_of({factor, double(factor)}, frame));
    return sizes;
}

std::vector<UsedValue> Gilham::used_values() const {
    return lens::used_values(parameters_.lens, coc_, frame_, shared::kSharpRadiusPx);
}

// The Gaussian's taps on the copy, a box more for the bilinear taps, and the boxes themselves.
Reach Gilham::reach() const {
    const double px = double(sizes_.factor) * (std::max(sizes_.taps[0], sizes_.taps[1]) + 2);
    return {px, px};
}

// Sizes and programs follow from the downsampling factor, and the factor from an unset
// blur_sigma_px.
ShapeNumbers Gilham::shape(const PlanContext&) const {
    return {uint64_t(sizes_.factor)};
}

void Gilham::plan(PassPlanner& planner) const {
    Planner(planner, parameters_, coc_, sizes_).plan();
}

void Gilham::write_uniforms(const PlanContext& context, UniformWriter& uniforms) const {
    uniforms.set(uniforms_of(coc_, sizes_, frame_));
    uniforms.set("blur_x", blur_uniforms_of(sizes_, 0));
    uniforms.set("blur_y", blur_uniforms_of(sizes_, 1));
    if (!context.uses(kRuleFocusBlocks)) return;
    for (const Search& search : searches_of(sizes_))
        uniforms.set(search.step, uniforms_of(search, sizes_));
}

void Gilham::reference(const PlanContext& context, ReferenceFrame& frame) const {
    gilham_reference(parameters_, sizes_, context, frame);
}

}  // namespace postchain::depth_of_field
