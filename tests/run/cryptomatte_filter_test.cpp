// Assignment of ids to planes, and the planes' content.
#include "tools/sequence/filter/cryptomatte_filter.h"
#include "tools/sequence/source/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST(CryptomatteFilter, MemoryIsBounded) {
    EXPECT_EQ(layers_at_once(100), 32);
    EXPECT_EQ(layers_at_once(uint64_t(1920) * 1080), 12);
    EXPECT_EQ(layers_at_once(uint64_t(16384) * 16384), 1);
}

}  // namespace
}  // namespace postchain::sequence
