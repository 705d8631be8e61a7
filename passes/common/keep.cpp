#include "passes/common/keep.h"

#include "chain/work_list.h"

namespace postchain {

void add_keep(PassPlanner& planner, TextureId list, TextureId kept, TextureId hint) {
    Step step;
    step.name = "keep";
    step.program = {"common/keep.comp", {{"HINT", hint >= 0 ? "1" : "0"}}};
    step.bindings = {{0, planner.input(Role::color)}, {0, kept, Access::write}};
    if (hint >= 0) step.bindings.push_back({1, hint, Access::write});
    const PlanTexture& size = planner.describe(kept);
    step.groups = groups_for(size.width, size.height);
    launch_by(step, list);
    planner.step(std::move(step));
}

}  // namespace postchain
