#include "tests/passes/vignette/vignette.h"

#include "chain/pass/pass.h"
#include "chain/pass/work_list.h"
#include "passes/common/wide_color.h"
#include "tests/passes/shaders/shared/vignette_uniforms.h"

namespace postchain::vignette {
namespace {

struct Parameters {
    double strength = 0.5;
    bool alpha = false;
};

const ParameterTable& table() {
    static const ParameterTable rows =
        ParameterTableBuilder<Parameters>()
            .number("strength", &Parameters::strength,
                    {.min = 0, .max = 1, .help = "light that the corners lose; 0 = off"})
            .boolean("alpha", &Parameters::alpha, {.help = "darken alpha too"})
            .table();
    return rows;
}

class Vignette final : public PlainPass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        return use;
    }

    Guarantees guarantees() const override {
        Guarantees guarantees;
        guarantees.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn};
        guarantees.light = Light::not_more;
        return guarantees;
    }

    Reach reach() const override { return {0, 0}; }

    std::optional<Identity> identity(const PlanContext&) const override {
        if (parameters_.strength > 0) return std::nullopt;
        return Identity{kRuleConfiguration, {.name = "strength", .value = 0}};
    }

    void plan(PassPlanner& planner) const override {
        const PlanContext& context = planner.context();
        const uint64_t pixels = context.frame.pixels();
        const TextureId darkened = planner.texture("color", context.color_format());
        Step step;
        step.name = "vignette";
        step.program = {"vignette/vignette.comp", {}};
        step.bindings = {{0, planner.input(Role::color)}, {0, darkened, Access::write}};
        step.take_uniforms<shared::VignetteUniforms>();
        step.taps = pixels;
        std::vector<Binding> arrays;
        if (planner.has(Role::layers)) {
            const TextureId layers = planner.layers("layers", context.layers_format());
            arrays = {{1, planner.input(Role::layers)}, {1, layers, Access::write}};
            planner.output(Role::layers, layers);
        }
        add_layered_step(planner, std::move(step), arrays, pixels);
        planner.output(Role::color, darkened);
    }

    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override {
        shared::VignetteUniforms values{};
        values.size = {context.frame.width, context.frame.height};
        values.strength = float(parameters_.strength);
        values.alpha = parameters_.alpha;
        uniforms.set(values);
    }

    void reference(const PlanContext&, ReferenceFrame& frame) const override {
        ImageD color = wide_color(frame);
        const double corner =
            double(color.width) * color.width + double(color.height) * color.height;
        for (int y = 0; y < color.height; ++y) {
            for (int x = 0; x < color.width; ++x) {
                const double dx = 2 * x + 1 - color.width, dy = 2 * y + 1 - color.height;
                const double kept = 1 - parameters_.strength * (dx * dx + dy * dy) / corner;
                for (int c = 0; c < color.channels; ++c)
                    if (parameters_.alpha || c % 4 < 3) color.at(x, y, c) *= kept;
            }
        }
        set_wide_color(frame, color);
        frame.stages["color"] = frame.planes.at(Role::color);
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type{.name = "vignette",
                               .title = "Vignette",
                               .help = "Darkens the corners.",
                               .parameters = &table(),
                               .create = [] { return std::make_unique<Vignette>(); }};
    return type;
}

}  // namespace postchain::vignette
