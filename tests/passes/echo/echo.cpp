#include "tests/passes/echo/echo.h"

#include "chain/pass/pass.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain::echo {
namespace {

enum class Neighbors { none, before, both };

struct Parameters {
    Neighbors neighbors = Neighbors::both;
    bool vectors = false;
};

const ParameterTable& table() {
    static const ParameterTable rows =
        ParameterTableBuilder<Parameters>()
            .choice("neighbors", &Parameters::neighbors, {"none", "before", "both"},
                    {.help = "frames from which this one is set off"})
            .boolean("vectors", &Parameters::vectors, {.help = "add their depth and vectors too"})
            .table();
    return rows;
}

// "COLOR_BEFORE"
std::string macro_of(std::string name) {
    for (char& c : name) c = c == '_' ? c : char(c - 'a' + 'A');
    return name;
}

class Echo final : public PlainPass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        for (Neighbor neighbor : kNeighbors) {
            if (!uses(neighbor)) continue;
            for (Role role : kNeighborRoles)
                if (role == Role::color || role == Role::layers || parameters_.vectors)
                    use.optional.add(role_of(neighbor, role));
        }
        return use;
    }

    Guarantees guarantees() const override {
        Guarantees guarantees;
        guarantees.lattice_px = 1;
        guarantees.symmetries = {Symmetry::shift};
        return guarantees;
    }

    Reach reach() const override { return {0, 0}; }

    std::optional<Identity> identity(const PlanContext&) const override {
        if (parameters_.neighbors != Neighbors::none) return std::nullopt;
        return Identity{kRuleConfiguration, {.name = "neighbors is none"}};
    }

    void plan(PassPlanner& planner) const override {
        const PlanContext& context = planner.context();
        const TextureId mixed = planner.texture("color", context.color_format());
        Step step;
        step.name = "echo";
        step.program = {"echo/echo.comp", {}};
        step.bindings = {{0, planner.input(Role::color)}, {0, mixed, Access::write}};
        step.take_uniforms<shared::FrameUniforms>();
        int unit = 1;
        for (Neighbor neighbor : kNeighbors) {
            if (uses(neighbor)) step.program.defines[macro_of(name_of(neighbor))] = "1";
            for (Role role : kFileRoles) {
                const Role there = role_of(neighbor, role);
                if (roles().optional.has(there) && planner.has(there)) {
                    step.program.defines[macro_of(name_of(there))] = "1";
                    step.bindings.push_back({unit, planner.input(there)});
                }
                ++unit;
            }
        }
        std::vector<Binding> arrays;
        if (planner.has(Role::layers)) {
            const TextureId layers = planner.layers("layers", context.layers_format());
            arrays = {{9, planner.input(Role::layers)}, {1, layers, Access::write}};
            for (Neighbor neighbor : kNeighbors) {
                const Role there = role_of(neighbor, Role::layers);
                if (!uses(neighbor) || !planner.has(there)) continue;
                step.program.defines[macro_of(name_of(there))] = "1";
                arrays.push_back({neighbor == Neighbor::before ? 10 : 11, planner.input(there)});
            }
            planner.output(Role::layers, layers);
        }
        add_layered_step(planner, std::move(step), arrays, 0);
        planner.output(Role::color, mixed);
    }

    void reference(const PlanContext&, ReferenceFrame& frame) const override {
        const ImageD own = frame.planes.at(Role::color);
        ImageD& color = frame.planes.at(Role::color);
        for (Neighbor neighbor : kNeighbors) {
            for (size_t i = 0; i < own.data.size() && uses(neighbor); ++i)
                color.data[i] += 0.25 * own.data[i];
            for (Role role : kFileRoles) {
                const auto found = frame.planes.find(role_of(neighbor, role));
                if (found == frame.planes.end() || !roles().optional.has(found->first)) continue;
                const ImageD& plane = found->second;
                for (int y = 0; y < own.height; ++y) {
                    for (int x = 0; x < own.width; ++x) {
                        for (int c = 0; c < 4 && role == Role::color; ++c)
                            color.at(x, y, c) -= 0.25 * plane.at(x, y, c);
                        if (role == Role::inverse_depth) color.at(x, y, 0) += plane.at(x, y);
                        if (role == Role::motion) color.at(x, y, 1) += plane.at(x, y, 0);
                        if (role == Role::motion_back) color.at(x, y, 2) += plane.at(x, y, 1);
                    }
                }
            }
        }
        frame.stages["color"] = color;
        if (frame.planes.count(Role::layers)) set_off_layers(frame);
    }

    ParameterRef parameters() override { return &parameters_; }

  private:
    void set_off_layers(ReferenceFrame& frame) const {
        const ImageD own = frame.planes.at(Role::layers);
        ImageD& layers = frame.planes.at(Role::layers);
        for (Neighbor neighbor : kNeighbors) {
            if (!uses(neighbor)) continue;
            const auto found = frame.planes.find(role_of(neighbor, Role::layers));
            for (size_t i = 0; i < own.data.size(); ++i) {
                const double other = found == frame.planes.end() ? 0 : found->second.data[i];
                layers.data[i] += 0.25 * (own.data[i] - other);
            }
        }
        frame.stages["layers"] = layers;
    }
    bool uses(Neighbor neighbor) const {
        return parameters_.neighbors == Neighbors::both ||
               (parameters_.neighbors == Neighbors::before && neighbor == Neighbor::before);
    }
    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type{.name = "echo",
                               .title = "Echo",
                               .help = "Sets a frame off from those before and after.",
                               .parameters = &table(),
                               .create = [] { return std::make_unique<Echo>(); }};
    return type;
}

}  // namespace postchain::echo
