// Cutting a dispatch into bands, without GL.
#include "chain/plan/bands.h"

#include <gtest/gtest.h>

#include <vector>

namespace postchain {
namespace {

// Every group is in one band, in row order; no band has more than it may.
void expect_whole(unsigned columns, unsigned rows, double groups) {
    std::vector<int> times(size_t(columns) * rows, 0);
    Bands bands(columns, rows);
    unsigned next = 0;
    while (bands.more()) {
        const Band band = bands.next(groups);
        EXPECT_LE(band.groups(), std::max(groups, 1.0));
        EXPECT_EQ(band.first[1] * columns + band.first[0], next);
        next += band.groups();
        for (unsigned y = 0; y < band.count[1]; ++y)
            for (unsigned x = 0; x < band.count[0]; ++x)
                ++times[size_t(band.first[1] + y) * columns + band.first[0] + x];
    }
    for (const int count : times) ASSERT_EQ(count, 1) << columns << "x" << rows << " by " << groups;
}

TEST(Bands, CoverEveryWorkGroupOnce) {
    for (const auto& [columns, rows] :
         std::vector<std::array<unsigned, 2>>{{1, 1}, {7, 1}, {1, 7}, {7, 5}, {120, 68}})
        for (const double groups : {0.0, 1.0, 2.5, 3.0, 6.9, 7.0, 7.1, 14.0, 15.0, 1e3, 1e18})
            expect_whole(columns, rows, groups);
}

TEST(Bands, AreWholeRowsOrPartsOfOne) {
    Bands bands(10, 5);
    EXPECT_EQ(bands.next(25), (Band{{0, 0}, {10, 2}}));
    EXPECT_EQ(bands.next(4), (Band{{0, 2}, {4, 1}}));
    EXPECT_EQ(bands.next(99), (Band{{4, 2}, {6, 1}}));
    EXPECT_EQ(bands.next(99), (Band{{0, 3}, {10, 2}}));
    EXPECT_FALSE(bands.more());
    EXPECT_FALSE(Bands(0, 1).more()) << "an empty list";
}

// A row of a long list is longer than a side of a dispatch may be.
TEST(Bands, AreAtMostAsLongAsADispatchMayBe) {
    Bands bands(129600, 1);
    EXPECT_EQ(bands.next(1e9), (Band{{0, 0}, {65535, 1}}));
    EXPECT_EQ(bands.next(1e9), (Band{{65535, 0}, {64065, 1}}));
    EXPECT_FALSE(bands.more());
}

TEST(Bands, FetchesOfAWorkGroup) {
    Step step;
    step.groups = {4, 5, 1};
    EXPECT_EQ(taps_of_group(step), 256) << "not counted: one for each thread";
    step.taps = 20 * 1000;
    EXPECT_EQ(taps_of_group(step), 1000);
    step.group_taps = 7000;
    EXPECT_EQ(taps_of_group(step), 7000) << "the step knows better";
}

}  // namespace
}  // namespace postchain
