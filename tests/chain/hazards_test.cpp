// Barriers of a plan as data: a software renderer shows none that is missing.
#include "chain/hazards.h"

#include <gtest/gtest.h>

#include "chain/planner.h"
#include "passes/registry.h"

namespace postchain {
namespace {

// a -> b -> c by steps that read one texture and write another, given as {read, written}.
Plan chain_of(std::initializer_list<std::pair<int, int>> steps, int textures) {
    Plan plan;
    plan.textures.resize(size_t(textures));
    for (const auto& [from, to] : steps) {
        Step step;
        step.bindings = {{0, from}, {0, to, Access::write}};
        plan.steps.push_back(step);
    }
    return plan;
}

TEST(Hazards, AFetchWaitsForWhatWasWrittenAndNothingElseDoes) {
    // 0 -> 1, 0 -> 2, 1 -> 3, 2 -> 4: the third waits for the first, which lets the fourth go on.
    const Plan plan = chain_of({{0, 1}, {0, 2}, {1, 3}, {2, 4}}, 5);
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 3, 4}), (std::vector<uint32_t>{0, 0, kWaitFetch, 0}));
}

TEST(Hazards, StorageThatIsUsedAgainIsWaitedFor) {
    // 3 lies where 1 was, which the second step still reads.
    const Plan plan = chain_of({{0, 1}, {1, 2}, {2, 3}}, 4);
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 1}),
              (std::vector<uint32_t>{0, kWaitFetch, kWaitFetch | kWaitImage}));
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 3}), (std::vector<uint32_t>{0, kWaitFetch, kWaitFetch}));
}

TEST(Hazards, AReaderIsWaitedForBeforeItsStorageIsWrittenAgain) {
    // The wait of the third step makes the first one's write done with; the fourth reads it, and
    // the fifth writes where it lay.
    const Plan plan = chain_of({{0, 1}, {0, 2}, {0, 3}, {1, 4}, {0, 5}}, 6);
    EXPECT_EQ(waits_of(plan, {0, 1, 2, 2, 4, 1}),
              (std::vector<uint32_t>{0, 0, kWaitImage, kWaitFetch, kWaitImage}));
}

TEST(Hazards, StepsThatWriteOneTextureTogetherDoNotWaitForEachOther) {
    const Plan plan = chain_of({{0, 1}, {0, 1}, {1, 2}}, 3);
    EXPECT_EQ(waits_of(plan, {0, 1, 2}), (std::vector<uint32_t>{0, 0, kWaitFetch}));
}

TEST(Hazards, AListIsWaitedForByItsReadersAndItsLaunch) {
    Plan plan;
    plan.textures.resize(3);
    Step fill;
    fill.bindings = {{0, 0}, {0, 1, Access::list}};
    Step launched;
    launched.bindings = {{0, 1, Access::list}, {0, 2, Access::write}};
    launched.work_list = 1;
    plan.steps = {fill, launched, launched};
    EXPECT_EQ(waits_of(plan, {0, 1, 2}), (std::vector<uint32_t>{0, kWaitList | kWaitLaunch, 0}));
}

// In words of its own: whatever a step uses was made visible since it was written.
void expect_ordered(const Plan& plan) {
    std::vector<int> storage(plan.textures.size());
    for (size_t i = 0; i < storage.size(); ++i) storage[i] = int(i);
    const auto waits = waits_of(plan, storage);
    for (size_t reader = 0; reader < plan.steps.size(); ++reader)
        for (const auto& read : plan.steps[reader].bindings) {
            if (read.access == Access::write) continue;
            const bool list = read.access == Access::list;
            for (size_t writer = 0; writer < reader; ++writer)
                for (const auto& written : plan.steps[writer].bindings) {
                    if (written.texture != read.texture || !plan.steps[writer].writes(written))
                        continue;
                    uint32_t between = 0;
                    for (size_t i = writer + 1; i <= reader; ++i) between |= waits[i];
                    EXPECT_TRUE(between & (list ? kWaitList : kWaitFetch))
                        << plan.steps[writer].name << " -> " << plan.steps[reader].name;
                    if (plan.steps[reader].work_list == read.texture) {
                        EXPECT_TRUE(between & kWaitLaunch) << plan.steps[reader].name;
                    }
                }
        }
}

TEST(Hazards, OfPlansOfTheBuiltInPasses) {
    size_t waiting = 0, steps = 0;
    for (const char* type : {"motion_blur", "fxaa", "depth_of_field", "joint_blur"}) {
        Chain chain;
        chain.append(builtin_passes(), type);
        FrameDescription frame;
        frame.width = frame.display_width = 320;
        frame.height = frame.display_height = 200;
        frame.planes = {Role::color, Role::inverse_depth, Role::motion};
        frame.camera.focal_length_mm = 50;
        frame.camera.sensor_width_mm = 36;
        frame.camera.f_stop = 2;
        frame.camera.focus_distance = 4;
        const auto plan = make_plan(chain, frame);
        ASSERT_TRUE(plan.ok()) << plan.status().message();
        expect_ordered(*plan);
        std::vector<int> storage(plan->textures.size());
        for (size_t i = 0; i < storage.size(); ++i) storage[i] = int(i);
        for (const uint32_t wait : waits_of(*plan, storage)) waiting += wait != 0;
        steps += plan->steps.size();
    }
    EXPECT_GT(waiting, 8u);
    EXPECT_LT(waiting, steps) << "a barrier after every step";
}

}  // namespace
}  // namespace postchain
