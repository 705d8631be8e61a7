// Plans the sorting of blocks.
//
//   row_range --focus_blocks-> sharp, blurred, mixed; blurs
//   blurs     --needed_y-----> blur_y blocks; needed_y     read by the picture's bilinear taps
//   needed_y  --needed_x-----> blur_x blocks; needed_x     read by the Gaussian along y
//   needed_x  --needed_small-> small blocks                read by the Gaussian along x
#include "passes/depth_of_field/focus_blocks.h"

#include "shaders/shared/depth_of_field_needed_block.h"

namespace postchain::depth_of_field {
namespace {

struct Grid {
    int across, down;
    explicit Grid(const std::array<int, 3>& groups) : across(groups[0]), down(groups[1]) {}
    TextureId mask(PassPlanner& planner, const char* name) const {
        return planner.texture(name, Format::r8, across, down);
    }
    TextureId list(PassPlanner& planner, const char* name) const {
        return planner.texture(name, Format::work_list, across * down, 1);
    }
};

}  // namespace

FocusBlocks add_focus_blocks(PassPlanner& planner, const shared::DepthOfFieldBlock& block,
                             const GilhamSizes& sizes, TextureId row_range, bool guided) {
    const Grid picture(groups_for(block.size.x, block.size.y));
    const Grid copy(groups_for(sizes.low_width, sizes.low_height));
    FocusBlocks blocks;

    blocks.sharp = picture.list(planner, "sharp_blocks");
    blocks.blurred = picture.list(planner, "blurred_blocks");
    blocks.mixed = picture.list(planner, "mixed_blocks");
    TextureId read = picture.mask(planner, "blurs");
    Step sort;
    sort.name = "focus_blocks";
    sort.program = {"depth_of_field/focus_blocks.comp", {}};
    if (planner.context().precision == Precision::fp16)
        sort.program.defines.emplace("HALF_RADIUS", "1");
    sort.bindings = {{0, row_range},
                     {0, read, Access::write},
                     {0, blocks.sharp, Access::list},
                     {1, blocks.blurred, Access::list},
                     {2, blocks.mixed, Access::list}};
    sort.set_block(block);
    sort.groups = groups_for(picture.across, picture.down);
    sort.taps = uint64_t(picture.across) * uint64_t(block.size.y);
    planner.step(std::move(sort));

    const auto needed = [&](const char* name, const char* list_name, int factor, glm::ivec2 reach) {
        shared::DepthOfFieldNeededBlock search{};
        search.blocks = {copy.across, copy.down};
        search.reach = reach;
        search.factor = factor;
        const TextureId list = copy.list(planner, list_name);
        const TextureId mask = copy.mask(planner, name);
        Step step;
        step.name = name;
        step.program = {"depth_of_field/needed_blocks.comp", {}};
        step.bindings = {{0, read}, {0, mask, Access::write}, {0, list, Access::list}};
        step.set_block(search);
        step.groups = groups_for(copy.across, copy.down);
        planner.step(std::move(step));
        read = mask;
        return list;
    };
    // The picture's bilinear taps reach one pixel of the copy further, less than a block. Those of
    // the Gaussian come in fours, the last of them with weight 0, but read.
    const int reach = (4 * ((sizes.taps + 3) / 4) + kBlockPx - 1) / kBlockPx;
    blocks.blur_y = needed("needed_y", "blur_y_blocks", sizes.factor, {1, 1});
    blocks.blur_x = needed("needed_x", "blur_x_blocks", 1, {0, reach});
    blocks.small = needed("needed_small", "small_blocks", 1, {reach, 0});

    const auto on_device = [&](const char* what, TextureId list, bool outside, int taps_px,
                               const std::string& reason) {
        planner.left_out(left_out_of_blocks(what, kRuleFocusTiles, reason, list, taps_px, outside));
    };
    on_device("blurred copy in sharp blocks", blocks.sharp, false, sizes.factor == 1 ? 1 : 4,
              "no radius above 0.5 px");
    on_device("color and radius in blurred blocks", blocks.blurred, false, 2,
              concat("no radius below ", block.full_blur_px, " px"));
    // Of a pixel of the copy: what down-sampling, and the Gaussian along x or y, fetch.
    const int down = sizes.factor * sizes.factor * (guided ? 2 : 1);
    const int along = (2 * sizes.taps + 1) * (guided ? 2 : 1);
    on_device("downsample", blocks.small, true, down, "nobody reads these blocks of the copy");
    on_device("blur_x", blocks.blur_x, true, along, "nobody reads these blocks of the copy");
    on_device("blur_y", blocks.blur_y, true, along, "nobody reads these blocks of the copy");
    return blocks;
}

}  // namespace postchain::depth_of_field
