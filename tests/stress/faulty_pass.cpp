#include "tests/stress/faulty_pass.h"

#include "chain/work_list.h"

namespace postchain::stress {
namespace {

int runs = 0;

class FaultyPass : public Pass {
  public:
    FaultyPass(Fault fault, bool reads_motion) : fault_(fault), reads_motion_(reads_motion) {}

    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color};
        if (reads_motion_) use.required.add(Role::motion);
        return use;
    }
    Status check(const FrameDescription&) const override { return Status(); }
    std::optional<LeftOut> identity(const PlanContext&) const override { return {}; }
    void plan(PassPlanner& planner) const override {
        const FrameDescription& frame = planner.context().frame;
        const TextureId result =
            planner.texture("color", Format::rgba32f, frame.width, frame.height);
        Step step;
        step.name = "copy";
        step.program = {"faulty.comp",
                        {{"FAULT", std::to_string(int(fault_))},
                         {"RUN", std::to_string(fault_ == Fault::counts_runs ? ++runs : 0)}}};
        step.bindings = {{0, planner.input(Role::color), Access::sample_nearest},
                         {0, result, Access::write}};
        step.groups = groups_for(frame.width, frame.height);
        planner.step(std::move(step));
        planner.output(Role::color, result);
    }
    void reference(const PlanContext&, ReferenceFrame&) const override {}
    void* parameters() override { return &unused_; }

  private:
    Fault fault_;
    bool reads_motion_;
    char unused_ = 0;
};

}  // namespace

Chain chain_with(Fault fault, bool reads_motion) {
    static const ParameterTable no_parameters;
    // Chains point at their types: these stay.
    static std::vector<std::unique_ptr<PassType>> types;
    auto type = std::make_unique<PassType>();
    type->name = "faulty";
    type->parameters = &no_parameters;
    type->create = [=] { return std::make_unique<FaultyPass>(fault, reads_motion); };
    Chain chain;
    chain.links.push_back({type.get(), type->create()});
    types.push_back(std::move(type));
    return chain;
}

}  // namespace postchain::stress
