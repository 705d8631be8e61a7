#include "passes/inverse_warp/steps.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <utility>

#include "chain/pass/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/lens_samples.h"
#include "shaders/shared/frame_uniforms.h"
#include "shaders/shared/inverse_warp_constants.h"
#include "shaders/shared/inverse_warp_gather_units.h"
#include "shaders/shared/inverse_warp_uniforms.h"
#include "shaders/shared/small_circles.h"

namespace postchain::inverse_warp {
namespace {

using shared::InverseWarpUniforms;

// A row keeps so many more surfaces than a block: some of them do not reach the block along its
// column.
constexpr int kMoreInRow = 2;

// Surfaces of a block that this frame shows.
constexpr int kShownSurfaces = 3;

constexpr Area kBlocks = groups_for(Area());  // of the frame
constexpr Area kSquares = Area().in_squares(INVERSE_WARP_SQUARE_PX);

Role role_in(std::optional<Neighbor> neighbor, Role role) {
    return neighbor ? role_of(*neighbor, role) : role;
}

std::string suffix_of(std::optional<Neighbor> neighbor) {
    return neighbor ? concat("_", name_of(*neighbor)) : std::string();
}

// The steps of a neighbor: constants, because uniforms are written without an allocation.
constexpr std::array<std::string_view, 5> steps_of(Neighbor neighbor) {
    if (neighbor == Neighbor::before)
        return {"surfaces_before", "light_before", "bright_edges_before", "shown_surfaces_before",
                "hidden_surfaces_before"};
    return {"surfaces_after", "light_after", "bright_edges_after", "shown_surfaces_after",
            "hidden_surfaces_after"};
}

// True if surfaces hold their motion, and also the motion from the frame before.
bool holds_motion(const Settings& settings, const PlanContext& context) {
    return settings.shutter || !searched_neighbors(settings, context.available).empty();
}

bool holds_motion_back(const Settings& settings, const PlanContext& context) {
    return holds_motion(settings, context) && context.available.has(Role::motion_back);
}

// True if no frame that the pass reads has the motion from the frame before it.
bool moves_straight(const Settings& settings, const PlanContext& context) {
    bool back = context.available.has(Role::motion_back) || uses_second_layer(settings, context);
    for (const Neighbor neighbor : searched_neighbors(settings, context.available))
        back = back || context.available.has(role_of(neighbor, Role::motion_back));
    return !back;
}

// The longest displacement that the frame's bounds allow, pixels. `back`: surfaces hold the motion
// from the frame before.
double longest_px(const Settings& settings, const FrameDescription& frame, bool back) {
    const FrameBounds& bounds = frame.bounds;
    double longest = 0;
    if (settings.shutter) {
        const double half_open = settings.shutter->half_open;
        // With a closed shutter nothing moves, however fast; infinity is an unknown speed.
        const double path = half_open > 0 ? half_open * bounds.fastest_px(back) : 0;
        // a and b are rounded by up to 2^-20 of them, and a step of 1/64 px.
        longest = std::min(path * (1 + 1e-5) + 0.05, settings.shutter->max_path_px);
    }
    if (settings.lens)
        longest += settings.lens->coc.largest_radius_px(bounds.min_inverse_depth,
                                                        bounds.max_inverse_depth) +
                   0.05;
    return std::min(longest, longest_px(settings));
}

InverseWarpUniforms uniforms_of(const Settings& settings, const FrameDescription& frame) {
    const auto blocks = groups_for(frame.width, frame.height);
    InverseWarpUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.blocks = {blocks[0], blocks[1]};
    uniforms.starts = settings.parameters.search.starts;
    uniforms.samples = settings.parameters.samples;
    uniforms.fill_layer = frame.fill_layer;
    uniforms.half_shutter = 1;
    uniforms.max_path_px = 1e15f;
    uniforms.still_limit_px = float(settings.still_limit_px);
    uniforms.soft_spread = float(kSoftSpread);
    // Lens samples are more even than random ones, with times they are not.
    uniforms.denoise_window = float((settings.shutter ? kWindowWithShutter : kWindow) *
                                    std::sqrt(double(settings.parameters.samples)));
    if (settings.shutter) {
        uniforms.half_shutter = float(settings.shutter->half_open);
        uniforms.max_path_px = float(settings.shutter->max_path_px);
        uniforms.time_jitter = float(settings.parameters.time_jitter);
        uniforms.time_scale = float(settings.shutter->time_scale);
        uniforms.time_shift = float(settings.shutter->time_shift);
        uniforms.path_px_per_time = float(settings.parameters.path_px_per_time);
    }
    if (settings.lens) {
        lens::set_uniforms(settings.lens->coc, uniforms);
        const double barrel = lens::barrel_per_px(settings.lens->aperture, frame);
        uniforms.barrel_per_px = float(barrel);
        uniforms.barrel_scale = float(1 - barrel * settings.lens->coc.radius_px(0));
        uniforms.center_x = float(0.5 * (frame.display_width - 1) - frame.origin_x);
        uniforms.center_y = float(0.5 * (frame.display_height - 1) - frame.origin_y);
        uniforms.pixel_axis_x = float(settings.lens->aperture.axes[0]);
        uniforms.pixel_axis_y = float(settings.lens->aperture.axes[1]);
        static constexpr float kCircleWeights[] = {SMALL_CIRCLES_WEIGHTS};
        for (size_t i = 0; i < std::size(kCircleWeights); ++i)
            uniforms.circle_weights[i / 4][int(i % 4)] = kCircleWeights[i];
        uniforms.disc_scale = float(lens::disc_radius(settings.lens->aperture).value_or(0));
        uniforms.lens_sets = lens::sets_of(settings.parameters.samples);
    }
    return uniforms;
}

// Plans the steps in their order. A function adds the steps of one line of inverse_warp.h and
// returns their textures; -1 is a texture that is not needed.
class Planner {
  public:
    Planner(PassPlanner& planner, const Settings& settings)
        : planner_(planner),
          settings_(settings),
          frame_(planner.context().frame),
          motion_(holds_motion(settings, planner.context())),
          straight_(!motion_ || moves_straight(settings, planner.context())),
          layered_(planner.has(Role::layers)),
          second_layer_(uses_second_layer(settings, planner.context())),
          blocks_(groups_for(frame_.width, frame_.height)),
          pixels_(frame_.pixels()) {}

    void plan() {
        Gathered from;
        from.surfaces = add_surfaces();
        from.neighbors = searched_neighbors(settings_, planner_.context().available);
        const std::vector<Packed> neighbors = add_surfaces_of(from.neighbors, from.surfaces);
        if (!neighbors.empty()) from.neighbor_surfaces = neighbors[0].surfaces;
        from.starts = add_starts(add_block_surfaces(from.surfaces, neighbors));
        from.background = add_background(from.surfaces);
        if (layered_) from.occupied = add_occupied(from.neighbors);
        const Hint hint = add_hint();
        Colors result = {planner_.texture("color", planner_.context().color_format()), -1};
        if (layered_) result.layers = layer_images("layers");
        const Soft soft = settings_.parameters.denoise ? add_soft() : Soft();
        add_tables(from);
        if (from.starts.still_blocks >= 0)
            keep_still_blocks(from.starts.still_blocks, result, hint, soft);
        add_gather(from, hint, result, soft);
        if (settings_.parameters.denoise) add_denoise(soft, result, from.starts.moving_blocks);
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
    // The planes of this frame, or of a neighbor whose light is compared with this frame's.
    struct Packed {
        TextureId surfaces = -1;
        std::optional<Neighbor> neighbor = {};
        TextureId here = -1;   // with a neighbor: surfaces of this frame
        TextureId marks = -1;  // of squares
        TextureId light = -1;  // with a neighbor
    };

    Format surface_format() const { return motion_ ? Format::rgba32ui : Format::r32ui; }

    // A step over all pixels, named as its shader.
    Step make_step(const std::string& file) const {
        Step step;
        step.name = std::filesystem::path(file).stem().string();
        step.program.file = file;
        planner_.context().choose_form(step.program);
        step.take_uniforms<InverseWarpUniforms>();
        return step;
    }

    // For every step that reads surfaces.
    Step make_surface_step(const std::string& file) const {
        Step step = make_step(file);
        step.program.defines["SHUTTER"] = flag(settings_.shutter.has_value());
        step.program.defines["LENS"] = flag(settings_.lens.has_value());
        step.program.defines["MOTION"] = flag(motion_);
        step.program.defines["STRAIGHT"] = flag(straight_);
        if (settings_.lens)
            step.program.defines[settings_.lens->coc.lens ? "COC_LENS" : "COC_PLANES"] = "1";
        return step;
    }

    // With a layer behind also its surfaces, in the texture's second half.
    TextureId add_surfaces() {
        Packed packed = {
            planner_.texture("surfaces", surface_format(), second_layer_ ? Area().two() : Area())};
        add_packed(packed);
        const TextureId shown = add_shown(packed);
        add_split(packed, shown);
        if (second_layer_) add_second_surfaces(packed.surfaces);
        return packed.surfaces;
    }

    void add_second_surfaces(TextureId surfaces) {
        Step step = make_surface_step("inverse_warp/second_surfaces.comp");
        step.program.defines["SECOND_LAYER"] = "1";
        step.program.defines["NEIGHBOR"] = step.program.defines["BACK"] = "0";
        step.bindings = {{0, planner_.input(Role::behind)}, {0, surfaces, Access::write}};
        step.taps = 9 * pixels_;
        planner_.step(std::move(step));
    }

    // Surfaces of the neighbors, a half of the texture each if there are two. Those that this frame
    // hides are left out if the light has changed around them.
    std::vector<Packed> add_surfaces_of(const NeighborList& neighbors, TextureId surfaces_here) {
        if (neighbors.empty()) return {};
        std::vector<Packed> every;
        const TextureId surfaces = planner_.texture("neighbor_surfaces", surface_format(),
                                                    neighbors.size() == 2 ? Area().two() : Area());
        for (const Neighbor neighbor : neighbors) {
            Packed packed = {surfaces, neighbor, surfaces_here};
            add_packed(packed);
            add_light(packed);
            add_shown(packed);
            every.push_back(packed);
        }
        return every;
    }

    // A step over all pixels of this frame or of a neighbor.
    Step make_surface_step_of(const Packed& packed, const std::string& file) const {
        Step step = make_surface_step(file);
        step.name += suffix_of(packed.neighbor);
        return step;
    }

    // A step that reads planes, with a thread for each square.
    Step make_plane_step(const Packed& packed, const std::string& file) {
        const auto role = [&](Role of) { return role_in(packed.neighbor, of); };
        const bool back = motion_ && planner_.has(role(Role::motion_back));
        Step step = make_surface_step_of(packed, file);
        step.spread = groups_for(kSquares);
        step.program.defines["BACK"] = flag(back);
        step.program.defines["NEIGHBOR"] = flag(packed.neighbor.has_value());
        step.bindings = {{0, planner_.input(role(Role::inverse_depth))},
                         {0, packed.surfaces, Access::write}};
        if (motion_) step.bindings.push_back({1, planner_.input(role(Role::motion))});
        if (back) step.bindings.push_back({2, planner_.input(role(Role::motion_back))});
        if (back && !packed.neighbor) add_turns(step);
        return step;
    }

    // The motion of the neighbors, which tells what turns from what bounces.
    void add_turns(Step& step) {
        for (const Neighbor neighbor :
             searched_neighbors(settings_, planner_.context().available)) {
            if (!planner_.has(role_of(neighbor, Role::motion_back))) continue;
            const bool before = neighbor == Neighbor::before;
            step.program.defines[before ? "TURNS_BEFORE" : "TURNS_AFTER"] = "1";
            const int first = before ? 7 : 9;
            step.bindings.push_back({first, planner_.input(role_of(neighbor, Role::motion))});
            step.bindings.push_back(
                {first + 1, planner_.input(role_of(neighbor, Role::motion_back))});
            step.taps += 2 * pixels_;
        }
    }

    // From the planes.
    void add_packed(Packed& packed) {
        packed.marks =
            planner_.texture("marks" + suffix_of(packed.neighbor), Format::r32ui, kSquares);
        Step step = make_plane_step(packed, "inverse_warp/surfaces.comp");
        step.bindings.push_back({1, packed.marks, Access::write});
        if (packed.neighbor) step.bindings.push_back({3, packed.here});
        // All pixels and, at most, all once more as edges.
        step.taps += pixels_ * 20;
        planner_.step(std::move(step));
    }

    void add_light(Packed& packed) {
        constexpr Area kPatches = Area().in_squares(INVERSE_WARP_LIGHT_PATCH_PX);
        const Neighbor neighbor = *packed.neighbor;
        packed.light = planner_.texture("light" + suffix_of(neighbor), Format::rgba32f, kPatches);
        Step step = make_surface_step_of(packed, "inverse_warp/light.comp");
        step.spread = groups_for(kPatches);
        step.bindings = {{0, planner_.input(role_of(neighbor, Role::color))},
                         {1, packed.surfaces},
                         {2, planner_.input(Role::color)},
                         {3, packed.here},
                         {0, packed.light, Access::write}};
        step.taps = pixels_;  // four of each fourth pixel
        planner_.step(std::move(step));
    }

    // Changes the surfaces of bright edges and, of a neighbor, of those whose light differs.
    TextureId add_shown(const Packed& packed) {
        const TextureId shown = planner_.texture("shown" + suffix_of(packed.neighbor),
                                                 Format::r32ui, kSquares.times(2, 1));
        Step edges = make_surface_step_of(packed, "inverse_warp/bright_edges.comp");
        edges.spread = groups_for(kSquares);
        edges.program.defines["SPLIT"] = flag(!packed.neighbor);
        edges.bindings = {{0, planner_.input(role_in(packed.neighbor, Role::color))},
                          {1, packed.surfaces},
                          {2, packed.marks},
                          {0, shown, Access::write}};
        edges.taps = 10 * pixels_;
        planner_.step(std::move(edges));

        Step step = make_plane_step(packed, "inverse_warp/shown_surfaces.comp");
        step.bindings.push_back({3, shown});
        if (packed.neighbor) {
            step.bindings.push_back({4, packed.here});
            step.bindings.push_back({5, packed.light});
            step.bindings.push_back({6, packed.marks});
        }
        step.taps += 10 * pixels_;
        planner_.step(std::move(step));
        return shown;
    }

    // Finds, at all other edges, the color that pixels of two surfaces have of their own.
    void add_split(const Packed& packed, TextureId shown) {
        const TextureId mixed = planner_.texture("mixed", Format::r32ui);
        const auto make = [&](const char* name, int first, TextureId read, TextureId written) {
            Step step = make_surface_step(name);
            step.spread = groups_for(kSquares);
            step.bindings = {{first, read},
                             {1, packed.surfaces},
                             {2, packed.marks},
                             {3, shown},
                             {0, written, Access::write}};
            return step;
        };
        Step find = make("inverse_warp/mixed_pixels.comp", 0, planner_.input(Role::color), mixed);
        if (settings_.shutter) find.bindings.push_back({4, planner_.input(Role::motion)});
        find.taps = 10 * pixels_;
        planner_.step(std::move(find));
        Step split = make("inverse_warp/split_pixels.comp", 4, mixed, packed.surfaces);
        split.taps = pixels_;
        planner_.step(std::move(split));
    }

    TextureId layer_images(const std::string& name) {
        return planner_.layers(name, planner_.context().layers_format());
    }
    // Two positions and a color for each sample, if the first start surface is right.
    int taps_px() const {
        return 3 * std::max(settings_.parameters.samples, INVERSE_WARP_MIN_TIMES);
    }

    // Room for a pixel's taps (taps.glsl), rounded up so that few programs serve all numbers.
    int room_for_taps() const {
        const int samples = taps_px() / 3;
        return samples <= 32 ? int(std::bit_ceil(unsigned(samples))) : (samples + 31) / 32 * 32;
    }

    // Texture fetches of a pixel, at most: two from itself and from each start surface, twice three
    // of them in each neighbor and in the layer behind, three for what continues behind; then one
    // where a deferred sample is resolved, and eight for the color. Or surface and color of each
    // pixel around a small circle.
    uint64_t most_taps_px(size_t neighbors) const {
        constexpr uint64_t kAcross = 2 * SMALL_CIRCLES_REACH_PX + 1;
        const uint64_t begins = uint64_t(settings_.parameters.search.starts) + 1;
        return std::max(uint64_t(taps_px()) / 3 * ((2 + 6 * neighbors + 3) * begins + 1 + 8),
                        settings_.lens ? 2 * kAcross * kAcross : 0);
    }

    // Surfaces of a block from which start surfaces are chosen: those that this frame shows, one of
    // each neighbor, and one of the layer behind.
    int candidates() const {
        const NeighborList neighbors = searched_neighbors(settings_, planner_.context().available);
        return kShownSurfaces + int(neighbors.size()) + int(second_layer_);
    }

    // Work groups of a step that does something for each block: on a GPU one for each; otherwise an
    // invocation for each block, and this many of them a side of a group.
    Area spread_over_blocks(int blocks_of_group) const {
        if (planner_.context().device == DeviceClass::gpu) return kBlocks;
        return kBlocks.in_squares(blocks_of_group);
    }

    TextureId add_block_surfaces(TextureId surfaces, const std::vector<Packed>& neighbors) {
        const TextureId block_surfaces =
            planner_.texture("block_surfaces", Format::rgba32ui, kBlocks.times(candidates(), 1));
        Step step = make_surface_step("inverse_warp/block_surfaces.comp");
        step.program.defines["GIVEN"] = std::to_string(candidates());
        if (second_layer_) step.program.defines["SECOND_LAYER"] = "1";
        step.spread = spread_over_blocks(kBlockPx);
        step.bindings = {{0, surfaces}, {0, block_surfaces, Access::write}};
        step.taps = (kShownSurfaces + int(second_layer_)) * pixels_;
        planner_.step(std::move(step));
        for (const Packed& packed : neighbors) add_hidden_surfaces(packed, block_surfaces);
        return block_surfaces;
    }

    void add_hidden_surfaces(const Packed& packed, TextureId block_surfaces) {
        Step step = make_surface_step_of(packed, "inverse_warp/hidden_surfaces.comp");
        step.program.defines["GIVEN"] = std::to_string(candidates());
        step.spread = spread_over_blocks(kBlockPx);
        step.bindings = {{0, packed.surfaces},
                         {1, packed.marks},
                         {2, block_surfaces},
                         {0, block_surfaces, Access::write}};
        step.taps = 4 * pixels_;
        planner_.step(std::move(step));
    }

    // Chooses for each block `chosen` surfaces from the `given` ones of each block in its row or
    // column.
    Step make_starts_step(const char* file, bool rows, int given, int chosen) {
        Step step = make_surface_step(file);
        step.program.defines["GIVEN"] = std::to_string(given);
        step.program.defines["STARTS"] = std::to_string(chosen);
        const NeighborList neighbors = searched_neighbors(settings_, planner_.context().available);
        step.program.defines["NEIGHBORS"] = flag(!neighbors.empty());
        step.spread = spread_over_blocks(INVERSE_WARP_STARTS_BLOCKS);
        double longest =
            longest_px(settings_, frame_, holds_motion_back(settings_, planner_.context()));
        // The frame's bounds do not cover what it hides, and a neighbor's surfaces come from so
        // many times their path.
        if (candidates() > kShownSurfaces) longest = longest_px(settings_);
        if (!neighbors.empty())
            longest *= 1 + 1 / (settings_.shutter ? settings_.shutter->half_open : 1);
        const int ring = ring_of(longest);
        const int line = std::min(2 * ring + 1, blocks_[rows ? 0 : 1]);
        step.taps = uint64_t(blocks_[0]) * uint64_t(blocks_[1]) * uint64_t(line) * uint64_t(given) *
                    uint64_t(chosen);
        return step;
    }

    Starts add_starts(TextureId block_surfaces) {
        const bool by_blocks = planner_.context().uses(settings_.still_rule);
        const int count = settings_.parameters.search.starts, row_count = count + kMoreInRow;
        const TextureId row_starts =
            planner_.texture("row_starts", Format::rgba32ui, kBlocks.times(row_count, 1));
        Step rows = make_starts_step("inverse_warp/row_starts.comp", true, candidates(), row_count);
        rows.bindings = {{0, block_surfaces}, {0, row_starts, Access::write}};
        planner_.step(std::move(rows));
        Starts starts;
        starts.surfaces = planner_.texture("starts", Format::rgba32ui, kBlocks.times(count + 1, 1));
        Step step = make_starts_step("inverse_warp/starts.comp", false, row_count, count);
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
        Step step = make_surface_step("inverse_warp/background.comp");
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
            step.taps += 3 * pixels_ * uint64_t(frame_.layers);
        }
        planner_.step(std::move(step));
        add_continuation(background, depth);
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

    void add_continuation(Background& background, TextureId depth) {
        const Area cells = planner_.describe(depth).area;
        background.cells = planner_.texture("background", Format::rg32f, cells);
        Step step = make_surface_step("inverse_warp/continuation.comp");
        step.spread = groups_for(kBlocks.times(8, 8));
        step.bindings = {{0, depth}, {1, background.color}, {0, background.cells, Access::write}};
        step.taps = 24 * pixels_;
        planner_.step(std::move(step));
    }

    Hint add_hint() {
        if (!settings_.shutter) {
            if (!planner_.has(Role::hint) || !planner_.wanted(Role::hint)) return {};
            const TextureId given = planner_.input(Role::hint);
            return {given, planner_.texture("hint", planner_.describe(given).format)};
        }
        if (planner_.wanted(Role::hint)) return {-1, planner_.texture("hint", Format::rg32f)};
        planner_.elide({.kind = ElisionKind::output,
                        .item = "hint",
                        .rule = kRuleUnusedStep,
                        .fact = {"no later pass reads it"},
                        .saving = {.bytes = 8 * pixels_}});
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
        from.noise = noise::add_table(planner_, settings_.noise());
        if (!settings_.lens) return;
        from.lens_samples =
            lens::add_table(planner_, settings_.lens->aperture, settings_.parameters.samples);
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
        Step step = make_surface_step("inverse_warp/gather.comp");
        auto& defines = step.program.defines;
        defines["STARTS"] =
            std::to_string(std::bit_ceil(unsigned(settings_.parameters.search.starts)));
        defines["NOISE"] = flag(from.noise >= 0);
        defines["DENOISE"] = flag(settings_.parameters.denoise);
        defines["HINT"] = flag(hint.made >= 0);
        if (frame_.fill_layer >= 0) defines["FILL_LAYER"] = "1";
        defines["BEFORE"] = defines["AFTER"] = "0";
        defines["BARREL"] = flag(settings_.lens && settings_.lens->aperture.cats_eye > 0);
        step.bindings = {{GATHER_COLOR, planner_.input(Role::color)},
                         {GATHER_SURFACES, from.surfaces},
                         {GATHER_STARTS, from.starts.surfaces},
                         {GATHER_BLURRED_IMAGE, result.color, Access::write},
                         {GATHER_BACKGROUND_COLOR, from.background.color},
                         {GATHER_BACKGROUND, from.background.cells}};
        const auto bind = [&](int unit, TextureId texture, Access access = Access::sample_nearest) {
            if (texture >= 0) step.bindings.push_back({unit, texture, access});
        };
        bind(GATHER_NOISE, from.noise);
        for (const Neighbor neighbor : from.neighbors) {
            const bool before = neighbor == Neighbor::before;
            defines[before ? "BEFORE" : "AFTER"] = "1";
            bind(before ? GATHER_COLOR_BEFORE : GATHER_COLOR_AFTER,
                 planner_.input(role_of(neighbor, Role::color)));
        }
        bind(GATHER_NEIGHBOR_SURFACES, from.neighbor_surfaces);
        bind(GATHER_LENS_SAMPLES, from.lens_samples);
        bind(GATHER_SOFT_IMAGE, soft.blurred.color, Access::write);
        bind(GATHER_SPREAD_IMAGE, soft.spread, Access::write);
        bind(GATHER_GIVEN_HINT, hint.given);
        if (second_layer_) {
            defines["SECOND_LAYER"] = "1";
            bind(GATHER_SECOND_LAYER, planner_.input(Role::behind));
        }
        bind(GATHER_HINT_IMAGE, hint.made, Access::write);
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
        std::vector<Binding> arrays = {{GATHER_LAYERS, planner_.input(Role::layers)},
                                       {GATHER_BACKGROUND_LAYERS, from.background.layers},
                                       {GATHER_LAYERS_BLURRED_IMAGE, result.layers, Access::write},
                                       {GATHER_OCCUPIED_IMAGE, from.occupied, Access::read}};
        if (settings_.parameters.denoise) {
            arrays.push_back({GATHER_LAYERS_SOFT_IMAGE, soft.blurred.layers, Access::write});
            arrays.push_back({GATHER_REACHED_IMAGE, soft.reached, Access::write});
        }
        for (const Neighbor neighbor : from.neighbors)
            arrays.push_back(
                {neighbor == Neighbor::before ? GATHER_LAYERS_BEFORE : GATHER_LAYERS_AFTER,
                 planner_.input(role_of(neighbor, Role::layers))});
        return arrays;
    }

    // In place.
    void add_denoise(const Soft& soft, const Colors& result, TextureId moving_blocks) {
        Step step = make_step("inverse_warp/denoise.comp");
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

    PassPlanner& planner_;
    const Settings& settings_;
    const FrameDescription& frame_;
    const bool motion_;        // surfaces hold it
    const bool straight_;      // and no acceleration
    const bool layered_;       // the frame has extra layers
    const bool second_layer_;  // the pass uses the layer behind (chain/frame/behind.h)
    const std::array<int, 3> blocks_;
    const uint64_t pixels_;
};

}  // namespace

double longest_px(const Settings& settings) {
    return (settings.shutter ? settings.shutter->max_path_px : 0) +
           (settings.lens ? settings.lens->coc.max_radius_px : 0);
}

// A surface of a block may differ by a tenth from those that its block has chosen
// (start_choice.glsl).
int ring_of(double longest_px) {
    return int(std::ceil((1.1 * longest_px + 1) / kBlockPx)) + 1;
}

void add_steps(PassPlanner& planner, const Settings& settings) {
    Planner(planner, settings).plan();
}

void write_step_uniforms(const Settings& settings, const FrameDescription& frame,
                         const NeighborList& neighbors, UniformWriter& writer) {
    InverseWarpUniforms uniforms = uniforms_of(settings, frame);
    writer.set(uniforms);
    uniforms.second_half = 1;
    writer.set("second_surfaces", uniforms);
    for (const Neighbor neighbor : neighbors) {
        uniforms.neighbor = frames_to(neighbor);
        uniforms.second_half = neighbor == *neighbors.begin() ? 0 : 1;
        for (const std::string_view step : steps_of(neighbor)) writer.set(step, uniforms);
    }
}

}  // namespace postchain::inverse_warp
