#include "passes/inverse_warp/inverse_warp.h"

#include <algorithm>
#include <cmath>

#include "chain/layered_step.h"
#include "chain/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/lens_points.h"
#include "shaders/shared/inverse_warp_uniforms.h"

namespace postchain::inverse_warp {
namespace {

using shared::InverseWarpUniforms;

// A sample is denoised where its displacements have this variance (a circle of confusion of 4 px
// radius), within so much of their spread: for each pixel d away the weight
// exp(-window d^T covariance^-1 d), where the window grows with the root of the samples. Points of
// the lens are more even than random ones; with times beside them they are not. Chosen by
// measurement (docs/inverse_warp.md).
constexpr double kSoftSpread = 8;
constexpr double kWindow = 5.7;
constexpr double kWindowWithShutter = 4.2;

// A tile takes more samples where their variance, as shown, is above this. Chosen by measurement
// (docs/inverse_warp.md).
constexpr double kNoiseVariance = 0.045;

constexpr double kLeastHalfOpen = 1.0 / 16;  // frames

// Tiles on each side whose surfaces can reach a tile, for the longest path and radius there are. A
// surface of a tile may differ by a tenth from what its tile has chosen (starts.comp).
int ring_of(double longest_px) {
    return int(std::ceil((1.1 * longest_px + 1) / kBlockPx)) + 1;
}

double longest_px(const Settings& settings) {
    return (settings.shutter ? settings.shutter->max_path_px : 0) +
           (settings.lens ? settings.lens->coc.max_radius_px : 0);
}

// The same as far as the frame is known: tiles beyond are never reached.
double longest_px(const Settings& settings, const FrameDescription& frame, bool back) {
    const FrameBounds& bounds = frame.bounds;
    double longest = 0;
    if (settings.shutter) {
        const double speed =
            back ? std::max(bounds.max_speed_px, bounds.max_speed_back_px) : bounds.max_speed_px;
        const double half_open = settings.shutter->half_open;
        // In a closed shutter nothing moves, however fast; infinity is a speed that is not known.
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
        uniforms.lens_sets = lens::sets_of(settings.samples + settings.more_samples);
        uniforms.more_samples = settings.more_samples;
        // Halves of n samples of variance v: their means differ by 4 v/n in the mean square.
        uniforms.noise_limit = float(4 * kNoiseVariance / settings.samples);
    }
    return uniforms;
}

std::string flag(bool on) {
    return on ? "1" : "0";
}

// Do surfaces hold their motion, and also that from the frame before?
bool holds_motion(const Settings& settings, const PlanContext& context) {
    return settings.shutter || !searched_neighbors(settings, context.available).empty();
}
bool holds_motion_back(const Settings& settings, const PlanContext& context) {
    return holds_motion(settings, context) && context.available.has(Role::motion_back);
}

class Planner {
  public:
    Planner(PassPlanner& planner, const Settings& settings)
        : planner_(planner),
          settings_(settings),
          frame_(planner.context().frame),
          neighbors_(searched_neighbors(settings, planner.context().available)),
          motion_(holds_motion(settings, planner.context())),
          layered_(planner.has(Role::layers)),
          uniforms_(uniforms_of(settings, frame_, holds_motion_back(settings, planner.context()))),
          pixels_(uint64_t(frame_.width) * uint64_t(frame_.height)) {}

    void plan() {
        surfaces_ = add_surfaces({});
        for (const Neighbor neighbor : neighbors_)
            neighbor_surfaces_.push_back(add_surfaces(neighbor));
        const TextureId block_surfaces = add_block_surfaces();
        add_starts(block_surfaces);
        add_background();
        add_hint();
        result_ = picture("color", planner_.context().color_format());
        if (layered_) layers_ = layer_pictures("layers");
        if (settings_.denoise) add_soft();
        add_tables();
        if (still_blocks_ >= 0) {
            elide_blocks(planner_, "search in still blocks", settings_.still_rule,
                         {.name = "displacements that reach them",
                          .limit = settings_.still_limit_px,
                          .unit = "px"},
                         still_blocks_, taps_px());
            add_keep(planner_, still_blocks_,
                     {.color = result_,
                      .given_hint = given_hint_,
                      .hint = hint_,
                      .soft = soft_,
                      .layers = layers_});
        }
        add_gather();
        if (settings_.denoise) add_denoise();
        planner_.output(Role::color, result_);
        if (layered_) planner_.output(Role::layers, layers_);
        if (hint_ >= 0) planner_.output(Role::hint, hint_);
    }

  private:
    TextureId picture(const std::string& name, Format format) {
        return planner_.texture(name, format, frame_.width, frame_.height);
    }
    TextureId layer_pictures(const std::string& name) {
        return planner_.layers(name, planner_.context().layers_format(), frame_.width,
                               frame_.height);
    }
    // Two positions and a color for each sample, where the first start is right.
    int taps_px() const {
        return 3 * std::max(settings_.samples + settings_.more_samples, INVERSE_WARP_MIN_TIMES);
    }

    Step make_step(const std::string& name) const {
        Step step;
        step.name = name;
        step.program.file = "inverse_warp/" + name + ".comp";
        step.set_uniforms(uniforms_);
        return step;
    }
    // Of every step that reads surfaces.
    Step make_surface_step(const std::string& name) const {
        Step step = make_step(name);
        step.program.defines = {{"SHUTTER", flag(settings_.shutter.has_value())},
                                {"LENS", flag(settings_.lens.has_value())},
                                {"MOTION", flag(motion_)}};
        if (settings_.lens)
            step.program.defines[settings_.lens->coc.lens ? "COC_LENS" : "COC_PLANES"] = "1";
        return step;
    }

    // Of this frame or of a neighbor.
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
        step.groups = groups_for(frame_.width, frame_.height);
        step.taps = pixels_ * (motion_ ? (back ? 15 : 10) : 5);
        planner_.step(std::move(step));

        const TextureId shown = picture("shown" + suffix, Format::r32ui);
        add_surface_step(
            "bright_edges", suffix,
            {{0, planner_.input(role(Role::color))}, {1, of_planes}, {0, shown, Access::write}});
        const TextureId surfaces = picture("surfaces" + suffix, format);
        add_surface_step("shown_surfaces", suffix,
                         {{0, of_planes}, {1, shown}, {0, surfaces, Access::write}});
        return surfaces;
    }

    void add_surface_step(const std::string& name, const std::string& suffix,
                          std::vector<Binding> bindings) {
        Step step = make_surface_step(name);
        step.name += suffix;
        step.bindings = std::move(bindings);
        step.groups = groups_for(frame_.width, frame_.height);
        step.taps = 10 * pixels_;
        planner_.step(std::move(step));
    }

    TextureId add_block_surfaces() {
        const TextureId block_surfaces = planner_.texture(
            "block_surfaces", Format::rgba32ui, 3 * uniforms_.blocks.x, uniforms_.blocks.y);
        Step step = make_surface_step("block_surfaces");
        step.bindings = {{0, surfaces_}, {0, block_surfaces, Access::write}};
        step.groups = groups_for(uniforms_.blocks.x, uniforms_.blocks.y);
        step.taps = 3 * pixels_;
        planner_.step(std::move(step));
        return block_surfaces;
    }

    void add_starts(TextureId block_surfaces) {
        const bool by_blocks =
            !settings_.still_rule.empty() && planner_.context().uses(settings_.still_rule);
        starts_ = planner_.texture("starts", Format::rgba32ui,
                                   (settings_.search.starts + 1) * uniforms_.blocks.x,
                                   uniforms_.blocks.y);
        Step step = make_surface_step("starts");
        step.program.defines["STARTS"] = std::to_string(settings_.search.starts);
        step.program.defines["LISTS"] = flag(by_blocks);
        step.bindings = {{0, block_surfaces}, {0, starts_, Access::write}};
        step.groups = groups_for(uniforms_.blocks.x, uniforms_.blocks.y);
        const uint64_t around = uint64_t(2 * uniforms_.ring + 1) * uint64_t(2 * uniforms_.ring + 1);
        step.taps = uint64_t(uniforms_.blocks.x) * uint64_t(uniforms_.blocks.y) * 3 * around *
                    uint64_t(settings_.search.starts);
        if (by_blocks) {
            moving_blocks_ =
                add_work_list(planner_, step, 0, "moving_blocks", frame_.width, frame_.height);
            still_blocks_ =
                add_work_list(planner_, step, 1, "still_blocks", frame_.width, frame_.height);
        }
        planner_.step(std::move(step));
    }

    void add_background() {
        // Cells of 2, 4, 8 and 16 px beside each other.
        const int width = (8 + 4 + 2 + 1) * uniforms_.blocks.x, height = 8 * uniforms_.blocks.y;
        background_color_ =
            planner_.texture("background_color", planner_.context().color_format(), width, height);
        background_depth_ = planner_.texture("background_depth", Format::rg32f, width, height);
        Step step = make_surface_step("background");
        step.bindings = {{0, planner_.input(Role::color)},
                         {1, surfaces_},
                         {0, background_color_, Access::write},
                         {1, background_depth_, Access::write}};
        step.groups = groups_for(uniforms_.blocks.x, uniforms_.blocks.y);
        step.taps = 2 * pixels_;
        std::vector<Binding> arrays;
        if (layered_) {
            background_layers_ = planner_.layers("background_layers",
                                                 planner_.context().layers_format(), width, height);
            arrays = {{2, planner_.input(Role::layers)}, {2, background_layers_, Access::write}};
        }
        add_layered_step(planner_, std::move(step), arrays, pixels_);
    }

    void add_hint() {
        if (!settings_.shutter) {
            if (!planner_.has(Role::hint) || !planner_.wanted(Role::hint)) return;
            given_hint_ = planner_.input(Role::hint);
            hint_ = picture("hint", planner_.describe(given_hint_).format);
        } else if (planner_.wanted(Role::hint)) {
            hint_ = picture("hint", Format::rg8);
        } else {
            planner_.elide({.kind = ElisionKind::output,
                            .item = "hint",
                            .rule = kRuleUnusedStep,
                            .fact = {"no later pass reads it"},
                            .saving = {.bytes = 2 * pixels_}});
        }
    }

    void add_soft() {
        gathered_ = picture("gathered", planner_.context().color_format());
        soft_ = picture("soft", planner_.context().color_format());
        // In halves the determinant of a narrow streak would be lost in rounding.
        spread_ = picture("spread", Format::rgba32f);
        if (!layered_) return;
        layers_gathered_ = layer_pictures("layers_gathered");
        layers_soft_ = layer_pictures("layers_soft");
    }

    // Before the steps that write the result: such steps then stand together in the plan, and two
    // plans can share them (chain/merge.h).
    void add_tables() {
        noise_ = noise::add_table(planner_, settings_.noise);
        if (!settings_.lens) return;
        lens_points_ = lens::add_table(
            planner_,
            lens::lens_points(settings_.lens->aperture, settings_.samples, settings_.more_samples));
    }

    void add_gather() {
        Step step = make_surface_step("gather");
        auto& defines = step.program.defines;
        defines["STARTS"] = std::to_string(settings_.search.starts);
        defines["NOISE"] = flag(noise_ >= 0);
        defines["DENOISE"] = flag(settings_.denoise);
        defines["HINT"] = flag(hint_ >= 0);
        defines["ADAPTIVE"] = flag(settings_.more_samples > 0);
        defines["BEFORE"] = defines["AFTER"] = "0";
        defines["BARREL"] = flag(settings_.lens && settings_.lens->aperture.cats_eye > 0);
        step.bindings = {{0, planner_.input(Role::color), Access::sample_linear},
                         {1, surfaces_},
                         {2, starts_},
                         {0, settings_.denoise ? gathered_ : result_, Access::write}};
        step.bindings.push_back({11, background_color_});
        step.bindings.push_back({12, background_depth_});
        if (noise_ >= 0) step.bindings.push_back({3, noise_});
        for (size_t i = 0; i < neighbors_.size(); ++i) {
            const bool before = neighbors_[i] == Neighbor::before;
            defines[before ? "BEFORE" : "AFTER"] = "1";
            step.bindings.push_back({before ? 7 : 9,
                                     planner_.input(role_of(neighbors_[i], Role::color)),
                                     Access::sample_linear});
            step.bindings.push_back({before ? 8 : 10, neighbor_surfaces_[i]});
        }
        if (lens_points_ >= 0) step.bindings.push_back({4, lens_points_});
        if (settings_.denoise) {
            step.bindings.push_back({2, soft_, Access::write});
            step.bindings.push_back({3, spread_, Access::write});
        }
        if (given_hint_ >= 0) step.bindings.push_back({6, given_hint_});
        if (hint_ >= 0) step.bindings.push_back({1, hint_, Access::write});
        step.groups = groups_for(frame_.width, frame_.height);
        step.taps = pixels_ * uint64_t(taps_px());
        launch_by(step, moving_blocks_);
        add_layered_step(planner_, std::move(step), gathered_arrays(),
                         pixels_ * uint64_t(taps_px() / 3));
    }

    // What the gather reads and writes of layers.
    std::vector<Binding> gathered_arrays() const {
        if (!layered_) return {};
        std::vector<Binding> arrays = {
            {13, planner_.input(Role::layers), Access::sample_linear},
            {14, background_layers_},
            {4, settings_.denoise ? layers_gathered_ : layers_, Access::write}};
        if (settings_.denoise) arrays.push_back({5, layers_soft_, Access::write});
        for (const Neighbor neighbor : neighbors_)
            arrays.push_back({neighbor == Neighbor::before ? 15 : 5,
                              planner_.input(role_of(neighbor, Role::layers)),
                              Access::sample_linear});
        return arrays;
    }

    void add_denoise() {
        Step step = make_step("denoise");
        step.bindings = {{0, gathered_}, {1, soft_}, {2, spread_}, {0, result_, Access::write}};
        step.groups = groups_for(frame_.width, frame_.height);
        step.taps = 30 * pixels_;
        launch_by(step, moving_blocks_);
        std::vector<Binding> arrays;
        if (layered_)
            arrays = {{3, layers_gathered_}, {4, layers_soft_}, {1, layers_, Access::write}};
        add_layered_step(planner_, std::move(step), arrays, 10 * pixels_);
    }

    PassPlanner& planner_;
    const Settings& settings_;
    const FrameDescription& frame_;
    const std::vector<Neighbor> neighbors_;
    const bool motion_;   // surfaces hold it
    const bool layered_;  // the frame has further layers
    const InverseWarpUniforms uniforms_;
    const uint64_t pixels_;
    std::vector<TextureId> neighbor_surfaces_;
    TextureId surfaces_ = -1, starts_ = -1, moving_blocks_ = -1, still_blocks_ = -1;
    TextureId background_color_ = -1, background_depth_ = -1;
    TextureId noise_ = -1, lens_points_ = -1;
    TextureId gathered_ = -1, soft_ = -1, spread_ = -1;
    TextureId given_hint_ = -1, hint_ = -1, result_ = -1;
    TextureId layers_ = -1, layers_gathered_ = -1, layers_soft_ = -1, background_layers_ = -1;
};

}  // namespace

const ParameterTable& parameter_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .integer("starts", &Parameters::starts,
                     {.min = 1,
                      .max = kMaxStarts,
                      .help = "inverse warp: surfaces of the tiles around from which the search "
                              "starts, beside the pixel's own"})
            .choice("neighbors", &Parameters::neighbors, {"none", "before", "both"},
                    {.help = "inverse warp: frames that are asked for what is hidden in this one, "
                             "where their planes are there: none, the one before (as an engine "
                             "has), or both"})
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
    if (settings.shutter && settings.shutter->half_open < kLeastHalfOpen) return found;
    for (const Neighbor neighbor : kNeighbors) {
        if (settings.search.neighbors == Neighbors::none) break;
        if (settings.search.neighbors == Neighbors::before && neighbor != Neighbor::before)
            continue;
        bool all = available.has(Role::motion);
        for (const Role role : {Role::color, Role::inverse_depth, Role::motion})
            all = all && available.has(role_of(neighbor, role));
        // What fills color from there fills the layers too, or they would not sum to it.
        if (available.has(Role::layers))
            all = all && available.has(role_of(neighbor, Role::layers));
        if (all) found.push_back(neighbor);
    }
    return found;
}

Promises promises_of(const Settings& settings) {
    Promises promises;
    promises.keeps_constants = true;
    promises.convex = 1e-6;
    // Where the barrel cuts depends on the place in the picture.
    const bool barrel = settings.lens && settings.lens->aperture.cats_eye > 0;
    promises.lattice_px = barrel ? 0 : kBlockPx;
    // Random numbers belong to places. Of surfaces that are displaced equally differently a tile
    // takes the first, so that it has a side.
    if (settings.noise.noise == noise::Kind::none && !barrel)
        promises.symmetries = {Symmetry::shift};
    return promises;
}

// The tiles that can reach a pixel's tile end `ring` tiles from it, and a surface at their edge is
// told from what is up to four pixels around it. Every position of the search lies on a path that
// ends at the pixel; what is hidden there comes from cells up to one and a half tiles around, and
// what is denoised two pixels further. Where tiles choose how many samples they take, a pixel
// depends on what all of its tile do.
Reach reach_of(const Settings& settings, const FrameDescription& frame) {
    // A frame away paths are as long as the motion says.
    if (!searched_neighbors(settings, frame.planes).empty()) return {};
    const double longest = longest_px(settings);
    const double tile = settings.more_samples > 0 ? kBlockPx : 0;
    return {kBlockPx * (ring_of(longest) + 1) + 7.0 + tile, longest + 1.5 * kBlockPx + 7 + tile};
}

void plan_warp(PassPlanner& planner, const Settings& settings) {
    Planner(planner, settings).plan();
}

// The points of the lens are a table that plan() makes: of an aperture, not of a frame.
ShapeNumbers shape_of(const Settings& settings, const PlanContext& context) {
    uint64_t searched = 0;
    for (const Neighbor neighbor : searched_neighbors(settings, context.available))
        searched |= uint64_t(1) << uint64_t(neighbor);
    return {searched, settings.lens ? lens::hash_of(settings.lens->aperture) : 0};
}

void write_values(const Settings& settings, const PlanContext& context, UniformWriter& uniforms) {
    uniforms.set(uniforms_of(settings, context.frame, holds_motion_back(settings, context)));
    noise::write_values(settings.noise, context.frame.frame_number, uniforms);
}

}  // namespace postchain::inverse_warp
