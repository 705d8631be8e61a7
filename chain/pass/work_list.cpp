#include "chain/pass/work_list.h"

namespace postchain {

std::array<int, 3> groups_for(int width, int height) {
    return {(width + kBlockPx - 1) / kBlockPx, (height + kBlockPx - 1) / kBlockPx, 1};
}

TextureId add_work_list(PassPlanner& planner, Step& step, int unit, const std::string& name,
                        const Area& pixels) {
    const TextureId list = planner.texture(name, Format::work_list, groups_for(pixels));
    step.bindings.push_back({unit, list, Access::list});
    return list;
}

void launch_by(Step& step, TextureId list) {
    step.program.defines["LIST"] = list < 0 ? "0" : "1";
    step.work_list = list;
    if (list >= 0) step.bindings.push_back({0, list, Access::list});
}

void elide_blocks(PassPlanner& planner, const std::string& item, const std::string& rule, Fact why,
                  TextureId list, int taps_px, bool outside) {
    Elision elision;
    elision.kind = ElisionKind::blocks;
    elision.item = item;
    elision.rule = rule;
    elision.fact = std::move(why);
    elision.work_list = list;
    elision.outside = outside;
    elision.taps_per_block = uint64_t(kBlockPx) * kBlockPx * uint64_t(taps_px);
    planner.elide(std::move(elision));
}

}  // namespace postchain
