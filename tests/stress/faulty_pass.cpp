#include "tests/stress/faulty_pass.h"

#include "chain/pass/work_list.h"

namespace postchain::stress {
namespace {

int runs = 0;

struct Unused {
    double f_stop = 2;
};

class FaultyPass : public PlainPass {
  public:
    FaultyPass(Fault fault, Light light) : fault_(fault), light_(light) {}

    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        if (fault_ == Fault::takes_depth) use.required.add(Role::inverse_depth);
        return use;
    }
    Guarantees guarantees() const override {
        Guarantees guarantees;
        guarantees.keeps_constants = true;
        guarantees.convex = 1e-6;
        guarantees.lattice_px = 40;  // kTile of faulty.comp
        guarantees.symmetries = {Symmetry::mirror, Symmetry::flip, Symmetry::turn, Symmetry::shift};
        guarantees.light = light_;
        guarantees.driven_by = {Role::motion};
        return guarantees;
    }
    Reach reach() const override { return {1, 1}; }
    std::optional<Identity> identity(const PlanContext&) const override { return {}; }
    void plan(PassPlanner& planner) const override {
        const TextureId result = planner.texture("color", Format::rgba32f);
        Step step;
        step.name = "copy";
        step.program = {"faulty.comp",
                        {{"FAULT", std::to_string(int(fault_))},
                         {"RUN", std::to_string(fault_ == Fault::counts_runs ? ++runs : 0)}}};
        step.bindings = {{0, planner.input(Role::color), Access::sample_nearest},
                         {0, result, Access::write}};
        if (fault_ == Fault::takes_depth)
            step.bindings.push_back(
                {1, planner.input(Role::inverse_depth), Access::sample_nearest});
        planner.step(std::move(step));
        planner.output(Role::color, result);
    }
    void reference(const PlanContext&, ReferenceFrame&) const override {}
    ParameterRef parameters() override { return &unused_; }

  private:
    Fault fault_;
    Light light_;
    Unused unused_;
};

}  // namespace

Chain chain_with(Fault fault, Light light) {
    // A pass with an f-stop has a lens.
    static const ParameterTable parameters =
        ParameterTableBuilder<Unused>().number("f_stop", &Unused::f_stop, {.min = 0}).table();
    // Chains point to their types, so these must persist.
    static std::vector<std::unique_ptr<PassType>> types;
    auto type = std::make_unique<PassType>();
    type->name = "faulty";
    type->parameters = &parameters;
    type->create = [=] { return std::make_unique<FaultyPass>(fault, light); };
    Chain chain;
    chain.links.push_back({type.get(), type->create()});
    types.push_back(std::move(type));
    return chain;
}

}  // namespace postchain::stress
