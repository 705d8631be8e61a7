// Motion blur over a frame made on the spot: the example of docs/library.md.
#include <cstdio>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "chain/pass/planner.h"
#include "passes/registry.h"

using namespace postchain;

int main() {
    auto context = egl::Context::create();
    if (!context.ok()) {
        std::fprintf(stderr, "%s\n", context.status().message().c_str());
        return 1;
    }
    Executor executor((*context)->device());

    // A white square on black, a quarter of a unit in front of a far wall, moving to the right.
    FrameDescription frame;
    frame.width = frame.display_width = 64;
    frame.height = frame.display_height = 48;
    frame.planes = {Role::color, Role::inverse_depth, Role::motion};
    FramePlanes planes;
    planes[Role::color] = ImageF(64, 48, 4);
    planes[Role::inverse_depth] = ImageF(64, 48, 1, 0.1f);
    planes[Role::motion] = ImageF(64, 48, 2);
    for (int y = 16; y < 32; ++y) {
        for (int x = 24; x < 40; ++x) {
            for (int c = 0; c < 4; ++c) planes[Role::color].at(x, y, c) = 1;
            planes[Role::inverse_depth].at(x, y) = 4;
            planes[Role::motion].at(x, y, 0) = 20;  // pixels to the next frame
        }
    }
    frame.bounds.max_speed_px = 20;  // elision depends on it

    Chain chain;
    Pass* blur = chain.append(builtin_passes(), "motion_blur");
    const ParameterTable& table = *builtin_passes().find("motion_blur")->parameters;
    if (!table.set(blur->parameters(), "shutter_frames", 1.0).ok()) return 1;

    auto plan = make_plan(chain, frame);
    if (!plan.ok()) {
        std::fprintf(stderr, "%s\n", plan.status().message().c_str());
        return 1;
    }
    auto result = executor.filter(*plan, planes);
    if (!result.ok()) {
        std::fprintf(stderr, "%s\n", result.status().message().c_str());
        return 1;
    }
    // The square has spread to half a streak's length from its edge, and not upward.
    const ImageF& color = result->at(Role::color);
    std::printf("beside the square %.3f, above it %.3f\n", double(color.at(42, 24)),
                double(color.at(32, 8)));
    return color.at(42, 24) > 0 && color.at(32, 8) == 0 ? 0 : 1;
}
