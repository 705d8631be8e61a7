// Conversion to the canonical frame. Expected values are computed here from the projection that
// defines each encoding, not from the converter's formulas.
#include "chain/frame/convert.h"

#include <gtest/gtest.h>

#include <cmath>

#include "chain/base/text.h"
#include "chain/frame/layers.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

FrameDescription frame_of(int width, int height) {
    FrameDescription frame;
    frame.display_width = width;
    frame.display_height = height;
    frame.camera.near_clip = 0.25;
    frame.camera.far_clip = 50;
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    return frame;
}

// A frame of one plane after its conversion.
struct Converted {
    FramePlanes planes;
    FrameDescription frame;
    InputHealth health;
    const std::vector<float>& values(Role role) const { return planes.at(role).data; }
};
Converted converted(Role role, ImageF plane, const ConvertOptions& options = {}) {
    Converted made;
    made.frame = frame_of(plane.width, plane.height);
    made.planes[role] = std::move(plane);
    made.health = test::must(convert_frame(made.planes, made.frame, options));
    return made;
}

ImageF image_of(int width, int height, std::vector<float> values) {
    ImageF image(width, height, int(values.size()) / (width * height));
    image.data = std::move(values);
    return image;
}

// The value of a depth buffer at view distance d: z' / w' of a projection matrix with row (0, 0, a,
// b) over (0, 0, 1, 0), i.e. a + b/d, with near and far mapped to the given ends.
double buffer_depth(double d, double n, double f, double at_near, double at_far) {
    const double b = (at_near - at_far) / (1 / n - 1 / f);
    const double a = at_near - b / n;
    return a + b / d;
}

TEST(Convert, EveryDepthEncodingGivesTheSameInverseDepth) {
    const double n = 0.25, f = 50, infinite = 1e300;
    for (double d : {0.25, 0.3, 1.0, 7.5, 49.0, 50.0}) {
        const std::pair<DepthEncoding, double> stored[] = {
            {DepthEncoding::linear, d},
            {DepthEncoding::inverse, 1 / d},
            {DepthEncoding::forward, buffer_depth(d, n, f, 0, 1)},
            {DepthEncoding::reverse, buffer_depth(d, n, f, 1, 0)},
            {DepthEncoding::forward_infinite, buffer_depth(d, n, infinite, 0, 1)},
            {DepthEncoding::reverse_infinite, buffer_depth(d, n, infinite, 1, 0)},
        };
        for (const auto& [encoding, value] : stored) {
            const Converted made =
                converted(Role::inverse_depth, ImageF(1, 1, 1, float(value)), {.depth = encoding});
            // The stored value is rounded to float: 2^-24 of 1, times slope 1/n of the encoding.
            EXPECT_NEAR(made.values(Role::inverse_depth)[0], 1 / d, 6e-8 / n + 6e-8 / d)
                << "encoding " << depth_encoding_names()[size_t(encoding)] << ", d = " << d;
        }
    }
}

// On a display of 3 x 3 pixels f_px = 50 * 3 / 36 = 4.1667: a pixel beside the center is 1 px off
// the axis, cos = 4.1667 / sqrt(4.1667^2 + 1), one in a corner sqrt(2) px.
TEST(Convert, RayDistanceIsProjectedOnTheAxis) {
    const double f_px = 50.0 * 3 / 36;
    FrameDescription frame = frame_of(3, 3);
    ConvertOptions options;
    options.depth = DepthEncoding::ray_distance;
    const auto expect_projected = [&](int width, int height) {
        FramePlanes planes = {{Role::inverse_depth, ImageF(width, height, 1, 2.0f)}};
        ASSERT_TRUE(convert_frame(planes, frame, options).ok());
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                EXPECT_NEAR(planes[Role::inverse_depth].at(x, y),
                            0.5 *
                                std::hypot(f_px, x + frame.origin_x - 1,
                                           (y + frame.origin_y - 1) / frame.pixel_aspect) /
                                f_px,
                            1e-7)
                    << x << "," << y;
    };
    expect_projected(3, 3);
    frame.origin_x = 1;  // the data window is a part of the display, and goes beyond it
    frame.origin_y = -1;
    expect_projected(1, 2);
    // Pixels twice as wide as high: a step in y is half as long as one in x, in which f_px counts.
    frame.pixel_aspect = 2;
    expect_projected(3, 3);
}

TEST(Convert, TheFarthestSurfaceIsNotTheSky) {
    const auto farthest = [](std::vector<float> depths) {
        const int width = int(depths.size());
        return converted(Role::inverse_depth, image_of(width, 1, std::move(depths)))
            .health.farthest_surface;
    };
    EXPECT_FLOAT_EQ(float(farthest({2, 7, 3, 1e10f, kInf, -1})), 7);
    EXPECT_EQ(farthest({1e10f, kInf}), 0);
}

TEST(Convert, LinearDepthKnowsSkyAndNonsense) {
    const Converted made = converted(
        Role::inverse_depth, image_of(7, 1, {1e10f, kInf, -kInf, kNan, 0.0f, -1.0f, 1e-45f}));
    const auto& w = made.values(Role::inverse_depth);
    EXPECT_FLOAT_EQ(w[0], 1e-10f);  // Blender's background
    for (int i : {1, 2, 3, 4, 5}) EXPECT_EQ(w[size_t(i)], 0.0f) << i;
    EXPECT_TRUE(std::isfinite(w[6]) && w[6] > 1e38f);
    EXPECT_EQ(made.health.nonfinite_depth, 2u);  // +Inf is a usual sky, -Inf and NaN are not
    EXPECT_EQ(made.health.negative_depth, 2u);
    EXPECT_EQ(made.health.first_nonfinite, (std::array<int, 2>{2, 0}));
    EXPECT_EQ(made.frame.bounds.min_inverse_depth, 0);
    EXPECT_EQ(made.frame.bounds.max_inverse_depth, double(w[6]));
}

TEST(Convert, BoundsOfDepth) {
    for (const std::vector<float>& depths : {std::vector{4.0f, 2.0f, 8.0f}, {8, 4, 2}, {2, 8, 4}}) {
        const FrameBounds bounds =
            converted(Role::inverse_depth, image_of(3, 1, depths)).frame.bounds;
        EXPECT_EQ(bounds.min_inverse_depth, 0.125);
        EXPECT_EQ(bounds.max_inverse_depth, 0.5);
    }
}

// A depth beyond infinity is infinitely far.
TEST(Convert, InverseDepthBelowZero) {
    const std::pair<DepthEncoding, std::vector<float>> cases[] = {
        {DepthEncoding::inverse, {-0.5f, 0.5f}},
        {DepthEncoding::forward_infinite, {1.5f, 0.875f}},
        {DepthEncoding::reverse_infinite, {-0.5f, 0.125f}}};
    for (const auto& [encoding, stored] : cases) {
        const Converted made =
            converted(Role::inverse_depth, image_of(2, 1, stored), {.depth = encoding});
        EXPECT_EQ(made.values(Role::inverse_depth), (std::vector{0.0f, 0.5f}));
        EXPECT_EQ(made.health.negative_depth, 1u);
        EXPECT_EQ(made.health.nonfinite_depth, 0u);
    }
}

TEST(Convert, DepthWithoutItsCameraIsAnError) {
    using E = DepthEncoding;
    const struct {
        std::vector<E> encodings;
        const char* key;
        std::optional<double> Camera::*member;
        std::optional<double> value;
        bool fits = false;
    } cases[] = {
        {{E::forward, E::reverse_infinite}, "camera.near_clip", &Camera::near_clip, 0},
        {{E::forward, E::reverse_infinite}, "camera.near_clip", &Camera::near_clip, {}},
        {{E::forward, E::reverse}, "camera.far_clip", &Camera::far_clip, 0.25},
        {{E::forward, E::reverse}, "camera.far_clip", &Camera::far_clip, {}},
        {{E::forward_infinite, E::reverse_infinite, E::linear}, "", &Camera::far_clip, {}, true},
        {{E::ray_distance}, "camera.focal_length_mm", &Camera::focal_length_mm, {}},
        {{E::ray_distance}, "camera.sensor_width_mm", &Camera::sensor_width_mm, {}},
        {{E::linear, E::inverse, E::ray_distance}, "", &Camera::near_clip, {}, true},
        {{E::linear}, "", &Camera::sensor_width_mm, {}, true}};
    for (const auto& one : cases)
        for (const E encoding : one.encodings) {
            SCOPED_TRACE(concat(one.key, " ", int(encoding)));
            FramePlanes planes = {{Role::inverse_depth, ImageF(1, 1, 1, 0.5f)}};
            FrameDescription frame = frame_of(1, 1);
            frame.camera.*one.member = one.value;
            const Status status = convert_frame(planes, frame, {.depth = encoding}).status();
            EXPECT_EQ(status.code(), one.fits ? StatusCode::ok : StatusCode::chain);
            EXPECT_NE(status.message().find(one.key), std::string::npos) << status.message();
        }
}

TEST(Convert, MotionSignsUnitsBiasAndSentinel) {
    // A vector (3, 2) stored as -Z, +W of Blender: scale (-1, +1).
    const Converted blender = converted(
        Role::motion, image_of(4, 2, {3, 2, 9999, 0, 0, -1e5f, 1, 1, kNan, 0, 0, kInf, 0, 0, 0, 0}),
        {.motion = {.scale_x = -1, .sentinel = 9999}});
    const auto& v = blender.values(Role::motion);
    EXPECT_EQ(v[0], -3.0f);
    EXPECT_EQ(v[1], 2.0f);
    for (size_t i : {2u, 3u, 4u, 5u, 8u, 9u, 10u, 11u}) EXPECT_EQ(v[i], 0.0f) << i;
    EXPECT_EQ(blender.health.sentinel_motion, 2u);   // 9999 and -1e5
    EXPECT_EQ(blender.health.nonfinite_motion, 2u);  // NaN and Inf
    EXPECT_DOUBLE_EQ(blender.frame.bounds.max_speed_px, std::sqrt(13.0));

    // The same vector as a fraction of a 4 x 2 image, biased to 0.5: 0.5 + 3/4/2, 0.5 - 2/2/2.
    ImageF motion(4, 2, 2, 0.5f);
    motion.at(0, 0, 0) = 0.5f + 0.375f;
    motion.at(0, 0, 1) = 0.5f - 0.5f;
    const Converted fractions = converted(
        Role::motion, motion,
        {.motion = {MotionUnit::fraction, 2, -2, 0.5, std::numeric_limits<double>::infinity()}});
    EXPECT_EQ(fractions.planes.at(Role::motion).at(0, 0, 0), 3.0f);
    EXPECT_EQ(fractions.planes.at(Role::motion).at(0, 0, 1), 2.0f);
    EXPECT_EQ(fractions.planes.at(Role::motion).at(1, 1, 0), 0.0f);
    EXPECT_FALSE(fractions.health.motion_all_zero);
    EXPECT_TRUE(fractions.health.motion_in_0_1);
    EXPECT_FALSE(blender.health.motion_in_0_1);
    EXPECT_DOUBLE_EQ(blender.health.fastest_stored_px, std::sqrt(13.0));
    EXPECT_TRUE(converted(Role::motion, ImageF(2, 2, 2)).health.motion_all_zero);
    // A vector that is no number is none, whatever its other half is.
    const InputHealth none = converted(Role::motion, image_of(2, 1, {kNan, 1e5f, 1e5f, kInf}),
                                       {.motion = {.sentinel = 9999}})
                                 .health;
    EXPECT_EQ(none.nonfinite_motion, 2u);
    EXPECT_EQ(none.sentinel_motion, 0u);
}

// In the order of the picture, whichever plane it is in.
TEST(Convert, TheFirstPixelThatIsNoNumber) {
    for (const bool swapped : {false, true}) {
        FramePlanes planes = {{Role::color, ImageF(3, 2, 4)},
                              {Role::inverse_depth, ImageF(3, 2, 1)}};
        planes[Role::color].at(swapped ? 2 : 1, swapped ? 0 : 1, 3) = kNan;
        planes[Role::inverse_depth].at(swapped ? 1 : 2, swapped ? 1 : 0) = kNan;
        FrameDescription frame = frame_of(3, 2);
        EXPECT_EQ(test::must(convert_frame(planes, frame, {})).first_nonfinite,
                  (std::array<int, 2>{2, 0}));
    }
}

TEST(Convert, ColorOfAReferenceIsFinite) {
    ImageD color(7, 1, 1);
    color.data = {double(kNan), double(kInf), -double(kInf), 1e300, -2e34, double(1e34f), -0.5};
    EXPECT_EQ(finite_color(color).data,
              (std::vector<double>{0, 65504, -65504, 65504, -65504, double(1e34f), -0.5}));
}

// Each layer is treated as color is; this is the second of two.
constexpr Role kColorAndLayers[] = {Role::color, Role::layers};

Converted converted_as(Role role, const ImageF& image, const ConvertOptions& options = {}) {
    if (role == Role::color) return converted(role, image, options);
    Converted made;
    made.frame = frame_of(image.width, image.height);
    const ImageF plain(image.width, image.height, 4, 0.25f);
    made.planes = {{Role::color, plain}, {Role::layers, stack_planes({plain, image})}};
    made.health = test::must(convert_frame(made.planes, made.frame, options));
    made.planes[role] = plane_of_stack(made.planes[role], 1, image.height);
    return made;
}

TEST(Convert, NonFiniteColorByPolicy) {
    ImageF color(2, 2, 4, 0.25f);
    color.at(1, 0, 1) = kNan;
    color.at(0, 1, 2) = kInf;
    color.at(1, 1, 0) = -kInf;
    color.at(1, 1, 1) = 2e34f;  // no mean of such values fits a float
    color.at(1, 1, 2) = 1e34f;
    for (auto policy : {NonfiniteColor::zero, NonfiniteColor::clamp})
        for (const Role role : kColorAndLayers) {
            const Converted made = converted_as(role, color, {.nonfinite_color = policy});
            const ImageF& result = made.planes.at(role);
            const float large = policy == NonfiniteColor::clamp ? 65504.0f : 0.0f;
            EXPECT_EQ(result.at(1, 0, 1), 0.0f);
            EXPECT_EQ(result.at(0, 1, 2), large);
            EXPECT_EQ(result.at(1, 1, 0), -large);
            EXPECT_EQ(result.at(1, 1, 1), large);
            EXPECT_EQ(result.at(1, 1, 2), 1e34f);
            EXPECT_EQ(result.at(0, 0, 0), 0.25f);
            EXPECT_EQ(made.health.nonfinite_color, 3u);
            EXPECT_EQ(made.health.first_nonfinite, (std::array<int, 2>{1, 0}));
        }
}

// A product with alpha that does not fit is replaced too; where alpha is 0 there is no light.
TEST(Convert, UnpremultipliedColorIsMultiplied) {
    const auto multiplied = [](std::vector<float> pixels) {
        const int width = int(pixels.size()) / 4;
        return converted(Role::color, image_of(width, 1, std::move(pixels)),
                         {.unpremultiplied = true});
    };
    EXPECT_EQ(multiplied({0.5f, 1.0f, 2.0f, 0.25f}).values(Role::color),
              (std::vector<float>{0.125f, 0.25f, 0.5f, 0.25f}));
    // A layer by the alpha of color, which is 0.25 here.
    EXPECT_EQ(converted_as(Role::layers, image_of(1, 1, {0.5f, 1.0f, 2.0f, 1.0f}),
                           {.unpremultiplied = true})
                  .values(Role::layers),
              (std::vector<float>{0.125f, 0.25f, 0.5f, 1.0f}));
    const Converted large = multiplied({3e30f, kInf, 2.0f, 1e6f, kInf, 1.0f, 2.0f, 0.0f});
    EXPECT_EQ(large.values(Role::color),
              (std::vector<float>{65504, 65504, 2e6f, 1e6f, 0, 0, 0, 0}));
    EXPECT_EQ(large.health.nonfinite_color, 2u);
    // Replaced everywhere by one color.
    const FrameBounds bounds = multiplied(std::vector<float>(8, 3e38f)).frame.bounds;
    EXPECT_TRUE(bounds.one_color);
    EXPECT_EQ(bounds.max_color[0], 65504);
}

TEST(Convert, BoundsOfColor) {
    const auto bounds_of = [](const ImageF& color) {
        return converted(Role::color, color).frame.bounds;
    };
    ImageF color(3, 2, 4, 0.25f);
    EXPECT_TRUE(bounds_of(color).one_color);
    EXPECT_TRUE(bounds_of(color).color_is_half);
    color.at(1, 0, 1) = -7.5f;
    color.at(1, 1, 1) = 3;
    EXPECT_FALSE(bounds_of(color).one_color);
    EXPECT_EQ(bounds_of(color).min_color, (std::array<double, 4>{0.25, -7.5, 0.25, 0.25}));
    EXPECT_EQ(bounds_of(color).max_color, (std::array<double, 4>{0.25, 3, 0.25, 0.25}));
    EXPECT_EQ(bounds_of(ImageF(3, 2, 4, -2)).max_color[3], -2);
    EXPECT_EQ(bounds_of(ImageF(3, 2, 4, 2)).min_color[0], 2);
    // One color but for the sign of a zero is not one.
    ImageF zeros(3, 2, 4, 0.0f);
    EXPECT_TRUE(bounds_of(zeros).one_color);
    zeros.at(1, 0, 2) = -0.0f;
    EXPECT_FALSE(bounds_of(zeros).one_color);
    // Largest half, the next float, the next with the bits of a half, a third, smallest subnormal
    // half, half of that, one and a half.
    const std::pair<float, bool> values[] = {
        {65504.0f, true},     {65505.0f, false}, {65536.0f, false},      {-65504.0f, true},
        {-65536.0f, false},   {1.0f / 3, false}, {0x1p-24f, true},       {0x1p-25f, false},
        {0x1.8p-24f, false},  {-0x1p-24f, true}, {-0x1.ffcp-15f, false}, {0x1.ff8p-15f, true},
        {-0x1.8p-24f, false}, {-2049.0f, false}, {-2048.0f, true}};
    for (const auto& [value, half] : values)
        for (const Role role : kColorAndLayers) {
            ImageF one(2, 1, 4, 1.0f);
            one.at(1, 0, 3) = value;
            const FrameBounds bounds = converted_as(role, one).frame.bounds;
            EXPECT_EQ(role == Role::color ? bounds.color_is_half : bounds.layers_are_half, half)
                << value;
        }
}

TEST(Convert, OnlyWhatIsThereIsKnown) {
    FramePlanes planes = {{Role::color, ImageF(2, 2, 4)}};
    FrameDescription frame = frame_of(2, 2);
    frame.bounds.camera_cut = true;
    ASSERT_TRUE(convert_frame(planes, frame, {}).ok());
    EXPECT_TRUE(frame.bounds.camera_cut) << "the caller's word";
    EXPECT_EQ(frame.bounds.max_speed_px, FrameBounds::kUnknown);
    EXPECT_EQ(frame.bounds.max_inverse_depth, FrameBounds::kUnknown);
    EXPECT_EQ(frame.planes, RoleSet{Role::color});
    // Each frame anew.
    planes[Role::layers] = ImageF(2, 6, 4);
    ASSERT_TRUE(convert_frame(planes, frame, {}).ok());
    EXPECT_EQ(frame.layers, 3);
    EXPECT_EQ(frame.planes, (RoleSet{Role::color, Role::layers}));
    planes.erase(Role::layers);
    ASSERT_TRUE(convert_frame(planes, frame, {}).ok());
    EXPECT_EQ(frame.layers, 0);
    EXPECT_EQ(frame.planes, RoleSet{Role::color});
    planes = {{Role::layers, ImageF(2, 2, 4)}};
    ASSERT_TRUE(convert_frame(planes, frame, {}).ok());
    EXPECT_EQ(frame.layers, 1);
}

TEST(Convert, PlanesOfOneFrameHaveOneSize) {
    FramePlanes none;
    FrameDescription empty;
    EXPECT_EQ(convert_frame(none, empty, {}).status().code(), StatusCode::input);
    const std::pair<Role, ImageF> others[] = {
        {Role::inverse_depth, ImageF(3, 2, 1)}, {Role::inverse_depth, ImageF(2, 3, 1)},
        {Role::inverse_depth, ImageF(2, 4, 1)}, {Role::inverse_depth, ImageF(2, 2, 3)},
        {Role::layers, ImageF(2, 5, 4)},        {Role::layers, ImageF(3, 4, 4)},
        {Role::layers, ImageF(2, 0, 4)}};
    for (const auto& [role, plane] : others) {
        FramePlanes planes = {{Role::color, ImageF(2, 2, 4)}, {role, plane}};
        FrameDescription frame;
        EXPECT_EQ(convert_frame(planes, frame, {}).status().code(), StatusCode::input)
            << name_of(role) << " " << plane.width << "x" << plane.height;
    }
}

}  // namespace
}  // namespace postchain
