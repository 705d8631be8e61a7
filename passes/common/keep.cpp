#include "passes/common/keep.h"

#include "chain/pass/pass.h"
#include "chain/pass/work_list.h"
#include "shaders/shared/frame_uniforms.h"

namespace postchain {

void add_keep(PassPlanner& planner, TextureId list, const KeepTargets& kept) {
    Step step;
    step.name = "keep";
    step.program = {"common/keep.comp",
                    {{"HINT", kept.hint < 0 ? "0" : (kept.given_hint < 0 ? "1" : "2")},
                     {"SOFT", kept.soft < 0 ? "0" : "1"}}};
    step.bindings = {{0, planner.input(Role::color)}, {0, kept.color, Access::write}};
    if (kept.given_hint >= 0) step.bindings.push_back({1, kept.given_hint});
    if (kept.hint >= 0) step.bindings.push_back({1, kept.hint, Access::write});
    if (kept.soft >= 0) step.bindings.push_back({2, kept.soft, Access::write});
    step.take_uniforms<shared::FrameUniforms>();
    launch_by(step, list);
    std::vector<Binding> arrays;
    if (kept.layers >= 0)
        arrays = {{2, planner.input(Role::layers)}, {3, kept.layers, Access::write}};
    add_layered_step(planner, std::move(step), arrays, 0);
}

}  // namespace postchain
