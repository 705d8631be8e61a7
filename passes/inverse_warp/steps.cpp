#include "passes/inverse_warp/steps.h"

#include <algorithm>
#include <bit>

#include "chain/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/lens_samples.h"
#include "passes/inverse_warp/surface_steps.h"
#include "passes/inverse_warp/uniforms.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain::inverse_warp {
namespace {

// A row keeps so many more surfaces than a block: some of them do not reach the block along its
// column.
constexpr int kMoreInRow = 2;

// Plans the steps in their order. A function adds the steps of one line of inverse_warp.h and
// returns their textures; -1 is a texture that is not needed.
class Planner : private SurfacePlanner {
  public:
    Planner(PassPlanner& planner, const Settings& settings)
        : SurfacePlanner(planner, settings), layered_(planner.has(Role::layers)) {}

    void plan() {
        Gathered from;
        from.surfaces = add_surfaces();
        from.neighbors = searched_neighbors(settings_, planner_.context().available);
        from.neighbor_surfaces = add_surfaces_of(from.neighbors, from.surfaces);
        from.starts = add_starts(add_block_surfaces(from.surfaces));
        from.background = add_background(from.surfaces);
        if (layered_) from.occupied = add_occupied(from.neighbors);
        const Hint hint = add_hint();
        Colors result = {planner_.texture("color", planner_.context().color_format()), -1};
        if (layered_) result.layers = layer_images("layers");
        const Soft soft = settings_.denoise ? add_soft() : Soft();
        add_tables(from);
        if (from.starts.still_blocks >= 0)
            keep_still_blocks(from.starts.still_blocks, result, hint, soft);
        add_gather(from, hint, result, soft);
        if (settings_.denoise) add_denoise(soft, result, from.starts.moving_blocks);
        planner_.output(Role::color, result.color);
        if (layered_) planner_.output(Role::layers, result.layers);
        if (hint.made >= 0) planner_.output(Role::hint, hint.made);
    }

  private:
    struct Colors {
        TextureId color = -1, layers = -1;
    };
    struct Starts {
        TextureId surfaces = -1;
        TextureId moving_blocks = -1, still_blocks = -1;  // work lists
    };
    struct Background {
        TextureId color = -1, cells = -1, layers = -1;
    };
    struct Hint {
        TextureId given = -1, made = -1;
    };
    // Between gather and denoise.
    struct Soft {
        Colors blurred;
        TextureId spread = -1;
        TextureId reached = -1;  // with layers
    };
    // The textures that gather reads.
    struct Gathered {
        TextureId surfaces = -1;
        NeighborList neighbors;
        TextureId neighbor_surfaces = -1;
        Starts starts;
        Background background;
        TextureId occupied = -1;  // with layers
        TextureId noise = -1, lens_samples = -1;
    };

    TextureId layer_images(const std::string& name) {
        return planner_.layers(name, planner_.context().layers_format());
    }
    // Two positions and a color for each sample, if the first start surface is right.
    int taps_px() const {
        return 3 * std::max(settings_.samples + settings_.more_samples, INVERSE_WARP_MIN_TIMES);
    }

    // Room for a pixel's taps (taps.glsl), rounded up so that few programs serve all numbers.
    int room_for_taps() const {
        const int samples = taps_px() / 3;
        return samples <= 32 ? int(std::bit_ceil(unsigned(samples))) : (samples + 31) / 32 * 32;
    }

    // Texture fetches of a pixel, at most: two from itself and from each start surface, twice three
    // of them in each neighbor and in the layer behind, three for what continues behind; then one
    // where a sample that was put off is taken up, and eight for the color.
    uint64_t most_taps_px(size_t neighbors) const {
        const uint64_t begins = uint64_t(settings_.search.starts) + 1;
        return uint64_t(taps_px()) / 3 * ((2 + 6 * neighbors + 3) * begins + 1 + 8);
    }

    TextureId add_block_surfaces(TextureId surfaces) {
        const TextureId block_surfaces =
            planner_.texture("block_surfaces", Format::rgba32ui, kBlocks.times(3, 1));
        Step step = make_surface_step("block_surfaces");
        step.spread = groups_for(kBlocks);
        step.bindings = {{0, surfaces}, {0, block_surfaces, Access::write}};
        step.taps = 3 * pixels_;
        planner_.step(std::move(step));
        return block_surfaces;
    }

    // Chooses for each block `chosen` surfaces from the `given` ones of each block in its row or
    // column.
    Step make_starts_step(const char* name, bool rows, int given, int chosen) {
        Step step = make_surface_step("starts");
        step.name = name;
        step.program.defines["ROWS"] = flag(rows);
        step.program.defines["GIVEN"] = std::to_string(given);
        step.program.defines["STARTS"] = std::to_string(chosen);
        step.program.defines["LISTS"] = flag(false);
        step.spread = kBlocks.in_squares(INVERSE_WARP_STARTS_BLOCKS);
        const int ring = ring_of(
            longest_px(settings_, frame_, holds_motion_back(settings_, planner_.context())));
        const int line = std::min(2 * ring + 1, blocks_[rows ? 0 : 1]);
        step.taps = uint64_t(blocks_[0]) * uint64_t(blocks_[1]) * uint64_t(line) * uint64_t(given) *
                    uint64_t(chosen);
        return step;
    }

    Starts add_starts(TextureId block_surfaces) {
        const bool by_blocks = planner_.context().uses(settings_.still_rule);
        const int count = settings_.search.starts, row_count = count + kMoreInRow;
        const TextureId row_starts =
            planner_.texture("row_starts", Format::rgba32ui, kBlocks.times(row_count, 1));
        Step rows = make_starts_step("row_starts", true, 3, row_count);
        rows.bindings = {{0, block_surfaces}, {0, row_starts, Access::write}};
        planner_.step(std::move(rows));
        Starts starts;
        starts.surfaces = planner_.texture("starts", Format::rgba32ui, kBlocks.times(count + 1, 1));
        Step step = make_starts_step("starts", false, row_count, count);
        step.bindings = {{0, row_starts}, {0, starts.surfaces, Access::write}};
        step.program.defines["LISTS"] = flag(by_blocks);
        if (by_blocks) {
            const auto add_list = [&](int unit, const char* name) {
                return add_work_list(planner_, step, unit, name);
            };
            starts.moving_blocks = add_list(0, "moving_blocks");
            starts.still_blocks = add_list(1, "still_blocks");
        }
        planner_.step(std::move(step));
        return starts;
    }

    Background add_background(TextureId surfaces) {
        // Cells of 2 px, beside them those of 4, 8 and 16 px.
        const Area cells = kBlocks.times(8 + 4, 8);
        Background background;
        background.color =
            planner_.texture("background_color", planner_.context().color_format(), cells);
        const TextureId depth = planner_.texture("background_depth", Format::rg32f, cells);
        Step step = make_surface_step("background");
        step.spread = groups_for(kBlocks.times(4, 4));  // squares (square.glsl)
        step.bindings = {{0, planner_.input(Role::color)},
                         {1, surfaces},
                         {0, background.color, Access::write},
                         {1, depth, Access::write}};
        step.taps = 2 * pixels_;
        if (layered_) {
            background.layers =
                planner_.layers("background_layers", planner_.context().layers_format(), cells);
            add_layers(step,
                       {{2, planner_.input(Role::layers)}, {2, background.layers, Access::write}});
            step.groups[2] = 1 + frame_.layers;
            step.taps += 2 * pixels_ * uint64_t(frame_.layers);
        }
        planner_.step(std::move(step));
        add_behind(background, depth);
        return background;
    }

    // The same step does all layers.
    static void add_layers(Step& step, const std::vector<Binding>& arrays) {
        step.program.defines["LAYERS"] = "1";
        step.bindings.insert(step.bindings.end(), arrays.begin(), arrays.end());
    }

    // Words of a bit for each layer.
    int words() const { return (frame_.layers + 31) / 32; }

    TextureId add_occupied(const NeighborList& neighbors) {
        const int frames = 1 + int(neighbors.size());
        const TextureId occupied =
            planner_.array("occupied", Format::r32ui, kBlocks, frames * words());
        Step step;
        step.name = "occupied";
        step.program = {"inverse_warp/occupied.comp", {{"BEFORE", "0"}, {"AFTER", "0"}}};
        step.bindings = {{0, planner_.input(Role::layers)}, {0, occupied, Access::write}};
        for (const Neighbor neighbor : neighbors) {
            const bool before = neighbor == Neighbor::before;
            step.program.defines[before ? "BEFORE" : "AFTER"] = "1";
            step.bindings.push_back(
                {before ? 1 : 2, planner_.input(role_of(neighbor, Role::layers))});
        }
        step.take_uniforms<shared::FrameUniforms>();
        step.groups[2] = frames * words();
        step.taps = pixels_ * uint64_t(frames) * uint64_t(frame_.layers);
        planner_.step(std::move(step));
        return occupied;
    }

    void add_behind(Background& background, TextureId depth) {
        const Area cells = planner_.describe(depth).area;
        background.cells = planner_.texture("background", Format::rg32f, cells);
        Step step = make_surface_step("behind");
        step.spread = groups_for(kBlocks.times(8, 8));
        step.bindings = {{0, depth}, {1, background.color}, {0, background.cells, Access::write}};
        step.taps = 20 * pixels_;
        planner_.step(std::move(step));
    }

    Hint add_hint() {
        if (!settings_.shutter) {
            if (!planner_.has(Role::hint) || !planner_.wanted(Role::hint)) return {};
            const TextureId given = planner_.input(Role::hint);
            return {given, planner_.texture("hint", planner_.describe(given).format)};
        }
        if (planner_.wanted(Role::hint)) return {-1, planner_.texture("hint", Format::rg8)};
        planner_.elide({.kind = ElisionKind::output,
                        .item = "hint",
                        .rule = kRuleUnusedStep,
                        .fact = {"no later pass reads it"},
                        .saving = {.bytes = 2 * pixels_}});
        return {};
    }

    Soft add_soft() {
        Soft soft;
        soft.blurred.color = planner_.texture("soft", planner_.context().color_format());
        soft.spread = planner_.texture("spread", planner_.context().color_format());
        if (!layered_) return soft;
        soft.blurred.layers = layer_images("layers_soft");
        soft.reached = planner_.array("reached", Format::r32ui, {}, words());
        return soft;
    }

    // Before the steps that write the result, which then stand together in the plan.
    void add_tables(Gathered& from) {
        from.noise = noise::add_table(planner_, settings_.noise);
        if (!settings_.lens) return;
        from.lens_samples = lens::add_table(
            planner_, lens::lens_samples(settings_.lens->aperture, settings_.samples,
                                         settings_.more_samples));
    }

    void keep_still_blocks(TextureId still_blocks, const Colors& result, const Hint& hint,
                           const Soft& soft) {
        elide_blocks(planner_, "search in still blocks", settings_.still_rule,
                     {.name = "displacements that reach them",
                      .limit = settings_.still_limit_px,
                      .unit = "px"},
                     still_blocks, taps_px());
        add_keep(planner_, still_blocks,
                 {.color = result.color,
                  .given_hint = hint.given,
                  .hint = hint.made,
                  .soft = soft.blurred.color,
                  .layers = result.layers});
    }

    void add_gather(const Gathered& from, const Hint& hint, const Colors& result,
                    const Soft& soft) {
        Step step = make_surface_step("gather");
        auto& defines = step.program.defines;
        defines["STARTS"] = std::to_string(std::bit_ceil(unsigned(settings_.search.starts)));
        defines["NOISE"] = flag(from.noise >= 0);
        defines["DENOISE"] = flag(settings_.denoise);
        defines["HINT"] = flag(hint.made >= 0);
        if (frame_.fill_layer >= 0) defines["FILL_LAYER"] = "1";
        defines["ADAPTIVE"] = flag(settings_.more_samples > 0);
        defines["BEFORE"] = defines["AFTER"] = "0";
        defines["BARREL"] = flag(settings_.lens && settings_.lens->aperture.cats_eye > 0);
        step.bindings = {{0, planner_.input(Role::color)}, {1, from.surfaces},
                         {2, from.starts.surfaces},        {0, result.color, Access::write},
                         {11, from.background.color},      {12, from.background.cells}};
        if (from.noise >= 0) step.bindings.push_back({3, from.noise});
        for (const Neighbor neighbor : from.neighbors) {
            const bool before = neighbor == Neighbor::before;
            defines[before ? "BEFORE" : "AFTER"] = "1";
            step.bindings.push_back(
                {before ? 7 : 9, planner_.input(role_of(neighbor, Role::color))});
        }
        if (from.neighbor_surfaces >= 0) step.bindings.push_back({8, from.neighbor_surfaces});
        if (from.lens_samples >= 0) step.bindings.push_back({4, from.lens_samples});
        if (settings_.denoise) {
            step.bindings.push_back({2, soft.blurred.color, Access::write});
            step.bindings.push_back({3, soft.spread, Access::write});
        }
        if (hint.given >= 0) step.bindings.push_back({6, hint.given});
        if (second_layer_) {
            defines["SECOND_LAYER"] = "1";
            step.bindings.push_back({6, planner_.input(Role::behind)});
        }
        if (hint.made >= 0) step.bindings.push_back({1, hint.made, Access::write});
        step.taps = pixels_ * uint64_t(taps_px());
        step.group_taps = uint64_t(kBlockPx * kBlockPx) *
                          most_taps_px(from.neighbors.size() + size_t(second_layer_));
        launch_by(step, from.starts.moving_blocks);
        if (layered_) {
            add_layers(step, gathered_layers(from, result, soft));
            step.program.defines["TAPS"] = std::to_string(room_for_taps());
            step.taps += pixels_ * uint64_t(taps_px() / 3) * uint64_t(frame_.layers);
            step.group_taps += uint64_t(kBlockPx * kBlockPx) * 4 * uint64_t(taps_px() / 3) *
                               uint64_t(frame_.layers);
        }
        planner_.step(std::move(step));
    }

    // The layers that gather reads and writes.
    std::vector<Binding> gathered_layers(const Gathered& from, const Colors& result,
                                         const Soft& soft) const {
        std::vector<Binding> arrays = {{13, planner_.input(Role::layers)},
                                       {14, from.background.layers},
                                       {4, result.layers, Access::write},
                                       {6, from.occupied, Access::read}};
        if (settings_.denoise) {
            arrays.push_back({5, soft.blurred.layers, Access::write});
            arrays.push_back({7, soft.reached, Access::write});
        }
        for (const Neighbor neighbor : from.neighbors)
            arrays.push_back({neighbor == Neighbor::before ? 15 : 5,
                              planner_.input(role_of(neighbor, Role::layers))});
        return arrays;
    }

    // In place.
    void add_denoise(const Soft& soft, const Colors& result, TextureId moving_blocks) {
        Step step = make_step("denoise");
        step.bindings = {{0, result.color},
                         {1, soft.blurred.color},
                         {2, soft.spread},
                         {0, result.color, Access::write}};
        step.taps = 30 * pixels_;
        launch_by(step, moving_blocks);
        if (layered_) {
            add_layers(step, {{3, result.layers},
                              {4, soft.blurred.layers},
                              {5, soft.reached},
                              {1, result.layers, Access::write}});
            step.taps += 20 * pixels_ * uint64_t(frame_.layers);
        }
        planner_.step(std::move(step));
    }

    const bool layered_;  // the frame has extra layers
};

}  // namespace

void add_steps(PassPlanner& planner, const Settings& settings) {
    Planner(planner, settings).plan();
}

}  // namespace postchain::inverse_warp
