#include "chain/same_shape.h"

#include <algorithm>

namespace postchain {
namespace {

bool same_on_all_sizes(const PlanTexture& a, PlanTexture b) {
    b.width = a.width;
    b.height = a.height;
    return a == b;
}

}  // namespace

bool same_shape(const Plan& a, const Plan& b) {
    // The least edge of a tile decides how large textures are (chain/storage.h).
    const auto same_tiles = [](const PlanPass& x, const PlanPass& y) {
        return x.tiles.least_px == y.tiles.least_px;
    };
    if (a.steps.size() != b.steps.size() || a.outputs != b.outputs ||
        !std::equal(a.passes.begin(), a.passes.end(), b.passes.begin(), b.passes.end(),
                    same_tiles) ||
        !std::equal(a.textures.begin(), a.textures.end(), b.textures.begin(), b.textures.end(),
                    same_on_all_sizes))
        return false;
    for (size_t i = 0; i < a.steps.size(); ++i) {
        const Step &x = a.steps[i], &y = b.steps[i];
        if (x.pass != y.pass || x.name != y.name || !(x.program == y.program) ||
            x.bindings != y.bindings || x.uniforms.size() != y.uniforms.size() ||
            x.uniforms_type != y.uniforms_type || x.spread != y.spread ||
            x.groups[2] != y.groups[2] || x.work_list != y.work_list ||
            x.first_layer != y.first_layer)
            return false;
    }
    return true;
}

}  // namespace postchain
