// Plans the sorting of blocks.
//
//   depth     --coc----------> sharp, blurred, mixed; blurs
//   blurs     --needed_y-----> blur_y blocks; needed_y     read by the image's bilinear taps
//   needed_y  --needed_x-----> blur_x blocks; needed_x     read by the Gaussian along y
//   needed_x  --needed_small-> small blocks                read by the Gaussian along x
#include "passes/depth_of_field/focus_blocks.h"

#include "chain/work_list.h"
#include "passes/depth_of_field/depth_of_field.h"
#include "shaders/shared/depth_of_field_needed_uniforms.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::depth_of_field {
namespace {

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

}  // namespace

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

void write_focus_uniforms(const GilhamSizes& sizes, UniformWriter& uniforms) {
    for (const Search& search : searches_of(sizes))
        uniforms.set(search.step, uniforms_of(search, sizes));
}

}  // namespace postchain::depth_of_field
