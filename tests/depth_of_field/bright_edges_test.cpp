// Light mixed by antialiasing into pixels of another depth, with method inverse_warp, against
// closed forms.
#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <cmath>
#include <numbers>

#include "chain/pass/depth_at.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

const std::pair<std::string, ParameterValue> kMethod = {"method", "inverse_warp"};

// A lamp at x < 32 before or behind a surface of 0.1, whose first column has its own value, as if
// the lamp covered part of the pixel. Inverse depths: 0.25 is in focus, 0.75 has a radius of 16 px,
// 0 of 8 px.
constexpr int kWidth = 96, kHeight = 48, kEdge = 32;
constexpr float kOther = 0.1f;

struct Lamp {
    float depth, other_depth;
    float light = 30;
    float mixed = 9;
};

// The part of a pixel that the lamp covers.
double covered(double mixed) {
    return (mixed - kOther) / (30 - kOther);
}

// `at`: the pixel at x, y.
template <class F>
ImageF blurred(const F& at, int height = kHeight) {
    return dof(planes_at(kWidth, height, at),
               {kMethod, {"samples", int64_t(256)}, {"denoise", false}});
}

ImageF filtered(const Lamp& lamp) {
    return blurred([&](int x, int) {
        return Pixel{x < kEdge    ? lamp.light
                     : x == kEdge ? lamp.mixed
                                  : kOther,
                     x < kEdge ? lamp.depth : lamp.other_depth};
    });
}

// Light to the right of the column, above the surface's own; a column of 9 blurred by 8 px gives
// more than 3.
double glow(const Lamp& lamp) {
    const ImageF out = filtered(lamp);
    double sum = 0;
    for (int x = kEdge + 1; x < kEdge + 30; ++x) sum += out.at(x, kHeight / 2) - kOther;
    return sum;
}

TEST(BrightEdges, ALampInFocusHasNoGlow) {
    EXPECT_NEAR(glow({0.25f, 0}), 0, 0.01);
    // Its edge keeps its light.
    EXPECT_NEAR(filtered({0.25f, 0}).at(kEdge, kHeight / 2), 9, 0.01);
}

TEST(BrightEdges, OnlyWhereTheTwoAreDisplacedFromEachOther) {
    // Up to 1 px apart an edge is interpolated: the light of a lamp goes step by step.
    const auto light = [](float px) { return glow({0.25f, 0.25f - px / 32}); };
    EXPECT_GT(light(0.9f), 1);
    EXPECT_LT(light(1.5f), 0.5);
    EXPECT_LT(light(3), 0.15);
    EXPECT_NEAR(light(6), 0, 0.04);
}

// A near surface out of focus begins within the column, as much of it as the lamp leaves: its blur
// is that of an edge between two columns. In focus it keeps the lamp's light at its edge.
TEST(BrightEdges, ALampBehindIsSeenThroughTheEdge) {
    const ImageF out = filtered({0.25f, 0.75f}), without = filtered({0.25f, 0.75f, 30, kOther});
    for (int x = kEdge + 3; x < kEdge + 30; ++x) {
        const double here = without.at(x, 24), one_more = without.at(x - 1, 24);
        EXPECT_NEAR(out.at(x, 24), here + covered(9) * (one_more - here), 0.12) << x;
    }
    EXPECT_NEAR(filtered({0, 0.25f}).at(kEdge, 24), 9, 1e-5);
}

// Whatever the contrast, a mixture with enough of the surface in focus has no light out of focus.
// More light than the lamp's is its own.
TEST(BrightEdges, AMixtureDoesNotGlow) {
    for (const auto& [light, mixed] :
         {std::pair(30.0f, 0.41f), {30, 28}, {1.1f, 0.5f}, {0.2f, 0.15f}})
        EXPECT_NEAR(glow({0.25f, 0, light, mixed}), 0, 0.02) << light << ", " << mixed;
    EXPECT_GT(glow({0.25f, 0, 30, 40}), 13);
}

// Sky of two columns between the lamp and a surface in focus: each of its pixels is at an edge.
TEST(BrightEdges, TheDarkestPixelCountsWhereNoneIsAwayFromEdges) {
    const auto glow = [](float mixed) {
        const ImageF out = blurred([&](int x, int) {
            return Pixel{x < kEdge    ? 30
                         : x == kEdge ? mixed
                                      : kOther,
                         x == kEdge || x == kEdge + 1 ? 0 : 0.25f};
        });
        return double(out.at(kEdge + 1, kHeight / 2)) - kOther;
    };
    EXPECT_NEAR(glow(9), 0, 0.01);
    EXPECT_GT(glow(0.39f), 0.02);  // no light of a lamp
}

// The lamp ends at a corner of sky and of a near surface below both. The near surface's corner
// pixel has light of the lamp, but touches only the sky's pixel that has some too.
TEST(BrightEdges, TheLightOfAPixelThatShowsALampIsTheLamps) {
    const auto light_beyond = [](float mixed) {
        const ImageF out = blurred([&](int x, int y) -> Pixel {
            if (y >= kHeight / 2) return {x == kEdge && y == kHeight / 2 ? mixed : kOther, 0.75f};
            if (x < kEdge) return {30, 0.25f};
            return {x == kEdge ? 9 : kOther, 0};
        });
        double sum = 0;
        for (int y = 0; y < kHeight; ++y)
            for (int x = kEdge + 3; x < kWidth; ++x) sum += out.at(x, y);
        return sum;
    };
    // With the sky's surface the difference is 90; the near surface has a pixel less.
    EXPECT_NEAR(light_beyond(4), light_beyond(kOther), 2);
}

// A bar of three columns before a lamp, out of focus by 8 px, hides 2 * 3/(8 pi) of the lens at its
// middle. Its outer columns show some of the lamp.
TEST(BrightEdges, ABarHidesAsMuchOfALampAsItCovers) {
    for (const float mixed : {2.5f, 4.0f, 12.0f}) {
        const ImageF out = blurred([&](int x, int) -> Pixel {
            if (std::abs(x - kEdge) > 1) return {30, 0.25f};
            return {x == kEdge ? kOther : mixed, 0.5f};
        });
        const double width = 3 - 2 * covered(mixed);
        const double light = 30 * (1 - 2 * width / (8 * std::numbers::pi));
        for (const int column : {kEdge - 1, kEdge, kEdge + 1})
            EXPECT_NEAR(out.at(column, kHeight / 2), light, 0.5) << mixed << ", " << column;
    }
}

// A lamp of 8 x 8 pixels, out of focus by 16 px, before a surface in focus. A renderer may take a
// pixel's depth from any place in it: the lamp covers its corners but for a twentieth, and they
// have the depth of the surface. Wherever the lens's disc holds the whole lamp, its light is the
// same.
TEST(BrightEdges, DepthOfASmallPartDoesNotTakeTheLampsLight) {
    constexpr int kFirst = 44, kLast = 51;
    constexpr double kBlurPx = 16, kLight = 30 - kOther, kCorner = 0.95;
    const auto is_lamp = [](int x, int y) {
        return x >= kFirst && x <= kLast && y >= kFirst && y <= kLast;
    };
    const auto is_corner = [&](int x, int y) {
        return (x == kFirst || x == kLast) && (y == kFirst || y == kLast);
    };
    const ImageF out = blurred(
        [&](int x, int y) -> Pixel {
            if (!is_lamp(x, y)) return {kOther, 0.25f};
            if (is_corner(x, y)) return {kOther + kCorner * kLight, 0.25f};
            return {30, 0.75f};
        },
        kWidth);
    const double area = 60 + 4 * kCorner;
    const double share = area / (std::numbers::pi * kBlurPx * kBlurPx);
    double sum = 0;
    for (int y = 0; y < kWidth; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const double light = out.at(x, y) - kOther;
            sum += light;
            if (std::hypot(x - 47.5, y - 47.5) < 9) {
                EXPECT_NEAR(light, share * kLight, 0.2 * share * kLight) << x << ", " << y;
            }
        }
    EXPECT_NEAR(sum, area * kLight, 0.005 * area * kLight);
}

// focus_at: focuses on the surface at a place in the image.

// Left half at 1/0.8, right half at 1/0.1; in a display of the planes' size.
FramePlanes halves() {
    FramePlanes planes = flat_planes(noise_image(64, 32, 4, 8), 0.8f);
    for (int y = 0; y < 32; ++y)
        for (int x = 32; x < 64; ++x) planes[Role::inverse_depth].at(x, y) = 0.1f;
    return planes;
}

FrameDescription describe_halves(const FramePlanes& planes) {
    FrameDescription frame = describe_round(planes);
    frame.camera.focus_distance.reset();
    frame.display_width = 64;
    frame.display_height = 32;
    frame.camera.sensor_width_mm = 3.6;  // R = 32 (1/s - w)
    return frame;
}

TEST(FocusAt, WhatLiesThereIsInFocus) {
    const FramePlanes planes = halves();
    const ImageF& color = planes.at(Role::color);
    for (const char* method : {"gilham", "inverse_warp"})
        for (const char* coc : {"lens", "range"})
            for (const bool left : {true, false}) {
                SCOPED_TRACE(concat(method, " ", coc, left ? " left" : " right"));
                const Chain chain =
                    chain_of("depth_of_field", {{"method", method},
                                                {"coc", coc},
                                                {"max_radius_px", 12.0},
                                                {"focus_at", Place{left ? 0.2 : 0.8, 0.5}}});
                FrameDescription frame = describe_halves(planes);
                frame.bounds.inverse_depth_at[{0.5, 0.5}] = 7;  // of another chain
                find_depths(chain, planes, frame);
                EXPECT_EQ(must(make_plan(chain, frame)).inverse_depth_at,
                          (std::map<Place, double>{
                              {{left ? 0.2 : 0.8, 0.5},
                               double(planes.at(Role::inverse_depth).at(left ? 8 : 56, 16))}}));
                const ImageF out = filter(chain, frame, planes).at(Role::color);
                // Columns 8 and 56 are far from the center.
                EXPECT_EQ(out.at(8, 16) == color.at(8, 16), left);
                EXPECT_EQ(out.at(56, 16) == color.at(56, 16), !left);
            }
}

TEST(FocusAt, OnTheSkyIsInfinity) {
    FramePlanes planes = halves();
    for (float& w : planes[Role::inverse_depth].data)
        if (w < 0.5f) w = 0;
    for (const char* coc : {"lens", "range"}) {
        const Chain chain = chain_of("depth_of_field", {{"method", "gilham"},
                                                        {"focus_at", Place{0.8, 0.5}},
                                                        {"coc", coc},
                                                        {"breathing", true}});
        FrameDescription frame = describe_halves(planes);
        find_depths(chain, planes, frame);
        const ImageF radius =
            filter_with_stages(chain, frame, planes, {.elide = false}).stages.at(stage("coc"));
        EXPECT_EQ(radius.at(56, 16), 0) << coc;
        EXPECT_LT(radius.at(8, 16), -1) << coc;
    }
}

TEST(FocusAt, IsRefusedWhereTheDepthIsNotKnown) {
    const auto error = [](const char* coc) {
        const Chain chain = chain_of(
            "depth_of_field", {{"method", "gilham"}, {"focus_at", Place{0.8, 0.5}}, {"coc", coc}});
        return error_of(make_plan(chain, describe_halves(halves())));
    };
    EXPECT_THAT(error("lens"), testing::HasSubstr("focus_at: the depth at [0.8,0.5] is not known"));
    EXPECT_EQ(error("planes"), "") << "nothing depends on it";
}

}  // namespace
}  // namespace postchain::test
