#include "passes/fxaa/fxaa.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "chain/pass/pass.h"
#include "chain/pass/work_list.h"
#include "passes/common/keep.h"
#include "passes/common/wide_color.h"
#include "passes/fxaa/reference.h"
#include "shaders/shared/fxaa_uniforms.h"

namespace postchain::fxaa {
namespace {

struct Preset {
    int number;
    std::vector<double> steps;  // increments, pixels
};

const std::vector<Preset>& preset_table() {
    static const std::vector<Preset> table = {
        {10, {1.5, 3, 12}},
        {11, {1, 1.5, 3, 12}},
        {12, {1, 1.5, 2, 4, 12}},
        {13, {1, 1.5, 2, 2, 4, 12}},
        {14, {1, 1.5, 2, 2, 2, 4, 12}},
        {15, {1, 1.5, 2, 2, 2, 2, 4, 12}},
        {20, {1.5, 2, 8}},
        {21, {1, 1.5, 2, 8}},
        {22, {1, 1.5, 2, 2, 8}},
        {23, {1, 1.5, 2, 2, 2, 8}},
        {24, {1, 1.5, 2, 2, 2, 3, 8}},
        {25, {1, 1.5, 2, 2, 2, 2, 4, 8}},
        {26, {1, 1.5, 2, 2, 2, 2, 2, 4, 8}},
        {27, {1, 1.5, 2, 2, 2, 2, 2, 2, 4, 8}},
        {28, {1, 1.5, 2, 2, 2, 2, 2, 2, 2, 4, 8}},
        {29, {1, 1.5, 2, 2, 2, 2, 2, 2, 2, 2, 4, 8}},
        {39, {1, 1, 1, 1, 1, 1.5, 2, 2, 2, 2, 4, 8}},
    };
    return table;
}

const ParameterTable& parameter_table() {
    static const ParameterTable table =
        ParameterTableBuilder<Parameters>()
            .choice("mode", &Parameters::mode, {"search", "directional"},
                    {.help = "FXAA 3.11's search for the ends of an edge, or a Gaussian along the "
                             "edge"})
            .integer("preset", &Parameters::preset,
                     {.min = 10,
                      .max = 39,
                      .allowed = presets(),
                      .help = "steps along an edge, 10-15 dithered, 20-29 less so, 39 longest",
                      .read_if = {{{"mode", {"search"}}}}})
            .number("subpix", &Parameters::subpix,
                    {.min = 0,
                     .max = 1,
                     .help = "strength of the sub-pixel offset; 0 = edges only",
                     .read_if = {{{"mode", {"search"}}}, {{"hint", {"checkerboard"}}}}})
            .number("edge_threshold", &Parameters::edge_threshold,
                    {.min = 0,
                     .max = 1,
                     .soft_max = 0.5,
                     .help = "least local contrast, as a part of the local maximum of luma",
                     .unset_means = "0.166; in mode: directional 0.063",
                     .read_if = {{{"where", {"everywhere"}}}, {{"hint", {"threshold"}, true}}}})
            .number("edge_threshold_min", &Parameters::edge_threshold_min,
                    {.min = 0,
                     .max = 1,
                     .soft_max = 0.3,
                     .help = "least local contrast, in luma",
                     .unset_means = "0.0833; in mode: directional 0.0312",
                     .read_if = {{{"where", {"everywhere"}}}, {{"hint", {"threshold"}, true}}}})
            .choice("luma", &Parameters::luma, {"stored", "display"},
                    {.help = "luma of the stored values (display-referred input), or after "
                             "exposure, tone mapping and a square root (scene-linear input)"})
            .number("exposure_ev", &Parameters::exposure_ev,
                    {.min = -32,
                     .max = 32,
                     .soft_min = -4,
                     .soft_max = 4,
                     .unit = "stops",
                     .help = "exposure before tone mapping",
                     .read_if = {{{"luma", {"display"}}}, {{"blend", {"tonemapped"}}}}})
            .choice("blend", &Parameters::blend, {"tonemapped", "stored"},
                    {.help = "mixing of texels: brighter texels count less, so that fireflies do "
                             "not spread, or as stored"})
            .choice("hint", &Parameters::hint, {"none", "checkerboard", "threshold"},
                    {.help = "effect of an earlier motion blur's hint: none, the report's "
                             "checkerboard, or both thresholds 0"})
            .choice("hint_gate", &Parameters::hint_gate, {"tile", "pixel"},
                    {.help = "pixels where the hint holds: tiles with motion, or pixels that "
                             "really blur",
                     .read_if = {{{"hint", {"none"}, true}}, {{"where", {"blurred"}}}}})
            .choice("where", &Parameters::where, {"everywhere", "blurred"},
                    {.help = "every pixel, for frames of one sample a pixel, or only those in "
                             "which an earlier blur leaves noise, for antialiased frames"})
            .table();
    return table;
}

// Luma is computed in fp32, with a relative error of at most this.
constexpr double kLumaRounding = 1e-5;

struct LumaBounds {
    double lowest, highest;
};

// Bounds of the luma of every pixel of a frame, from the bounds of each channel (luma.glsl has the
// formulas). For `display` x_c/(1 + max(x)) is bounded with the maximum's own bounds. Without its
// transparency.
LumaBounds luma_bounds(const Parameters& parameters, const FrameBounds& bounds,
                       const std::array<double, 3>& weights) {
    constexpr double kUnknown = FrameBounds::kUnknown;
    constexpr double kMaxLuma = 1e30;  // luma.glsl clamps to it
    const double exposure = std::exp2(parameters.exposure_ev);
    std::array<double, 3> low, high;
    for (size_t c = 0; c < 3; ++c) {
        if (!std::isfinite(bounds.min_color[c]) || !std::isfinite(bounds.max_color[c]) ||
            weights[c] < 0)
            return {-kUnknown, kUnknown};
        low[c] = std::clamp(bounds.min_color[c], -kMaxLuma, kMaxLuma);
        high[c] = std::clamp(bounds.max_color[c], -kMaxLuma, kMaxLuma);
        if (parameters.luma == Luma::stored) continue;
        low[c] = std::clamp(low[c] * exposure, 0.0, kMaxLuma);
        high[c] = std::clamp(high[c] * exposure, 0.0, kMaxLuma);
    }
    LumaBounds luma{0, 0};
    const double low_max = *std::max_element(low.begin(), low.end());
    const double high_max = *std::max_element(high.begin(), high.end());
    for (size_t c = 0; c < 3; ++c) {
        if (parameters.luma == Luma::display) {
            low[c] = std::sqrt(low[c] / (1 + high_max));
            high[c] = std::sqrt(high[c] / (1 + std::max(low_max, high[c])));
        }
        luma.lowest += weights[c] * low[c];
        luma.highest += weights[c] * high[c];
    }
    return luma;
}

// alpha, as the luma counts it
double covered(double alpha) {
    return std::clamp(alpha, 0.0, 1.0);
}

class FxaaPass final : public PlainPass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        if (reads_hint()) use.optional = {Role::hint};
        return use;
    }

    Guarantees guarantees() const override {
        Guarantees guarantees;
        guarantees.keeps_constants = true;
        guarantees.convex = 1e-6;
        if (parameters_.blend == Blend::tonemapped) guarantees.light = Light::not_more;
        guarantees.lattice_px = 1;
        guarantees.symmetries = {Symmetry::mirror, Symmetry::shift};
        // The checkerboard always blends with the pixel above.
        if (parameters_.hint != Hint::checkerboard) {
            guarantees.symmetries.insert(Symmetry::flip);
            guarantees.symmetries.insert(Symmetry::turn);
        }
        if (thresholds(parameters_).least >= 2 * kQuietContrast) {
            guarantees.driven_by = {Role::color};
            if (reads_hint()) guarantees.driven_by.add(Role::hint);
        }
        return guarantees;
    }

    // The lumas along an edge, which the last step of a walk does not read. Directional: lumas up
    // to two pixels away.
    Reach reach() const override {
        if (parameters_.mode == Mode::directional) return {2, 1};
        const std::vector<double>& steps = preset_steps(parameters_.preset);
        return {std::ceil(std::accumulate(steps.begin(), steps.end() - 1, 0.0)), 1};
    }

    // No setting of the parameters is the identity by itself: thresholds of 1 still let full
    // contrast (0 beside the maximum) through, and subpix 0 still moves along edges.
    std::optional<Identity> identity(const PlanContext& context) const override {
        const FrameBounds& bounds = context.frame.bounds;
        if (context.frame.width == 1 && context.frame.height == 1)
            return Identity{kRuleFacts, {"a single pixel has no neighbor to blend with"}};
        if (parameters_.where == Where::blurred && !uses_hint(context))
            return Identity{kRuleFacts,
                            {"where: blurred, and no motion blur or joint blur ran before it"}};
        if (!context.color_is_input) return std::nullopt;
        // The checkerboard blends at any luma, and layers may have more colors.
        const bool blends = uses_hint(context) && context.frame.layers > 0;
        if (bounds.one_color && !blends) return Identity{kRuleFacts, {"all pixels have one color"}};
        // A hint lowers the thresholds, or blends at any luma.
        if (uses_hint(context)) return std::nullopt;
        const LumaBounds luma = luma_bounds(parameters_, bounds, weights_of(context.frame));
        const double range = luma.highest - luma.lowest + covered(bounds.max_color[3]) -
                             covered(bounds.min_color[3]);
        const Thresholds least = thresholds(parameters_);
        const double threshold = std::max(least.least, least.relative * luma.lowest);
        const double rounding =
            kLumaRounding * std::max({std::abs(luma.lowest), std::abs(luma.highest),
                                      1 - covered(bounds.min_color[3])});
        if (!(range + rounding < threshold * (1 - kLumaRounding))) return std::nullopt;
        return Identity{kRuleFacts,
                        {.name = "largest difference of luma",
                         .value = range,
                         .limit = threshold,
                         .relation = Fact::Relation::below}};
    }

    void plan(PassPlanner& planner) const override {
        const PlanContext& context = planner.context();
        const uint64_t pixels = uint64_t(context.frame.width) * uint64_t(context.frame.height);
        const bool hinted = uses_hint(context);
        const TextureId color = planner.input(Role::color);
        const bool directional = parameters_.mode == Mode::directional;
        const bool own_luma = !has_luma_plane(context);
        const TextureId luma = own_luma ? -1 : add_luma(planner, color);
        const TextureId result = planner.texture("fxaa", context.color_format());
        TextureId layers = -1;
        if (planner.has(Role::layers)) layers = planner.layers("layers", context.layers_format());

        Step step;
        step.name = "fxaa";
        step.program.file = "fxaa/fxaa.comp";
        step.program.defines = {
            {"DIRECTIONAL", flag(directional)},
            {"LUMA_PLANE", flag(!own_luma)},
            {"BLEND_TONEMAPPED", std::to_string(parameters_.blend == Blend::tonemapped)},
            {"HINT", std::to_string(hinted ? static_cast<int>(parameters_.hint) : 0)},
            {"BLURRED", parameters_.where == Where::everywhere ? "0"
                        : hinted                               ? "1"
                                                               : "2"}};
        context.choose_form(step.program);
        if (own_luma)
            step.program.defines["LUMA_DISPLAY"] = flag(parameters_.luma == Luma::display);
        step.bindings = {{0, color, Access::sample_nearest}, {0, result, Access::write}};
        if (!own_luma) step.bindings.push_back({1, luma, Access::sample_nearest});
        if (hinted) step.bindings.push_back({2, planner.input(Role::hint), Access::sample_nearest});
        step.take_uniforms<shared::FxaaUniforms>();
        // Fetches of a pixel at an edge, without the walk along it.
        const int lumas = own_luma ? 2 : directional ? 13 : 9;
        const int colors = mixed_colors(hinted);
        const int taps_px = lumas + colors + (hinted ? 1 : 0);
        step.taps = pixels * uint64_t(taps_px);
        step.group_taps = uint64_t(kBlockPx * kBlockPx) * uint64_t(taps_px);
        const Blocks blocks = add_blocks(planner);
        launch_by(step, blocks.filtered);
        std::vector<Binding> arrays;
        if (layers >= 0) arrays = {{3, planner.input(Role::layers)}, {1, layers, Access::write}};
        add_layered_step(planner, std::move(step), arrays, pixels * uint64_t(colors));
        if (blocks.kept >= 0) {
            elide_blocks(planner, "fxaa", kRuleUnhintedBlocks, {"no pixel of theirs has a hint"},
                         blocks.kept, taps_px);
            add_keep(planner, blocks.kept, {.color = result, .layers = layers});
        }
        if (layers >= 0) planner.output(Role::layers, layers);
        planner.output(Role::color, result);
    }

    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override {
        uniforms.set(make_uniforms(context.frame));
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        const ImageD color = wide_color(frame);
        const ImageD luma = reference_luma(parameters_, color, context.frame.luma_weights);
        const ImageD* hint = uses_hint(context) ? &frame.planes.at(Role::hint) : nullptr;
        set_wide_color(frame, reference_fxaa(parameters_, color, luma, hint));
        if (has_luma_plane(context)) frame.stages["luma"] = luma;
        frame.stages["fxaa"] = frame.planes.at(Role::color);
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    // Work lists; -1: all blocks are filtered.
    struct Blocks {
        TextureId filtered = -1, kept = -1;
    };

    Blocks add_blocks(PassPlanner& planner) const {
        Blocks blocks;
        if (parameters_.where != Where::blurred || !uses_hint(planner.context()) ||
            !planner.context().uses(kRuleUnhintedBlocks))
            return blocks;
        Step step;
        step.name = "blocks";
        step.program = {"fxaa/blocks.comp", {{"HINT", "0"}, {"BLURRED", "1"}}};
        step.bindings = {{2, planner.input(Role::hint), Access::sample_nearest}};
        blocks.filtered = add_work_list(planner, step, 0, "filtered_blocks");
        blocks.kept = add_work_list(planner, step, 1, "kept_blocks");
        step.take_uniforms<shared::FxaaUniforms>();
        step.spread = Area().in_squares(4 * kBlockPx);  // a work group sorts 4 x 4 blocks
        step.taps = planner.context().frame.pixels();
        planner.step(std::move(step));
        return blocks;
    }

    bool reads_hint() const {
        return parameters_.hint != Hint::none || parameters_.where == Where::blurred;
    }

    bool uses_hint(const PlanContext& context) const {
        return reads_hint() && context.available.has(Role::hint);
    }

    // Without it a work group of a GPU computes the lumas of its pixels and of two around. A walk
    // along an edge goes farther.
    bool has_luma_plane(const PlanContext& context) const {
        return parameters_.mode != Mode::directional || context.device != DeviceClass::gpu;
    }

    TextureId add_luma(PassPlanner& planner, TextureId color) const {
        const TextureId luma = planner.texture("luma", Format::r32f);
        Step step;
        step.name = "luma";
        step.program = {"fxaa/luma.comp",
                        {{"LUMA_DISPLAY", flag(parameters_.luma == Luma::display)}}};
        step.bindings = {{0, color, Access::sample_nearest}, {0, luma, Access::write}};
        step.take_uniforms<shared::FxaaUniforms>();
        step.taps = planner.context().frame.pixels();
        planner.step(std::move(step));
        return luma;
    }

    // Colors that a pixel's result mixes, at most: its own and that across the edge, with the
    // checkerboard also the one above; or 3x3.
    int mixed_colors(bool hinted) const {
        if (parameters_.mode == Mode::directional) return 9;
        return hinted && parameters_.hint == Hint::checkerboard ? 3 : 2;
    }

    std::array<double, 3> weights_of(const FrameDescription& frame) const {
        if (parameters_.luma == Luma::stored) return {0.299, 0.587, 0.114};
        return frame.luma_weights;
    }

    shared::FxaaUniforms make_uniforms(const FrameDescription& frame) const {
        shared::FxaaUniforms uniforms{};
        uniforms.size = {frame.width, frame.height};
        uniforms.exposure = static_cast<float>(std::exp2(parameters_.exposure_ev));
        uniforms.subpix = static_cast<float>(parameters_.subpix);
        uniforms.edge_threshold = static_cast<float>(thresholds(parameters_).relative);
        uniforms.edge_threshold_min = static_cast<float>(thresholds(parameters_).least);
        uniforms.hint_gate = parameters_.hint_gate == HintGate::pixel ? 1 : 0;
        const std::array<double, 3> weights = weights_of(frame);
        for (int i = 0; i < 3; ++i)
            uniforms.luma_weights[i] = static_cast<float>(weights[static_cast<size_t>(i)]);
        double distance_px = 0;
        for (const double step_px : preset_steps(parameters_.preset)) {
            distance_px += step_px;
            const int i = uniforms.walk_length++;
            uniforms.walk[i / 4][i % 4] = static_cast<int>(2 * distance_px);
        }
        return uniforms;
    }

    Parameters parameters_;
};

}  // namespace

Thresholds thresholds(const Parameters& parameters) {
    const bool search = parameters.mode == Mode::search;
    return {parameters.edge_threshold.value_or(search ? 0.166 : 0.063),
            parameters.edge_threshold_min.value_or(search ? 0.0833 : 0.0312)};
}

std::vector<int64_t> presets() {
    std::vector<int64_t> numbers;
    for (const Preset& preset : preset_table()) numbers.push_back(preset.number);
    return numbers;
}

const std::vector<double>& preset_steps(int preset) {
    static const std::vector<double> none;
    for (const Preset& row : preset_table())
        if (row.number == preset) return row.steps;
    return none;
}

const PassType& pass_type() {
    static const PassType type = {
        .name = "fxaa",
        .title = "FXAA",
        .help =
            "Smooths jagged edges of the finished image: FXAA 3.11, quality path, or a filter "
            "along edges.",
        .parameters = &parameter_table(),
        .create = [] { return std::make_unique<FxaaPass>(); },
        .rules = {{kRuleUnhintedBlocks, true,
                   "FXAA of blocks without a hint, with where: blurred"}},
        .variants = {
            {"without the checkerboard", {{"hint", "none"}}},
            {"blend: stored", {{"blend", "stored"}}},
            {"mode: directional", {{"mode", "directional"}, {"hint", "none"}}},
            {"mode: directional, blend: stored", {{"mode", "directional"}, {"blend", "stored"}}}}};
    return type;
}

}  // namespace postchain::fxaa
