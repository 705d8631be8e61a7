// Cutting a dispatch into bands, without GL.
#include "chain/plan/bands.h"

#include <gtest/gtest.h>

#include <algorithm>
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
    // A row of a long list is longer than a side of a dispatch may be.
    Bands row(129600, 1);
    EXPECT_EQ(row.next(1e9), (Band{{0, 0}, {65535, 1}}));
    EXPECT_EQ(row.next(1e9), (Band{{65535, 0}, {64065, 1}}));
    EXPECT_FALSE(row.more());
}

TEST(Bands, OfAStepTakeEqualTimes) {
    EXPECT_EQ(groups_of_band(10, 5, 1), 50) << "50 ms: whole";
    EXPECT_EQ(groups_of_band(10, 5, 1.1), 30) << "two bands: three rows and two";
    EXPECT_EQ(groups_of_band(10, 50, 1), 50);
    EXPECT_EQ(groups_of_band(10, 50, 3), 10)
        << "two rows would take more than 50 ms, one is long enough";
    EXPECT_EQ(groups_of_band(10, 50, 10), 5) << "halves of a row";
    EXPECT_EQ(groups_of_band(10, 50, 1000), 1);
    for (const double ms_of_group : {0.01, 0.1, 0.3, 1.0, 2.0}) {
        for (const unsigned rows : {3u, 17u, 68u}) {
            const double ms = groups_of_band(20, rows, ms_of_group) * ms_of_group;
            EXPECT_GE(ms, std::min(kLeastBandMs, 20 * rows * ms_of_group)) << ms_of_group;
            EXPECT_LE(ms, 2 * kBandMs) << ms_of_group;
        }
    }
}

// A recorded run cuts a step of whole groups, or launches it by its list; the same for every length
// of a list on both sides of the limit.
TEST(Bands, OfARecordedRunTakeAtMostTheirTime) {
    Plan plan;
    Step step;
    step.groups = {7, 5, 1};
    for (const uint64_t taps :
         {uint64_t(kBandTaps), uint64_t(kBandTaps / 2), uint64_t(kBandTaps / 14)}) {
        step.group_taps = taps;
        unsigned groups = 0;
        for (Launch launch = launch_of(plan, step); launch.bands.more();) {
            EXPECT_FALSE(launch.by_list);
            const Band band = launch.next();
            EXPECT_LE(double(band.groups()) * double(taps), kBandTaps) << taps;
            groups += band.groups();
        }
        EXPECT_EQ(groups, 35u) << taps;
    }
    step.group_taps = uint64_t(kBandTaps / 100);
    step.work_list = 0;
    for (const int blocks : {1, 100, 101, 128, 1000}) {
        PlanTexture list;
        list.width = blocks;
        plan.textures = {list};
        Launch launch = launch_of(plan, step);
        EXPECT_EQ(launch.by_list, blocks <= 100) << blocks;
        unsigned groups = 0;
        while (launch.bands.more()) {
            const Band band = launch.next();
            EXPECT_LE(band.groups(), 100u) << blocks;
            groups += band.groups();
        }
        // Rows of 64 groups; those beyond the list return at once.
        EXPECT_EQ(groups, blocks <= 100 ? 0u : unsigned((blocks + 63) / 64 * 64)) << blocks;
    }
}

TEST(Bands, RatesAreOfPrograms) {
    BandRates rates;
    EXPECT_EQ(rates.of(3), kUnknownRate);
    EXPECT_FALSE(rates.knows(3));
    rates.add(3, 8e6, 2);
    EXPECT_EQ(rates.of(3), 4e6);
    EXPECT_EQ(rates.of(4), kUnknownRate);
    rates.add(3, 8e6, 4);
    EXPECT_EQ(rates.of(3), 3e6) << "the mean of both";
    rates.add(4, 8e9, 1, kMostListRate);
    EXPECT_EQ(rates.of(4), kMostListRate);
    rates.add(5, 0, 1);
    EXPECT_FALSE(rates.knows(5)) << "nothing was done";
    rates.forget();
    EXPECT_FALSE(rates.knows(3));
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
