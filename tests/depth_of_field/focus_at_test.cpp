// focus_at: focuses on the surface at a place in the image.
#include <gmock/gmock.h>

#include "chain/pass/depth_at.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

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
