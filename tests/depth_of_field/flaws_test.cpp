// The known flaws of `gilham` (docs/depth_of_field.md) with their size, and their repair by leak
// modes and hdr_weight. If a flaw disappears, these tests fail.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test::flaws_test {
namespace {

using namespace std::string_literals;

constexpr int kSize = 64;
constexpr int kEdge = 32;  // the two layers meet between columns 31 and 32

// Value and w of the layers left and right of the edge.
FramePlanes two_layers(float left, float left_w, float right, float right_w) {
    FramePlanes planes =
        flat_planes(constant_image(kSize, kSize, {right, right, right, 1}), right_w);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kEdge; ++x) {
            for (int c = 0; c < 3; ++c) planes[Role::color].at(x, y, c) = left;
            planes[Role::inverse_depth].at(x, y) = left_w;
        }
    return planes;
}

// A bright object in focus before a black sky, R = 8. Through a lens the sky beside the object
// stays black, because nothing in front of it is out of focus. Without a leak test the object's
// light is smeared over the sky as a halo; both leak tests prevent it, exactly at full size. In the
// small copy the bilinear up-sampling still mixes across the edge over two pixels (columns 32 and
// 33 are between the centers of boxes 7 and 8, at 7.625 and 7.875).
TEST(flaws, halo_of_objects_in_focus) {
    const FramePlanes planes = two_layers(1, 0.25f, 0, 0);
    const auto halo = [&](const std::string& leak, int factor, int distance) {
        return dof(planes,
                   {{"leak", leak}, {"downsample", int64_t(factor)}, {"blur_sigma_px", 4.0}})
            .at(kEdge + distance, 32);
    };
    EXPECT_GT(halo("none", 1, 0), 0.4);
    EXPECT_GT(halo("none", 4, 0), 0.4);
    EXPECT_GT(halo("none", 4, 2), 0.25);
    for (const char* leak : {"depth", "coc"}) {
        EXPECT_EQ(halo(leak, 1, 0), 0) << leak;
        EXPECT_GT(halo(leak, 4, 0), 0.2) << leak;
        EXPECT_EQ(halo(leak, 4, 2), 0) << leak;
    }
}

// A black near object out of focus, R = -8, before a white wall in focus. A lens spreads the object
// over 8 px of the wall; here the wall is unchanged, and the silhouette stays hard.
TEST(flaws, hard_near_silhouette) {
    const FramePlanes planes = two_layers(0, 0.5f, 1, 0.25f);
    for (const char* leak : {"none", "depth", "coc"}) {
        const ImageF result = dof(planes, {{"leak", std::string(leak)}, {"blur_sigma_px", 4.0}});
        for (int x = kEdge; x < kEdge + 8; ++x) EXPECT_EQ(result.at(x, 32), 1) << leak;
        EXPECT_LT(result.at(kEdge - 1, 32), 0.6) << leak;  // a jump of 0.4 and more
    }
}

// A white line on black at half weight, R = (0.5 + 16)/2. A lens spreads it evenly over 2R px, at
// 1/16.5 of its brightness. Here half of it stays as a sharp line on a blurred one.
TEST(flaws, double_image_half_way) {
    FramePlanes planes =
        flat_planes(constant_image(kSize, kSize, {0, 0, 0, 1}), float(0.25 - 8.25 / 32));
    for (auto& w : planes[Role::inverse_depth].data) w = float(0.25 + 8.25 / 32);
    for (int y = 0; y < kSize; ++y) planes[Role::color].at(kEdge, y, 0) = 1;
    const ImageF result = dof(planes, {{"blur_sigma_px", 8.0}, {"downsample", int64_t(1)}});
    EXPECT_GT(result.at(kEdge, 32), 0.5);
    EXPECT_LT(result.at(kEdge + 1, 32), 0.05);
    EXPECT_GT(result.at(kEdge + 12, 32), 0.005);  // a lens gives no light beyond R = 8.25
}

// A highlight of 40 that moves by one pixel: the result should move with it, but the small copy
// moves in steps of its boxes. Largest |F(shift) - shift(F)| over shifts of 1 to 3 px; weighting by
// luminance reduces it by reducing the highlight.
TEST(flaws, shimmer_of_the_small_copy) {
    const auto shimmer = [](int factor, bool hdr) {
        const auto render = [&](int shift) {
            FramePlanes planes =
                flat_planes(constant_image(kSize, kSize, {0.2f, 0.2f, 0.2f, 1}), 0);
            planes[Role::color].at(28 + shift, 30, 0) = 40;
            return dof(
                planes,
                {{"blur_sigma_px", 2.0}, {"downsample", int64_t(factor)}, {"hdr_weight", hdr}});
        };
        const ImageF still = render(0);
        double largest = 0;
        for (int shift = 1; shift < 4; ++shift) {
            const ImageF moved = render(shift);
            for (int y = 0; y < kSize; ++y)
                for (int x = 0; x + shift < kSize; ++x)
                    largest = std::max(largest,
                                       double(std::abs(moved.at(x + shift, y) - still.at(x, y))));
        }
        return largest;
    };
    EXPECT_LT(shimmer(1, false), 1e-5);
    EXPECT_GT(shimmer(4, false), 0.3);
    EXPECT_LT(shimmer(4, true), 0.05);
}

// Two distances with |R| = 8 and 16 are blurred by one Gaussian: the same bits.
TEST(flaws, one_blur_size) {
    const ImageF color = noise_image(kSize, kSize, 4, 17);
    const Settings settings = {{"blur_sigma_px", 4.0}};
    EXPECT_TRUE(equal_bits(dof(flat_planes(color, 0.5f), settings),
                           dof(flat_planes(color, 0.75f), settings)));
}

}  // namespace
}  // namespace postchain::test::flaws_test
