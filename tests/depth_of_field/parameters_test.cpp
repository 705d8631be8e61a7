// The two ends of each parameter change the image as its help says.
//
// The image is noise with sky above (R = 8), the focus in the center and a near block (R = -17.6).
// "Sharp" means unchanged, "blurred" that a pixel is far from its own color.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/depth_of_field/support.h"

namespace postchain::test {
namespace {

using namespace std::string_literals;

// Mean |out - in| of the red channel over each of three bands: sky, focus, near.
struct Change {
    double sky = 0, focus = 0, near = 0;
};

FramePlanes banded_planes() {
    FramePlanes planes = flat_planes(noise_image(48, 48, 4, 21), 0);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x)
            planes[Role::inverse_depth].at(x, y) = y < 16 ? 0 : y < 32 ? 0.25f : 0.8f;
    return planes;
}

Change change(Settings settings) {
    const FramePlanes planes = banded_planes();
    const ImageF result = dof(planes, settings);
    Change change;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
            double& band = y < 16 ? change.sky : y < 32 ? change.focus : change.near;
            band += std::abs(result.at(x, y) - planes.at(Role::color).at(x, y)) / (16 * 48);
        }
    return change;
}

// Noise in 0..1 is 1/4 away from its mean on average.
constexpr double kBlurred = 0.2;

TEST(parameter, coc) {
    const Change lens = change({{"coc", "lens"s}});
    const Change planes = change({{"coc", "planes"s}});  // 1..40 is sharp: d = 4; 1.25 too
    const Change range = change({{"coc", "range"s}, {"range", 2.0}});
    EXPECT_GT(lens.near, kBlurred);
    EXPECT_EQ(planes.near, 0);
    EXPECT_GT(planes.sky, 0.01);
    EXPECT_GT(range.near, kBlurred);
    EXPECT_GT(range.sky, lens.sky);  // R = max_radius_px in the sky
    EXPECT_EQ(lens.focus + planes.focus + range.focus, 0);
}

TEST(parameter, focal_length_mm) {
    const Change short_lens = change({{"focal_length_mm", 1e-3}});
    EXPECT_EQ(short_lens.sky + short_lens.near, 0);
    const Change long_lens = change({{"focal_length_mm", 1e6}, {"focus_distance", 4000.0}});
    EXPECT_GT(long_lens.near, kBlurred);
    EXPECT_GT(long_lens.sky, kBlurred);
    EXPECT_GT(long_lens.focus, kBlurred);  // the focus has moved away
}

TEST(parameter, f_stop) {
    const Change open = change({{"f_stop", 1e-9}});
    EXPECT_GT(open.sky, kBlurred);
    EXPECT_GT(open.near, kBlurred);
    EXPECT_EQ(open.focus, 0);
    const Change closed = change({{"f_stop", 1e9}});
    EXPECT_EQ(closed.sky + closed.focus + closed.near, 0);
}

TEST(parameter, focus_distance) {
    const Change close = change({{"focus_distance", 0.037}});
    EXPECT_GT(close.focus, kBlurred);
    EXPECT_GT(close.sky, kBlurred);
    const Change far = change({{"focus_distance", 1e30}});
    EXPECT_EQ(far.sky, 0);
    EXPECT_GT(far.near, kBlurred);
}

TEST(parameter, sensor_width_mm) {
    EXPECT_GT(change({{"sensor_width_mm", 1e-9}}).sky, kBlurred);
    EXPECT_EQ(change({{"sensor_width_mm", 1e9}}).sky, 0);
}

// Radii times s/(s - f): R = 8 for sky becomes 8 * 0.05/(0.05 - 0.036) px at s = 5 cm.
TEST(parameter, breathing) {
    FramePlanes planes = banded_planes();
    const auto radius = [&](bool breathing) {
        return dof_stages(planes, {{"breathing", breathing},
                                   {"focus_distance", 0.05},
                                   {"f_stop", 100.0},
                                   {"max_radius_px", 1000.0}})
            .stages.at(stage("coc"))
            .at(0, 0);
    };
    EXPECT_NEAR(radius(true) / radius(false), 0.05 / 0.014, 1e-5);
}

TEST(parameter, near_and_far_planes) {
    // Near block at 1.25, focus at 4.
    const auto near = [](double blurry, double sharp) {
        return change({{"coc", "planes"s}, {"near_blurry", blurry}, {"near_sharp", sharp}}).near;
    };
    EXPECT_EQ(near(0.0, 1.0), 0);           // the block is beyond near_sharp
    EXPECT_GT(near(0.0, 4.0), 0.05);        // half way
    EXPECT_GT(near(2.0, 4.0), near(0, 4));  // beyond near_blurry: fully blurred
    const auto focus = [](double sharp, double blurry) {
        return change({{"coc", "planes"s},
                       {"max_far_fraction", 0.03},
                       {"far_sharp", sharp},
                       {"far_blurry", blurry}})
            .focus;
    };
    EXPECT_EQ(focus(4.0, 1e30), 0);
    EXPECT_GT(focus(1.0, 7.0), 0.1);
    EXPECT_GT(focus(1.0, 4.0), focus(1.0, 7.0));
}

TEST(parameter, plane_fractions) {
    const auto with = [](double near, double far) {
        return change({{"coc", "planes"s},
                       {"near_blurry", 2.0},
                       {"near_sharp", 3.0},
                       {"max_near_fraction", near},
                       {"max_far_fraction", far}});
    };
    EXPECT_EQ(with(0.0, 1.0).near, 0);
    EXPECT_GT(with(0.0, 1.0).sky, kBlurred);
    EXPECT_GT(with(1.0, 0.0).near, kBlurred);  // clamped to max_radius_px
    EXPECT_EQ(with(1.0, 0.0).sky, 0);
}

TEST(parameter, focus_and_range) {
    const auto with = [](double focus, double range) {
        return change({{"coc", "range"s}, {"focus", focus}, {"range", range}});
    };
    EXPECT_GT(with(1e-6, 1.0).focus, kBlurred);
    EXPECT_GT(with(1e30, 1.0).focus, kBlurred);
    EXPECT_EQ(with(4, 1e-9).focus, 0);
    EXPECT_GT(with(4, 1e-9).near, kBlurred);
    EXPECT_EQ(with(4, 1e9).near, 0);
    EXPECT_GT(with(4, 1e9).sky, kBlurred);  // sky is farther than any range
}

TEST(parameter, max_radius_px) {
    const Change none = change({{"max_radius_px", 0.0}});
    EXPECT_EQ(none.sky + none.near, 0);
    const auto radius = [](double limit) {
        return dof_stages(banded_planes(), {{"f_stop", 1e-4}, {"max_radius_px", limit}})
            .stages.at(stage("coc"))
            .at(0, 0);
    };
    EXPECT_EQ(radius(1000.0), 1000);
    EXPECT_EQ(radius(3.0), 3);
    // Unset, it is 3 % of the display width.
    EXPECT_NEAR(dof_stages(banded_planes(), {{"f_stop", 1e-4}}).stages.at(stage("coc")).at(0, 0),
                19.2, 1e-5);
}

// A larger box is a blurrier copy: with a one-tap kernel, a size of 1 changes nothing.
TEST(parameter, downsample) {
    const auto with = [](int factor) {
        return change({{"downsample", int64_t(factor)}, {"blur_sigma_px", 0.0}}).near;
    };
    EXPECT_LT(with(1), 1e-6);
    EXPECT_GT(with(2), 0.1);
    EXPECT_GT(with(4), with(2));
}

// From one tap to a mean of the whole image; |R| = 17.6 is full blur for one but not for the other.
TEST(parameter, blur_sigma_px) {
    const FramePlanes planes = banded_planes();
    const auto spread = [&](double sigma) {
        const ImageF low =
            dof_stages(planes,
                       {{"blur_sigma_px", sigma}, {"downsample", int64_t(4)}, {"leak", "none"s}})
                .stages.at(stage("blur_y"));
        double low_most = 1e9, high_most = -1e9;
        for (int y = 0; y < low.height; ++y)
            for (int x = 0; x < low.width; ++x) {
                low_most = std::min<double>(low_most, low.at(x, y));
                high_most = std::max<double>(high_most, low.at(x, y));
            }
        return high_most - low_most;
    };
    EXPECT_GT(spread(0.0), 0.2);
    EXPECT_LT(spread(500.0), 0.002);
    EXPECT_GT(change({{"blur_sigma_px", 0.0}, {"downsample", int64_t(4)}}).near, kBlurred);
    EXPECT_LT(change({{"blur_sigma_px", 500.0}, {"downsample", int64_t(4)}}).near, 0.01);
}

// flaws_test.cpp shows the effect of each mode; here, three modes give three images.
TEST(parameter, leak) {
    const FramePlanes planes = deep_planes(48, 48);
    const ImageF none = dof(planes, {{"leak", "none"s}});
    const ImageF depth = dof(planes, {{"leak", "depth"s}});
    const ImageF coc = dof(planes, {{"leak", "coc"s}});
    EXPECT_GT(compare(none, depth, 0).max, 0.05);
    EXPECT_GT(compare(none, coc, 0).max, 0.02);
    EXPECT_GT(compare(depth, coc, 0).max, 0.05);
}

// On: a highlight of 100 among zeros keeps 1/(1 + 100) of its weight: 100/101 / (15 + 1/101) of the
// box instead of 100/16.
TEST(parameter, hdr_weight) {
    ImageF color(4, 4, 4);
    color.at(1, 1, 0) = 100;
    const auto box = [&](bool on) {
        return dof_stages(flat_planes(color, 0), {{"hdr_weight", on}})
            .stages.at(stage("small"))
            .at(0, 0);
    };
    EXPECT_NEAR(box(false), 6.25, 1e-5);
    EXPECT_NEAR(box(true), 100.0 / (15 * 101 + 1), 1e-6);
}

TEST(parameter, every_row_is_tested_here) {
    std::vector<std::string> keys;
    for (const Parameter& row : depth_of_field::pass_type().parameters->rows())
        keys.push_back(row.key);
    EXPECT_EQ(keys, (std::vector<std::string>{
                        "method", "coc", "focal_length_mm", "f_stop", "focus_distance",
                        "focus_at",  // focus_at_test.cpp

                        "sensor_width_mm", "breathing", "near_blurry", "near_sharp", "far_sharp",
                        "far_blurry", "max_near_fraction", "max_far_fraction", "focus", "range",
                        "max_radius_px",
                        "max_radius_fraction",  // pixel_aspect_test.cpp
                        "downsample", "blur_sigma_px", "leak", "hdr_weight",
                        // inverse_warp_test.cpp
                        "samples", "starts", "neighbors", "denoise",
                        // aperture_test.cpp
                        "aperture_blades", "aperture_rotation_deg", "aperture_curvature",
                        "aperture_ratio", "cats_eye",
                        // inverse_warp_test.cpp
                        "noise", "seed", "animate_noise"}));
}

}  // namespace
}  // namespace postchain::test
