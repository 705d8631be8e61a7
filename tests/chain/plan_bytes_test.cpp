// Bytes that a plan moves, counted by hand.
#include "chain/plan/plan_bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace postchain::test {
namespace {

class PlanBytes : public ::testing::Test {
  protected:
    PlanBytes() {
        plan.width = 64;
        plan.height = 32;
        plan.passes = {{"first", "", false}, {"second", "", false}};
    }
    TextureId texture(Format format, int width = 64, int height = 32) {
        PlanTexture made;
        made.format = format;
        made.width = width;
        made.height = height;
        plan.textures.push_back(made);
        return TextureId(plan.textures.size()) - 1;
    }
    void step(int pass, std::vector<Binding> bindings, TextureId list = -1) {
        Step made;
        made.pass = pass;
        made.bindings = std::move(bindings);
        if (list >= 0) made.bindings.push_back({0, list, Access::list});
        made.work_list = list;
        plan.steps.push_back(made);
    }

    Plan plan;
};

TEST_F(PlanBytes, ATextureCountsOnceForEachStepThatReadsOrWritesIt) {
    const TextureId color = texture(Format::rgba32f), luma = texture(Format::r32f),
                    small = texture(Format::rgba16f, 16, 8), result = texture(Format::rgba16f);
    step(0, {{0, color}, {0, luma, Access::write}});
    // The same texture at two units is one.
    step(1, {{0, color}, {1, luma}, {2, color}, {0, small, Access::write}});
    step(1, {{0, small}, {1, color}, {0, result, Access::write}});

    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    const uint64_t pixels = 64 * 32;
    EXPECT_EQ(bytes[0].read, 16 * pixels);
    EXPECT_EQ(bytes[0].written, 4 * pixels);
    EXPECT_EQ(bytes[1].read, 20 * pixels);
    EXPECT_EQ(bytes[1].written, 8 * pixels / 16);
    EXPECT_DOUBLE_EQ(bytes_per_pixel(plan, 0), 20);
    EXPECT_DOUBLE_EQ(bytes_per_pixel(plan, 1), 20 + 0.5 + 0.5 + 16 + 8);
    EXPECT_DOUBLE_EQ(bytes_per_pixel(plan), 65);
}

TEST_F(PlanBytes, TheLayersOfAStepCount) {
    const TextureId layers = texture(Format::rgba32f), result = texture(Format::r32f);
    plan.textures[size_t(layers)].slices = 6;
    step(0, {{0, layers}, {0, result, Access::write}});
    step(0, {{0, layers}, {0, result, Access::write}});
    plan.steps[1].layers = 2;
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    EXPECT_EQ(bytes[0].read, uint64_t(6 * 16 * 64 * 32));
    EXPECT_EQ(bytes[1].read, uint64_t(2 * 16 * 64 * 32));
    EXPECT_EQ(bytes[1].written, uint64_t(4 * 64 * 32));
}

TEST_F(PlanBytes, ABlockCountsForTheListThatMovesMost) {
    const TextureId color = texture(Format::rgba32f), depth = texture(Format::r32f),
                    result = texture(Format::rgba32f);
    // 8 blocks: 16 bytes of header and 4 for each.
    const TextureId still = texture(Format::work_list, 8, 1),
                    full = texture(Format::work_list, 8, 1), sky = texture(Format::work_list, 8, 1);
    step(0,
         {{0, depth}, {0, sky, Access::list}, {1, full, Access::list}, {2, still, Access::list}});
    step(0, {{0, color}, {0, result, Access::write}}, still);
    step(0, {{0, color}, {1, depth}, {0, result, Access::write}}, full);
    step(0, {{0, result, Access::write}}, sky);

    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    const double list = 48.0 / (64 * 32);
    EXPECT_TRUE(bytes[0].counts);
    EXPECT_FALSE(bytes[1].counts);
    EXPECT_TRUE(bytes[2].counts);
    EXPECT_FALSE(bytes[3].counts);
    EXPECT_EQ(bytes[1].moved(), 0u);
    EXPECT_DOUBLE_EQ(bytes_per_pixel(plan), 4 + 3 * list + 36 + list);
}

// In whichever order the lists are bound.
TEST_F(PlanBytes, ABlockCountsOnceInEveryOrder) {
    std::array<int, 3> order = {0, 1, 2};
    do {
        plan.steps.clear();
        plan.textures.clear();
        std::array<TextureId, 3> lists, results;
        for (TextureId& list : lists) list = texture(Format::work_list, 8, 1);
        for (const size_t i : {0u, 1u, 2u})
            results[i] = texture(std::array{Format::r8, Format::r32f, Format::rgba32f}[i]);
        step(0, {{0, lists[size_t(order[0])], Access::list},
                 {1, lists[size_t(order[1])], Access::list},
                 {2, lists[size_t(order[2])], Access::list}});
        for (const size_t i : {0u, 1u, 2u}) step(0, {{0, results[i], Access::write}}, lists[i]);
        const std::vector<StepBytes> bytes = bytes_of_steps(plan);
        for (const size_t i : {0u, 1u, 2u}) EXPECT_EQ(bytes[i + 1].counts, i == 2) << order[0];
    } while (std::ranges::next_permutation(order).found);
}

// A step that is launched by a list and fills another one.
TEST_F(PlanBytes, AListIsNotOneOfThoseThatItsStepFills) {
    const TextureId first = texture(Format::work_list, 8, 1),
                    then = texture(Format::work_list, 8, 1), small = texture(Format::r8),
                    result = texture(Format::rgba32f);
    for (const auto& [of_first, of_then] : {std::pair(small, result), {result, small}}) {
        plan.steps.clear();
        step(0, {{0, first, Access::list}});
        step(0, {{0, of_first, Access::write}, {1, then, Access::list}}, first);
        step(0, {{0, of_then, Access::write}}, then);
        for (const StepBytes& bytes : bytes_of_steps(plan)) EXPECT_TRUE(bytes.counts);
    }
}

TEST_F(PlanBytes, StepsOfOneListCountTogether) {
    const TextureId color = texture(Format::rgba32f), between = texture(Format::rgba32f),
                    result = texture(Format::rgba32f);
    const TextureId moving = texture(Format::work_list, 8, 1),
                    still = texture(Format::work_list, 8, 1);
    step(0, {{0, still, Access::list}, {1, moving, Access::list}});
    step(0, {{0, color}, {0, result, Access::write}}, still);
    step(0, {{0, color}, {0, between, Access::write}}, moving);
    step(1, {{0, between}, {0, result, Access::write}}, moving);
    EXPECT_EQ(bytes_of_steps(plan)[1].moved(), 0u);
    EXPECT_NEAR(bytes_per_pixel(plan), 64, 0.1);
}

}  // namespace
}  // namespace postchain::test
