// Work elided for color is elided for layers, and changes no bit of them either.
#include "tests/elision/support.h"
#include "tests/layers/support.h"

namespace postchain::test {
namespace {

// One of each kind: without rules each has programs of its own, which take long to compile.
std::vector<NamedChain> some_modes() {
    std::vector<NamedChain> all;
    all.push_back({"motion_blur", chain_of("motion_blur")});
    all.push_back({"guertin", chain_of("motion_blur", {{"mode", "guertin"}})});
    all.push_back({"gilham", chain_of("depth_of_field", {{"method", "gilham"}})});
    all.push_back({"joint_blur", chain_of("joint_blur")});
    all.push_back({"fxaa", chain_of("fxaa")});
    all.push_back({"guertin, fxaa", chain_of("motion_blur", {{"mode", "guertin"}})});
    append(all.back().chain, "fxaa", {{"hint", "checkerboard"}});
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
    for (const NamedChain& one : some_modes()) {
        SCOPED_TRACE(one.name);
        const Elided elided = expect_same_bits(one.chain, frame.description, frame.planes, {});
        EXPECT_EQ(elided.outputs.count(Role::layers), 1u);
        for (const WorkDone& list : elided.work) lists += list.blocks > 0;
    }
    EXPECT_GT(lists, 10);
}

TEST(Elision, OfPassesLeavesLayersAsTheyAre) {
    TestFrame frame = layered_frame(67, 41, {0, 0}, {0, 0}, 9);
    frame.planes[Role::inverse_depth] = ImageF(67, 41, 1, 0.1f);
    frame = lit(std::move(frame));
    int elided_passes = 0;
    for (const NamedChain& one : some_modes()) {
        SCOPED_TRACE(one.name);
        const Elided elided = expect_same_bits(one.chain, frame.description, frame.planes, {});
        if (!elided.plan.steps.empty()) continue;
        ++elided_passes;
        EXPECT_TRUE(equal_bits(elided.outputs.at(Role::layers), frame.planes.at(Role::layers)));
    }
    EXPECT_EQ(elided_passes, 4);  // FXAA has edges, in two of them
}

// Lights may differ where their sum is one color.
TEST(Elision, ByOneColorHoldsWithoutLayersAlone) {
    TestFrame frame = bright_frame(67, 41);
    frame.planes[Role::color] = constant_image(67, 41, {0.5f, 0.25f, 1.0f, 1.0f});
    frame.description.bounds = describe(frame.planes).bounds;
    ASSERT_TRUE(frame.description.bounds.one_color);
    TestFrame with = frame;
    add_lights(with, kLayersPerStep);
    for (const NamedChain& one : some_modes()) {
        SCOPED_TRACE(one.name);
        EXPECT_TRUE(make_plan(one.chain, frame.description)->steps.empty());
        const Elided elided = expect_same_bits(one.chain, with.description, with.planes, {});
        const bool edges_alone = one.chain.links.size() == 1 && one.chain.types()[0] == "fxaa";
        EXPECT_EQ(elided.plan.steps.empty(), edges_alone) << one.name;
        // Constants stay, whatever they are made of.
        EXPECT_LE(relative_difference(sum_of(elided.outputs.at(Role::layers), 41),
                                      elided.outputs.at(Role::color)),
                  1e-5);
    }
}

}  // namespace
}  // namespace postchain::test
