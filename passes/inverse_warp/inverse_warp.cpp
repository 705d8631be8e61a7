#include "passes/inverse_warp/inverse_warp.h"

#include <algorithm>
#include <cmath>

#include "chain/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/lens_samples.h"
#include "passes/inverse_warp/reference.h"
#include "shaders/shared/inverse_warp_uniforms.h"

namespace postchain::inverse_warp {
namespace {

using shared::InverseWarpUniforms;

// A sample is denoised if its displacements have at least the variance kSoftSpread (px^2; a circle
// of confusion of 4 px radius). A pixel d away has the weight exp(-window d^T covariance^-1 d); the
// window grows with the root of the samples. Lens samples are more even than random ones, with
// times they are not. Chosen by measurement (docs/inverse_warp.md).
constexpr double kSoftSpread = 8;
constexpr double kWindow = 5.7;
constexpr double kWindowWithShutter = 4.2;

// A block takes more samples if their variance, as shown, is above this. Chosen by measurement
// (docs/inverse_warp.md).
constexpr double kNoiseVariance = 0.045;

constexpr double kMinHalfOpen = 1.0 / 16;  // frames

// Blocks on each side whose surfaces can reach a block, for the longest path and radius. A surface
// of a block may differ by a tenth from those that its block has chosen (starts.comp).
int ring_of(double longest_px) {
    return int(std::ceil((1.1 * longest_px + 1) / kBlockPx)) + 1;
}

double longest_px(const Settings& settings) {
    return (settings.shutter ? settings.shutter->max_path_px : 0) +
           (settings.lens ? settings.lens->coc.max_radius_px : 0);
}

// The longest displacement within the frame's bounds: blocks beyond it are never reached.
double longest_px(const Settings& settings, const FrameDescription& frame, bool back) {
    const FrameBounds& bounds = frame.bounds;
    double longest = 0;
    if (settings.shutter) {
        const double speed =
            back ? std::max(bounds.max_speed_px, bounds.max_speed_back_px) : bounds.max_speed_px;
        const double half_open = settings.shutter->half_open;
        // With a closed shutter nothing moves, however fast; infinity is an unknown speed.
        const double path = half_open > 0 ? half_open * speed : 0;
        // Rounding of a and b: a few 2^-24 of them, and a step of 1/64 px.
        longest = std::min(path * (1 + 1e-5) + 0.05, settings.shutter->max_path_px);
    }
    if (settings.lens)
        longest += settings.lens->coc.largest_radius_px(bounds.min_inverse_depth,
                                                        bounds.max_inverse_depth) +
                   0.05;
    return std::min(longest, longest_px(settings));
}

InverseWarpUniforms uniforms_of(const Settings& settings, const FrameDescription& frame,
                                bool back) {
    const auto blocks = groups_for(frame.width, frame.height);
    InverseWarpUniforms uniforms{};
    uniforms.size = {frame.width, frame.height};
    uniforms.blocks = {blocks[0], blocks[1]};
    uniforms.ring = ring_of(longest_px(settings, frame, back));
    uniforms.samples = settings.samples;
    uniforms.half_shutter = 1;
    uniforms.max_path_px = 1e15f;
    uniforms.still_limit_px = float(settings.still_limit_px);
    uniforms.soft_spread = float(kSoftSpread);
    uniforms.denoise_window = float((settings.shutter ? kWindowWithShutter : kWindow) *
                                    std::sqrt(double(settings.samples)));
    if (settings.shutter) {
        uniforms.half_shutter = float(settings.shutter->half_open);
        uniforms.max_path_px = float(settings.shutter->max_path_px);
        uniforms.time_jitter = float(settings.shutter->time_jitter);
        uniforms.path_px_per_time = float(settings.shutter->path_px_per_time);
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
        uniforms.lens_sets = lens::sets_of(settings.samples + settings.more_samples);
        uniforms.more_samples = settings.more_samples;
        // Halves of n samples of variance v: their means differ by 4 v/n in the mean square.
        uniforms.noise_limit = float(4 * kNoiseVariance / settings.samples);
    }
    return uniforms;
}

// To the farthest cell, 16 of 2 px away, in which behind.comp looks for a hidden surface.
constexpr double kBehindReachPx = 2 * 16 + 2;

std::string flag(bool on) {
    return on ? "1" : "0";
}

// True if surfaces hold their motion, and also the motion from the frame before.
bool holds_motion(const Settings& settings, const PlanContext& context) {
    return settings.shutter || !searched_neighbors(settings, context.available).empty();
}
bool holds_motion_back(const Settings& settings, const PlanContext& context) {
    return holds_motion(settings, context) && context.available.has(Role::motion_back);
}

// Plans the steps of inverse_warp.h in their order. A function adds the steps of one line there and
// returns their textures; -1 is a texture that is not needed.
class Planner {
  public:
    Planner(PassPlanner& planner, const Settings& settings)
        : planner_(planner),
          settings_(settings),
          frame_(planner.context().frame),
          motion_(holds_motion(settings, planner.context())),
          layered_(planner.has(Role::layers)),
          blocks_(groups_for(frame_.width, frame_.height)),
          pixels_(uint64_t(frame_.width) * uint64_t(frame_.height)) {}

    void plan() {
        Gathered from;
        from.surfaces = add_surfaces({});
        for (const Neighbor neighbor : searched_neighbors(settings_, planner_.context().available))
            from.neighbors.push_back({neighbor, add_surfaces(neighbor)});
        from.starts = add_starts(add_block_surfaces(from.surfaces));
        from.background = add_background(from.surfaces);
        if (layered_) from.occupied = add_occupied(from.neighbors);
        const Hint hint = add_hint();
        Colors result = {picture("color", planner_.context().color_format()), -1};
        if (layered_) result.layers = layer_images("layers");
        const Soft soft = settings_.denoise ? add_soft() : Soft();
        add_tables(from);
        if (from.starts.still_blocks >= 0)
            keep_still_blocks(from.starts.still_blocks, result, hint, soft);
        add_gather(from, hint, settings_.denoise ? soft.gathered : result, soft);
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
        Colors gathered, blurred;
        TextureId spread = -1;
        TextureId reached = -1;  // with layers
    };
    struct Searched {
        Neighbor neighbor;
        TextureId surfaces;
    };
    // The textures that gather reads.
    struct Gathered {
        TextureId surfaces = -1;
        std::vector<Searched> neighbors;
        Starts starts;
        Background background;
        TextureId occupied = -1;  // with layers
        TextureId noise = -1, lens_samples = -1;
    };

    TextureId picture(const std::string& name, Format format) {
        return planner_.texture(name, format, frame_.width, frame_.height);
    }
    TextureId layer_images(const std::string& name) {
        return planner_.layers(name, planner_.context().layers_format(), frame_.width,
                               frame_.height);
    }
    // Two positions and a color for each sample, if the first start surface is right.
    int taps_px() const {
        return 3 * std::max(settings_.samples + settings_.more_samples, INVERSE_WARP_MIN_TIMES);
    }

    // Texture fetches of a pixel, at most: two from itself and from each start surface, twice three
    // of them in each neighbor, three for what continues behind, and eight for the color.
    uint64_t most_taps_px(size_t neighbors) const {
        const uint64_t begins = uint64_t(settings_.search.starts) + 1;
        return uint64_t(taps_px()) / 3 * ((2 + 6 * neighbors + 3) * begins + 8);
    }

    // A step over all pixels.
    Step make_step(const std::string& name) const {
        Step step;
        step.name = name;
        step.program.file = "inverse_warp/" + name + ".comp";
        step.take_uniforms<InverseWarpUniforms>();
        step.groups = groups_for(frame_.width, frame_.height);
        return step;
    }
    // For every step that reads surfaces.
    Step make_surface_step(const std::string& name) const {
        Step step = make_step(name);
        step.program.defines = {{"SHUTTER", flag(settings_.shutter.has_value())},
                                {"LENS", flag(settings_.lens.has_value())},
                                {"MOTION", flag(motion_)}};
        if (settings_.lens)
            step.program.defines[settings_.lens->coc.lens ? "COC_LENS" : "COC_PLANES"] = "1";
        return step;
    }
    // A step with a thread per block.
    Step make_block_step(const std::string& name) const {
        Step step = make_surface_step(name);
        step.groups = groups_for(blocks_[0], blocks_[1]);
        return step;
    }

    // Surfaces of this frame or of a neighbor.
    TextureId add_surfaces(std::optional<Neighbor> neighbor) {
        const auto role = [&](Role of) { return neighbor ? role_of(*neighbor, of) : of; };
        const std::string suffix = neighbor ? concat("_", name_of(*neighbor)) : std::string();
        const Format format = motion_ ? Format::rgba32ui : Format::r32ui;
        const TextureId of_planes = picture("surfaces_of_planes" + suffix, format);
        const bool back = motion_ && planner_.has(role(Role::motion_back));
        Step step = make_surface_step("surfaces");
        step.name += suffix;
        step.program.defines["BACK"] = flag(back);
        step.program.defines["NEIGHBOR"] = flag(neighbor.has_value());
        step.bindings = {{0, planner_.input(role(Role::inverse_depth))},
                         {0, of_planes, Access::write}};
        if (motion_) step.bindings.push_back({1, planner_.input(role(Role::motion))});
        if (back) step.bindings.push_back({2, planner_.input(role(Role::motion_back))});
        step.taps = pixels_ * (motion_ ? (back ? 15 : 10) : 5);
        planner_.step(std::move(step));

        const TextureId shown = picture("shown" + suffix, Format::r32ui);
        add_shown_step(
            "bright_edges", suffix,
            {{0, planner_.input(role(Role::color))}, {1, of_planes}, {0, shown, Access::write}});
        const TextureId surfaces = picture("surfaces" + suffix, format);
        add_shown_step("shown_surfaces", suffix,
                       {{0, of_planes}, {1, shown}, {0, surfaces, Access::write}});
        return surfaces;
    }

    void add_shown_step(const std::string& name, const std::string& suffix,
                        std::vector<Binding> bindings) {
        Step step = make_surface_step(name);
        step.name += suffix;
        step.bindings = std::move(bindings);
        step.taps = 10 * pixels_;
        planner_.step(std::move(step));
    }

    TextureId add_block_surfaces(TextureId surfaces) {
        const TextureId block_surfaces =
            planner_.texture("block_surfaces", Format::rgba32ui, 3 * blocks_[0], blocks_[1]);
        Step step = make_block_step("block_surfaces");
        step.bindings = {{0, surfaces}, {0, block_surfaces, Access::write}};
        step.taps = 3 * pixels_;
        planner_.step(std::move(step));
        return block_surfaces;
    }

    Starts add_starts(TextureId block_surfaces) {
        const bool by_blocks = planner_.context().uses(settings_.still_rule);
        Starts starts;
        starts.surfaces = planner_.texture("starts", Format::rgba32ui,
                                           (settings_.search.starts + 1) * blocks_[0], blocks_[1]);
        Step step = make_block_step("starts");
        step.program.defines["STARTS"] = std::to_string(settings_.search.starts);
        step.program.defines["LISTS"] = flag(by_blocks);
        step.bindings = {{0, block_surfaces}, {0, starts.surfaces, Access::write}};
        for (size_t axis : {0, 1})
            step.groups[axis] =
                (blocks_[axis] + INVERSE_WARP_STARTS_BLOCKS - 1) / INVERSE_WARP_STARTS_BLOCKS;
        const int ring = ring_of(
            longest_px(settings_, frame_, holds_motion_back(settings_, planner_.context())));
        step.taps = uint64_t(blocks_[0]) * uint64_t(blocks_[1]) * 3 * uint64_t(2 * ring + 1) *
                    uint64_t(2 * ring + 1) * uint64_t(settings_.search.starts);
        if (by_blocks) {
            const auto add_list = [&](int unit, const char* name) {
                return add_work_list(planner_, step, unit, name, frame_.width, frame_.height);
            };
            starts.moving_blocks = add_list(0, "moving_blocks");
            starts.still_blocks = add_list(1, "still_blocks");
        }
        planner_.step(std::move(step));
        return starts;
    }

    Background add_background(TextureId surfaces) {
        // Cells of 2, 4, 8 and 16 px beside each other.
        const int width = (8 + 4 + 2 + 1) * blocks_[0], height = 8 * blocks_[1];
        Background background;
        background.color =
            planner_.texture("background_color", planner_.context().color_format(), width, height);
        const TextureId depth = planner_.texture("background_depth", Format::rg32f, width, height);
        Step step = make_block_step("background");
        step.bindings = {{0, planner_.input(Role::color)},
                         {1, surfaces},
                         {0, background.color, Access::write},
                         {1, depth, Access::write}};
        step.taps = 2 * pixels_;
        if (layered_) {
            background.layers = planner_.layers("background_layers",
                                                planner_.context().layers_format(), width, height);
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

    TextureId add_occupied(const std::vector<Searched>& neighbors) {
        const int frames = 1 + int(neighbors.size());
        const TextureId occupied =
            planner_.array("occupied", Format::r32ui, blocks_[0], blocks_[1], frames * words());
        Step step;
        step.name = "occupied";
        step.program = {"inverse_warp/occupied.comp", {{"BEFORE", "0"}, {"AFTER", "0"}}};
        step.bindings = {{0, planner_.input(Role::layers)}, {0, occupied, Access::write}};
        for (const Searched& other : neighbors) {
            const bool before = other.neighbor == Neighbor::before;
            step.program.defines[before ? "BEFORE" : "AFTER"] = "1";
            step.bindings.push_back(
                {before ? 1 : 2, planner_.input(role_of(other.neighbor, Role::layers))});
        }
        step.groups = {blocks_[0], blocks_[1], frames * words()};
        step.taps = pixels_ * uint64_t(frames) * uint64_t(frame_.layers);
        planner_.step(std::move(step));
        return occupied;
    }

    void add_behind(Background& background, TextureId depth) {
        const PlanTexture size = planner_.describe(depth);
        background.cells =
            planner_.texture("background", Format::rgba32ui, size.width, size.height);
        Step step = make_surface_step("behind");
        step.groups = groups_for(size.width, size.height);
        step.bindings = {{0, depth}, {1, background.color}, {0, background.cells, Access::write}};
        step.taps = 16 * pixels_;
        planner_.step(std::move(step));
    }

    Hint add_hint() {
        if (!settings_.shutter) {
            if (!planner_.has(Role::hint) || !planner_.wanted(Role::hint)) return {};
            const TextureId given = planner_.input(Role::hint);
            return {given, picture("hint", planner_.describe(given).format)};
        }
        if (planner_.wanted(Role::hint)) return {-1, picture("hint", Format::rg8)};
        planner_.elide({.kind = ElisionKind::output,
                        .item = "hint",
                        .rule = kRuleUnusedStep,
                        .fact = {"no later pass reads it"},
                        .saving = {.bytes = 2 * pixels_}});
        return {};
    }

    Soft add_soft() {
        Soft soft;
        soft.gathered.color = picture("gathered", planner_.context().color_format());
        soft.blurred.color = picture("soft", planner_.context().color_format());
        // In halves the determinant of a narrow streak would be lost in rounding.
        soft.spread = picture("spread", Format::rgba32f);
        if (!layered_) return soft;
        soft.gathered.layers = layer_images("layers_gathered");
        soft.blurred.layers = layer_images("layers_soft");
        soft.reached =
            planner_.array("reached", Format::r32ui, frame_.width, frame_.height, words());
        return soft;
    }

    // Before the steps that write the result: such steps then stand together in the plan, and two
    // plans can share them (chain/merge.h).
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
        defines["STARTS"] = std::to_string(settings_.search.starts);
        defines["NOISE"] = flag(from.noise >= 0);
        defines["DENOISE"] = flag(settings_.denoise);
        defines["HINT"] = flag(hint.made >= 0);
        if (frame_.fill_layer >= 0) defines["FILL_LAYER"] = std::to_string(frame_.fill_layer);
        defines["ADAPTIVE"] = flag(settings_.more_samples > 0);
        defines["BEFORE"] = defines["AFTER"] = "0";
        defines["BARREL"] = flag(settings_.lens && settings_.lens->aperture.cats_eye > 0);
        step.bindings = {{0, planner_.input(Role::color)}, {1, from.surfaces},
                         {2, from.starts.surfaces},        {0, result.color, Access::write},
                         {11, from.background.color},      {12, from.background.cells}};
        if (from.noise >= 0) step.bindings.push_back({3, from.noise});
        for (const Searched& other : from.neighbors) {
            const bool before = other.neighbor == Neighbor::before;
            defines[before ? "BEFORE" : "AFTER"] = "1";
            step.bindings.push_back(
                {before ? 7 : 9, planner_.input(role_of(other.neighbor, Role::color))});
            step.bindings.push_back({before ? 8 : 10, other.surfaces});
        }
        if (from.lens_samples >= 0) step.bindings.push_back({4, from.lens_samples});
        if (settings_.denoise) {
            step.bindings.push_back({2, soft.blurred.color, Access::write});
            step.bindings.push_back({3, soft.spread, Access::write});
        }
        if (hint.given >= 0) step.bindings.push_back({6, hint.given});
        if (hint.made >= 0) step.bindings.push_back({1, hint.made, Access::write});
        step.taps = pixels_ * uint64_t(taps_px());
        step.group_taps = uint64_t(kBlockPx * kBlockPx) * most_taps_px(from.neighbors.size());
        launch_by(step, from.starts.moving_blocks);
        if (layered_) {
            add_layers(step, gathered_layers(from, result, soft));
            step.program.defines["TAPS"] = std::to_string(taps_px() / 3);
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
        for (const Searched& other : from.neighbors)
            arrays.push_back({other.neighbor == Neighbor::before ? 15 : 5,
                              planner_.input(role_of(other.neighbor, Role::layers))});
        return arrays;
    }

    void add_denoise(const Soft& soft, const Colors& result, TextureId moving_blocks) {
        Step step = make_step("denoise");
        step.bindings = {{0, soft.gathered.color},
                         {1, soft.blurred.color},
                         {2, soft.spread},
                         {0, result.color, Access::write}};
        step.taps = 30 * pixels_;
        launch_by(step, moving_blocks);
        if (layered_) {
            add_layers(step, {{3, soft.gathered.layers},
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
    const bool motion_;   // surfaces hold it
    const bool layered_;  // the frame has extra layers
    const std::array<int, 3> blocks_;
    const uint64_t pixels_;
};

}  // namespace

double max_path_px(std::optional<int> max_blur_px, const FrameDescription& frame) {
    if (max_blur_px) return *max_blur_px;
    return std::clamp(frame.display_width / 8.0, 40.0, 512.0);
}

const ParameterTable& parameter_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .integer("starts", &Parameters::starts,
                     {.min = 1,
                      .max = kMaxStarts,
                      .help = "start surfaces of the search from the blocks around, "
                              "beside the pixel's own"})
            .choice("neighbors", &Parameters::neighbors, {"none", "before", "both"},
                    {.help = "neighboring frames searched for surfaces occluded in "
                             "this one, if their planes are available: none, the one before (as "
                             "an engine has), or both"})
            .table();
    return table;
}

RoleSet required_planes(bool shutter) {
    RoleSet planes = {Role::color, Role::inverse_depth};
    if (shutter) planes.add(Role::motion);
    return planes;
}

RoleSet optional_planes(bool shutter, Neighbors neighbors) {
    RoleSet planes;
    if (shutter) planes.add(Role::motion_back);
    if (neighbors == Neighbors::none) return planes;
    planes = planes | RoleSet{Role::motion, Role::motion_back};
    for (const Neighbor neighbor : kNeighbors)
        if (neighbor == Neighbor::before || neighbors == Neighbors::both)
            for (const Role role : kNeighborRoles) planes.add(role_of(neighbor, role));
    return planes - required_planes(shutter);
}

std::vector<Neighbor> searched_neighbors(const Settings& settings, RoleSet available) {
    std::vector<Neighbor> found;
    if (settings.shutter && settings.shutter->half_open < kMinHalfOpen) return found;
    for (const Neighbor neighbor : kNeighbors) {
        if (settings.search.neighbors == Neighbors::none) break;
        if (settings.search.neighbors == Neighbors::before && neighbor != Neighbor::before)
            continue;
        bool all = available.has(Role::motion);
        for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
            all = all && available.has(role_of(neighbor, role));
        // A neighbor that fills color must fill the layers too, or they would not sum to it.
        if (available.has(Role::layers))
            all = all && available.has(role_of(neighbor, Role::layers));
        if (all) found.push_back(neighbor);
    }
    return found;
}

Guarantees guarantees_of(const Settings& settings) {
    Guarantees guarantees;
    guarantees.keeps_constants = true;
    guarantees.convex = 1e-6;
    // The barrel's cut depends on the place in the frame.
    const bool barrel = settings.lens && settings.lens->aperture.cats_eye > 0;
    guarantees.lattice_px = barrel ? 0 : kBlockPx;
    // Random numbers belong to places. On a tie between surfaces a block takes the first, which
    // prefers a side.
    if (settings.noise.noise == noise::Kind::none && !barrel)
        guarantees.symmetries = {Symmetry::shift};
    return guarantees;
}

std::vector<Settings> every_shape(const Settings& settings) {
    if (!settings.shutter) return {settings};
    Settings closed = settings, open = settings;
    closed.shutter->half_open = 0;
    open.shutter->half_open = 1;
    return {closed, open};
}

// The blocks that can reach a pixel's block end `ring` blocks from it, and a surface at their edge
// is told from others up to four pixels around it. Every position of the search lies on a path that
// ends at the pixel; occluded surfaces come from cells up to kBehindReachPx around, and denoised
// colors from two pixels further. If blocks choose how many samples they take, a pixel
// depends on all of its block.
Reach WarpOnFrame::reach() const {
    // In a neighboring frame paths are as long as the motion vectors.
    if (!searched_neighbors(settings_, frame_.planes).empty()) return {};
    const double longest = longest_px(settings_);
    const double block = settings_.more_samples > 0 ? kBlockPx : 0;
    const double hidden = longest + kBehindReachPx + 7 + block;
    return {std::max(kBlockPx * (ring_of(longest) + 1) + 7.0 + block, hidden), hidden};
}

// The table of lens samples is of an aperture, not of a frame: plan() makes it.
ShapeNumbers WarpOnFrame::shape(const PlanContext& context) const {
    uint64_t searched = 0;
    for (const Neighbor neighbor : searched_neighbors(settings_, context.available))
        searched |= uint64_t(1) << uint64_t(neighbor);
    return {searched, settings_.lens ? lens::hash_of(settings_.lens->aperture) : 0};
}

void WarpOnFrame::plan(PassPlanner& planner) const {
    Planner(planner, settings_).plan();
}

void WarpOnFrame::write_uniforms(const PlanContext& context, UniformWriter& uniforms) const {
    uniforms.set(uniforms_of(settings_, frame_, holds_motion_back(settings_, context)));
    noise::write_uniforms(settings_.noise, frame_.frame_number, uniforms);
}

void WarpOnFrame::reference(const PlanContext& context, ReferenceFrame& frame) const {
    warp_reference(context, settings_, frame);
}

}  // namespace postchain::inverse_warp
