// Two plans with work lists in one (chain/merge.h): both results as if run alone.
#include "chain/merge.h"

#include "tests/elision/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

// config/chains/paper.yaml and dof_first.yaml.
Chain shipped(bool dof_first) {
    Chain chain;
    const auto blur = [&] {
        append(chain, "motion_blur",
               {{"mode", "guertin"}, {"samples", int64_t(25)}, {"max_blur_px", int64_t(40)}});
    };
    const auto fxaa = [&] {
        append(chain, "fxaa", {{"hint", "checkerboard"s}, {"hint_gate", "tile"s}});
    };
    if (dof_first) append(chain, "depth_of_field", {{"method", "gilham"}});
    blur();
    fxaa();
    if (!dof_first) append(chain, "depth_of_field", {{"method", "gilham"}});
    return chain;
}

// A mover, ground out of focus, sky: every kind of block.
FramePlanes mixed_planes(int width, int height, bool still, bool focused) {
    FramePlanes planes;
    planes[Role::color] = half_noise(width, height, 4, 77);
    planes[Role::inverse_depth] = ImageF(width, height, 1);
    planes[Role::motion] = ImageF(width, height, 2);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool mover = x > 20 && x < 40 && y > height / 2 && y < height / 2 + 25;
            float& w = planes[Role::inverse_depth].at(x, y);
            w = focused ? 0.1f : y < height / 3 ? 0 : mover ? 0.1f : x < width / 2 ? 0.1f : 0.8f;
            if (mover && !still) {
                planes[Role::motion].at(x, y, 0) = 19;
                planes[Role::motion].at(x, y, 1) = -7;
            }
        }
    return planes;
}

TEST(MergeOfElidedPlans, EqualsTheTwoRunsAlone) {
    int shared = 0;
    for (const bool facts : {true, false})
        for (const bool still : {false, true})
            for (const bool focused : {false, true}) {
                const Precision precision = still ? Precision::fp16 : Precision::fp32;
                const FramePlanes planes = mixed_planes(101, 83, still, focused);
                FrameDescription frame = describe(planes);
                frame.camera.f_stop = 0.3;
                if (!facts) frame.bounds = FrameBounds();
                PlanOptions elided{.precision = precision};
                for (const bool swapped : {false, true}) {
                    SCOPED_TRACE(concat(name_of(precision), facts ? " facts" : "",
                                        still ? " still" : "", focused ? " focused" : "",
                                        swapped ? " swapped" : ""));
                    const Chain a = shipped(swapped), b = shipped(!swapped);
                    const auto plan_a = make_plan(a, frame, elided),
                               plan_b = make_plan(b, frame, elided);
                    ASSERT_TRUE(plan_a.ok() && plan_b.ok());
                    const MergedPlan merged = merge_plans(*plan_a, *plan_b);
                    shared += merged.shared_steps;
                    const auto both = executor().filter_both(merged, planes);
                    ASSERT_TRUE(both.ok()) << both.status().message();
                    const FramePlanes alone_a = filter(a, frame, planes, no_rule(precision));
                    const FramePlanes alone_b = filter(b, frame, planes, no_rule(precision));
                    EXPECT_EQ(first_difference(alone_a.at(Role::color), (*both)[0].at(Role::color)),
                              "");
                    EXPECT_EQ(first_difference(alone_b.at(Role::color), (*both)[1].at(Role::color)),
                              "");
                    if (!still || !facts) {
                        // Tiles and blocks depend on motion alone, circles on depth alone.
                        const auto names = [](const Step& step) { return step.name; };
                        int classify = 0;
                        for (const Step& step : merged.plan.steps)
                            classify += names(step) == "classify";
                        EXPECT_EQ(classify, 1);
                    }
                }
            }
    EXPECT_GT(shared, 50);
}

}  // namespace
}  // namespace postchain::test
