// Assignment of ids to planes, and the planes' content.
#include "tools/sequence/filter/cryptomatte_filter.h"
#include "tools/sequence/source/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "tests/support/gpu.h"

namespace postchain::sequence {
namespace {

using io::CryptoId;
using io::RankedCoverage;
using io::Window;
using testing::ElementsAre;

// 3 x 2 pixels of two ranks: 5 on the left, 7 in the center over 5, 9 at the lower right.
RankedCoverage picture() {
    RankedCoverage ranks(3, 2, 2);
    const auto put = [&](int x, int y, int rank, CryptoId id, float coverage) {
        const size_t at = (size_t(y) * 3 + size_t(x)) * 2 + size_t(rank);
        ranks.ids[at] = id;
        ranks.coverages[at] = coverage;
    };
    put(0, 0, 0, 5, 1);
    put(1, 0, 0, 7, 0.75f);
    put(1, 0, 1, 5, 0.25f);
    put(2, 1, 0, 9, 0.5f);
    put(0, 1, 0, 0, 1);  // no coverage
    put(1, 1, 0, 11, 0);
    return ranks;
}

TEST(CryptomatteFilter, BoxesHoldWhatIsCovered) {
    const auto boxes = boxes_of(picture());
    EXPECT_EQ(boxes.size(), 3u);
    EXPECT_EQ(boxes.at(5), (Window{0, 0, 1, 0}));
    EXPECT_EQ(boxes.at(7), (Window{1, 0, 1, 0}));
    EXPECT_EQ(boxes.at(9), (Window{2, 1, 2, 1}));
}

TEST(CryptomatteFilter, WhatIsApartSharesAPlane) {
    const std::map<CryptoId, Window> boxes = {
        {1, {0, 0, 9, 9}}, {2, {20, 0, 24, 4}}, {3, {12, 0, 13, 1}}, {4, {0, 30, 1, 31}}};
    // 2 is 10 pixels from 1; 3 is 2 pixels from 1, and 6 from 2.
    EXPECT_THAT(slots_of(boxes, 0), ElementsAre(ElementsAre(1, 2, 3, 4)));
    EXPECT_THAT(slots_of(boxes, 2), ElementsAre(ElementsAre(1, 2, 3, 4)));
    EXPECT_THAT(slots_of(boxes, 3), ElementsAre(ElementsAre(1, 2, 4), ElementsAre(3)));
    EXPECT_THAT(slots_of(boxes, 10), ElementsAre(ElementsAre(1, 2, 4), ElementsAre(3)));
    EXPECT_THAT(slots_of(boxes, 11),
                ElementsAre(ElementsAre(1, 4), ElementsAre(2), ElementsAre(3)));
}

TEST(CryptomatteFilter, CoverageStandsInItsSlot) {
    const RankedCoverage ranks = picture();
    const Window window = {10, 20, 12, 21};
    ImageF stack(3, 4, 4);
    add_coverage(ranks, window, window, {{5, 0}, {9, 6}}, stack);
    EXPECT_EQ(stack.at(0, 0, 0), 1);
    EXPECT_EQ(stack.at(1, 0, 0), 0.25f);
    EXPECT_EQ(stack.at(2, 3, 2), 0.5f);
    double sum = 0;
    for (float value : stack.data) sum += double(value);
    EXPECT_EQ(sum, 1.75);
    // For a neighbor whose data window is one pixel further right.
    ImageF moved(3, 2, 4);
    add_coverage(ranks, {11, 20, 13, 21}, window, {{5, 0}}, moved);
    EXPECT_EQ(moved.at(0, 0, 0), 0);
    EXPECT_EQ(moved.at(1, 0, 0), 1);
    EXPECT_EQ(moved.at(2, 0, 0), 0.25f);
}

// Id 5 is in the frame, at its upper left. Id 7 is in the frame before, at the upper left of a data
// window that is elsewhere: they share a plane only if they are apart in the display window.
TEST(CryptomatteFilter, BoxesOfANeighborAreInTheFramesWindow) {
    const Chain chain = test::chain_of("echo");
    const Window window = {0, 0, 99, 99};
    const auto of = [](CryptoId id, const Window& its) {
        FrameCryptomattes one = {its, {"object"}, {RankedCoverage(100, 100, 2)}};
        one.ranks[0].ids[0] = id;
        one.ranks[0].coverages[0] = 1;
        return std::make_shared<const FrameCryptomattes>(one);
    };
    SourceFrame frame;
    frame.header.window = window;
    frame.cryptomattes = of(5, window);
    frame.planes = shared({{Role::color_before, ImageF()}});
    FramePlan plan;
    plan.passes.emplace_back();
    for (const auto& [x, y, slots] : {std::tuple(0, 0, 2u),
                                      // Each moves by the margin of two pixels.
                                      {4, 0, 2u},
                                      {0, 4, 2u},
                                      {-4, -4, 2u},
                                      {5, 0, 1u},
                                      {0, 5, 1u},
                                      {0, -5, 1u},
                                      {-5, 0, 1u},
                                      {50, 0, 1u},
                                      {0, 50, 1u},
                                      {0, -50, 1u},
                                      {-50, 0, 1u}}) {
        frame.neighbor_cryptomattes[Neighbor::before] = of(7, {x, y, x + 99, y + 99});
        const auto runs = coverage_runs(chain, plan, frame, {});
        ASSERT_EQ(runs.size(), 1u);
        EXPECT_EQ(runs[0].slots.size(), slots) << x << " " << y;
    }
    // What a neighbor has on both sides of the frame is one box, which is not apart from id 5.
    const auto far = of(7, {-50, -50, 49, 49});
    auto both = *far;
    both.ranks[0].ids.back() = 7;
    both.ranks[0].coverages.back() = 1;
    frame.neighbor_cryptomattes[Neighbor::before] = std::make_shared<const FrameCryptomattes>(both);
    EXPECT_EQ(coverage_runs(chain, plan, frame, {})[0].slots.size(), 2u);
}

TEST(CryptomatteFilter, ALevelHoldsTwoRanks) {
    RankedCoverage ranks(2, 1, 4);
    for (CryptoId& id : ranks.ids) id = std::bit_cast<CryptoId>(float(&id - ranks.ids.data()));
    for (float& coverage : ranks.coverages)
        coverage = 0.125f * float(&coverage - ranks.coverages.data());
    EXPECT_THAT(stored_level(ranks, 0).data, ElementsAre(0, 0, 1, 0.125f, 4, 0.5f, 5, 0.625f));
    EXPECT_THAT(stored_level(ranks, 1).data, ElementsAre(2, 0.25f, 3, 0.375f, 6, 0.75f, 7, 0.875f));
}

TEST(CryptomatteFilter, MemoryIsBounded) {
    EXPECT_EQ(layers_at_once(100), 32);
    EXPECT_EQ(layers_at_once(uint64_t(1920) * 1080), 12);
    EXPECT_EQ(layers_at_once(uint64_t(16384) * 16384), 1);
}

}  // namespace
}  // namespace postchain::sequence
