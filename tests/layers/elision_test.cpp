// Work elided for color is elided for layers, and changes no bit of them either.
#include "tests/elision/support.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

// One of each kind: without rules each has programs of its own, which take long to compile.
const std::vector<Variant>& some_variants() {
    static const std::vector<Variant> all = [] {
        std::vector<Variant> some = one_of_each_kind();
        some.push_back(
            {"hinted",
             {{"motion_blur", {{"mode", "guertin"}}}, {"fxaa", {{"hint", "checkerboard"}}}}});
        return some;
    }();
    return all;
}

TestFrame lit(TestFrame frame) {
    frame.description = describe(frame.planes);
    add_lights(frame, kLayersPerStep);
    return frame;
}

// Blocks: a small part moves and is out of focus, sky beside it.
TEST(Elision, OfBlocksChangesNoBitOfLayers) {
    TestFrame frame = layered_frame(150, 90, {21.0f, 6.0f}, {0, 0}, 3);
    ImageF& depth = frame.planes.at(Role::inverse_depth);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 150; ++x) depth.at(x, y) = 0;
    frame = lit(std::move(frame));
    int lists = 0;
    for (const Variant& one : some_variants()) {
        SCOPED_TRACE(one.name);
        const Elided elided = expect_same_bits(one.chain(), frame.description, frame.planes, {});
        EXPECT_EQ(elided.outputs.count(Role::layers), 1u);
        for (const WorkDone& list : elided.work) lists += list.blocks > 0;
    }
    EXPECT_GE(lists, 10);
}

TEST(Elision, OfPassesLeavesLayersAsTheyAre) {
    TestFrame frame = layered_frame(67, 41, {0, 0}, {0, 0}, 9);
    frame.planes[Role::inverse_depth] = ImageF(67, 41, 1, 0.1f);
    frame = lit(std::move(frame));
    int elided_passes = 0;
    for (const Variant& one : some_variants()) {
        SCOPED_TRACE(one.name);
        const Elided elided = expect_same_bits(one.chain(), frame.description, frame.planes, {});
        if (!elided.plan.steps.empty()) continue;
        ++elided_passes;
        EXPECT_TRUE(equal_bits(elided.outputs.at(Role::layers), frame.planes.at(Role::layers)));
    }
    EXPECT_EQ(elided_passes, 3);  // FXAA has edges, in two of them
}

// One color has no edges, whatever its layers hold: they come back with the sign of each zero. But
// a hint blends them.
TEST(Elision, OfFxaaLeavesLayersOfOneColorAsTheyAre) {
    TestFrame frame;
    frame.planes[Role::color] = constant_image(37, 33, {0.5f, 0.25f, 1.0f, 1.0f});
    frame.planes[Role::layers] = noise_image(37, 33, 4, 3);
    for (size_t i = 0; i < 400; ++i) frame.planes[Role::layers].data[i] = -0.0f;
    frame.description = describe(frame.planes);
    const auto elides = [&](const char* hint) {
        return expect_same_bits(chain_of("fxaa", {{"hint", hint}}), frame.description, frame.planes,
                                {})
            .plan.passes[0]
            .elided;
    };
    EXPECT_TRUE(elides("none"));
    EXPECT_TRUE(elides("checkerboard")) << "there is no hint";
    frame.planes[Role::hint] = constant_image(37, 33, {1, 1});
    frame.description.planes.add(Role::hint);
    EXPECT_FALSE(elides("checkerboard"));
}

// Lights may differ where their sum is one color.
TEST(Elision, ByOneColorHoldsWithoutLayersAlone) {
    TestFrame frame = bright_frame(67, 41);
    frame.planes[Role::color] = constant_image(67, 41, {0.5f, 0.25f, 1.0f, 1.0f});
    frame.description.bounds = describe(frame.planes).bounds;
    ASSERT_TRUE(frame.description.bounds.one_color);
    TestFrame with = frame;
    add_lights(with, kLayersPerStep);
    for (const Variant& one : some_variants()) {
        SCOPED_TRACE(one.name);
        EXPECT_TRUE(make_plan(one.chain(), frame.description)->steps.empty());
        const Elided elided = expect_same_bits(one.chain(), with.description, with.planes, {});
        const bool edges_alone = one.name == "fxaa";
        EXPECT_EQ(elided.plan.steps.empty(), edges_alone) << one.name;
        // Constants stay, whatever they are made of.
        EXPECT_LE(relative_difference(sum_of_layers(elided.outputs.at(Role::layers), 41),
                                      elided.outputs.at(Role::color)),
                  1e-5);
    }
}

}  // namespace
}  // namespace postchain::test
