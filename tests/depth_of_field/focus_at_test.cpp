// focus_at: focuses on the surface at a place in the image.
#include <gtest/gtest.h>

#include "chain/pass/depth_at.h"
#include "tests/depth_of_field/support.h"

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

// Columns 8 and 56, far from the center, unchanged.
struct Sharp {
    bool left = true, right = true;
};
Sharp sharp_of(Settings settings) {
    const FramePlanes planes = halves();
    const Chain chain = chain_of("depth_of_field", settings);
    FrameDescription frame = describe_halves(planes);
    find_depths(chain, planes, frame);
    const ImageF out = filter(chain, frame, planes).at(Role::color);
    Sharp sharp;
    for (int y = 0; y < 32; ++y) {
        sharp.left = sharp.left && out.at(8, y) == planes.at(Role::color).at(8, y);
        sharp.right = sharp.right && out.at(56, y) == planes.at(Role::color).at(56, y);
    }
    return sharp;
}

TEST(FocusAt, WhatLiesThereIsInFocus) {
    for (const char* method : {"gilham", "inverse_warp"})
        for (const char* coc : {"lens", "range"})
            for (const bool left : {true, false}) {
                const Place place = {left ? 0.2 : 0.8, 0.5};
                const Sharp sharp = sharp_of({{"method", method},
                                              {"coc", coc},
                                              {"max_radius_px", 12.0},
                                              {"focus_at", place}});
                EXPECT_EQ(sharp.left, left) << method << " " << coc;
                EXPECT_EQ(sharp.right, !left) << method << " " << coc;
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
        PlanOptions whole{.elide = false};
        const ImageF radius =
            filter_with_stages(chain, frame, planes, whole).stages.at(stage("coc"));
        EXPECT_EQ(radius.at(56, 16), 0) << coc;
        EXPECT_LT(radius.at(8, 16), -1) << coc;
    }
}

TEST(FocusAt, IsRefusedWhereTheDepthIsNotKnown) {
    const FramePlanes planes = halves();
    const Chain chain = chain_of("joint_blur", {{"focus_at", Place{0.8, 0.5}}});
    const auto plan = make_plan(chain, describe_halves(planes));
    ASSERT_FALSE(plan.ok());
    EXPECT_NE(plan.status().message().find("focus_at: the depth at [0.8,0.5] is not known"),
              std::string::npos)
        << plan.status().message();
    // Not required if nothing depends on it.
    EXPECT_TRUE(make_plan(chain_of("depth_of_field", {{"method", "gilham"},
                                                      {"focus_at", Place{0.8, 0.5}},
                                                      {"coc", "planes"}}),
                          describe_halves(planes))
                    .ok());
}

}  // namespace
}  // namespace postchain::test
