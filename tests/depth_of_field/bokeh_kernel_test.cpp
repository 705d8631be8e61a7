// An image as the aperture: the lens samples, and the image of a point light.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test {
namespace {

using Light = std::function<double(double, double)>;
constexpr int kSide = BokehKernel::kSide;

BokehKernel image_of(const Light& light) {
    std::vector<float> values;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            values.push_back(
                float(light((x + 0.5) / (kSide / 2) - 1, (y + 0.5) / (kSide / 2) - 1)));
    auto image = BokehKernel::make(std::move(values), "picture.png");
    EXPECT_TRUE(image.ok()) << image.status().message();
    return *image;
}

double right_half(double x, double) {
    return x > 0 ? 1 : 0;
}

// The letter F with a half-bright stem: no rotation or mirroring maps it to itself.
double letter(double x, double y) {
    if (y < -0.7 || y > 0.7) return 0;
    if (x > -0.5 && x < -0.2) return 0.5;
    const bool arm = (y < -0.4 && x < 0.6) || (y > -0.15 && y < 0.15 && x < 0.3);
    return x > -0.5 && arm ? 1 : 0;
}

const double kHalf =
    4 / (3 * std::numbers::pi);  // distance of half a disc's centroid from its edge

TEST(ApertureImagePoints, AreTurnedThenStretched) {
    const BokehKernel right = image_of(right_half);
    for (const int count : {16, 64, 1023}) {
        const Moments m = moments_of(lens::lens_samples({.image = right}, count));
        EXPECT_NEAR(m.x, kHalf, 0.01) << count;
        EXPECT_NEAR(m.y, 0, 0.01) << count;
        EXPECT_NEAR(m.xx, 0.25, 0.01) << count;
        EXPECT_NEAR(m.yy, 0.25, 0.01) << count;
    }
    // Counterclockwise, with y down.
    Moments m = moments_of(lens::lens_samples({.image = right, .rotation_deg = 90}, 64));
    EXPECT_NEAR(m.x, 0, 0.01);
    EXPECT_NEAR(m.y, -kHalf, 0.01);
    m = moments_of(lens::lens_samples({.image = right, .rotation_deg = 90, .ratio = 2}, 64));
    EXPECT_NEAR(m.y, -kHalf, 0.01);
    EXPECT_NEAR(m.xx, 1.0 / 16, 0.005);
    m = moments_of(lens::lens_samples({.image = right, .ratio = 0.5}, 64));
    EXPECT_NEAR(m.x, kHalf, 0.01);
    EXPECT_NEAR(m.yy, 1.0 / 16, 0.005);
}

// Each set's mean is closer to the light's than a quarter of the standard error of random points,
// the deviation of x over the square root of their number.
TEST(ApertureImagePoints, OfEachSetAreSpreadEvenly) {
    const double deviation = std::sqrt(0.25 - kHalf * kHalf);
    for (const int count : {32, 64, 128}) {
        const auto points = lens::lens_samples({.image = image_of(right_half)}, count);
        double squares = 0;
        for (int set = 0; set < points.sets; ++set) {
            double mean = 0;
            for (int i = 0; i < count; ++i) mean += points.at(i, set)[0] / count;
            squares += (mean - kHalf) * (mean - kHalf) / points.sets;
        }
        EXPECT_LT(std::sqrt(squares), 0.25 * deviation / std::sqrt(count)) << count;
    }
}

// Pearson correlation of the aperture image and the image of a point light, over pixels; the
// aperture image is averaged over each.
double correlation(const ImageF& dot, double radius, const Light& light) {
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    for (int y = 0; y < dot.height; ++y)
        for (int x = 0; x < dot.width; ++x) {
            double expected = 0;
            constexpr int kFine = 4;
            for (int i = 0; i < kFine * kFine; ++i) {
                const double u = (x - 48 + (i % kFine + 0.5) / kFine - 0.5) / radius;
                const double v = (y - 48 + (i / kFine + 0.5) / kFine - 0.5) / radius;
                if (u * u + v * v < 1) expected += light(u, v) / (kFine * kFine);
            }
            const double seen = dot.at(x, y);
            n += 1, a += seen, b += expected;
            aa += seen * seen, bb += expected * expected, ab += seen * expected;
        }
    return (ab - a * b / n) / std::sqrt((aa - a * a / n) * (bb - b * b / n));
}

double turned(double x, double y) {
    return letter(-x, -y);
}

// R = 8 px for sky, -24 px for the near plane.
TEST(ApertureImageDot, LooksLikeThePicture) {
    const BokehKernel image = image_of(letter);
    const ImageF behind = dot(0, {}, 0, 0, image), before = dot(1, {}, 0, 0, image);
    EXPECT_NEAR(sum_of(behind), 1, 0.03);
    EXPECT_NEAR(sum_of(before), 1, 0.03);
    EXPECT_GT(correlation(behind, 8, letter), 0.95);
    EXPECT_LT(correlation(behind, 8, turned), 0.75);
    EXPECT_GT(correlation(before, 24, turned), 0.9);
    EXPECT_LT(correlation(before, 24, letter), 0.6);
}

// In the lower right corner, in front of the focus, the barrel keeps the part farther from the
// center.
TEST(ApertureImageDot, IsCutByTheBarrel) {
    const double away_x = 16 / std::hypot(16, 9), away_y = 9 / std::hypot(16, 9);
    const Light cut = [&](double x, double y) {
        return std::hypot(x - 0.8 * away_x, y - 0.8 * away_y) < 1 ? turned(x, y) : 0;
    };
    const ImageF seen = dot(1, {{"cats_eye", 0.8}}, 6400 - 48, 3600 - 48, image_of(letter));
    EXPECT_NEAR(sum_of(seen), 1, 0.06);
    EXPECT_GT(correlation(seen, 24, cut), 0.9);
    EXPECT_LT(correlation(seen, 24, turned), 0.88);
}

TEST(BokehKernel, AgreesWithItsReference) {
    TestFrame frame = layered_frame(61, 45, {9, 4}, {-3, 2});
    frame.description.camera.f_stop = 0.2;
    frame.description.camera.aperture_image = image_of(letter);
    frame.description.camera.aperture_rotation_deg = 30;
    frame.description.camera.cats_eye = 0.7;
    const Chain chain = chain_of("joint_blur", {{"samples", int64_t(20)}});
    const ImageF gpu =
        filter(chain, frame.description, frame.planes, {.elide = false}).at(Role::color);
    const auto expected = [&] {
        return reference(chain, frame.description, frame.planes).planes.at(Role::color);
    };
    const auto difference = compare(gpu, expected(), 1e-3);
    EXPECT_LE(difference.fraction, 0.01) << difference.text;
    // The result differs from a disc's.
    frame.description.camera.aperture_image = {};
    EXPECT_GT(compare(gpu, expected(), 1e-3).fraction, 0.1);
}

TEST(BokehKernel, BladesBesideItAreAnError) {
    using testing::HasSubstr;
    const auto expect_error = [](const Camera& camera, const char* pass, Settings settings,
                                 const char* what) {
        FrameDescription frame = layered_frame(20, 20, {9, 4}, {-3, 2}).description;
        frame.camera = camera;
        const auto plan = make_plan(chain_of(pass, settings), frame);
        EXPECT_THAT(error_of(plan), HasSubstr(what)) << pass;
        EXPECT_EQ(plan.ok(), !*what) << pass << error_of(plan);
    };
    Camera camera = round_camera(), named = camera;
    camera.aperture_image = image_of(letter);
    named.aperture_image = BokehKernel("picture.png");
    Camera both = camera;
    both.aperture_blades = 6;
    for (const char* pass : {"depth_of_field", "joint_blur"}) {
        expect_error(camera, pass, {}, "");
        expect_error(camera, pass, {{"aperture_blades", int64_t(7)}}, "aperture_blades: 7 from");
        expect_error(camera, pass, {{"aperture_curvature", 0.25}}, "aperture_curvature: 0.25 from");
        expect_error(both, pass, {}, "aperture_blades: 6 from the camera");
        expect_error(named, pass, {}, "aperture_image: picture.png has not been read");
    }
    // Gilham's method has no aperture.
    expect_error(both, "depth_of_field", {{"method", "gilham"}}, "");
}

TEST(BokehKernel, APlanIsThatOfItsValues) {
    const FramePlanes planes = deep_planes(40, 30);
    const auto hash_of = [&](const BokehKernel& image) {
        FrameDescription frame = describe_round(planes);
        frame.camera.aperture_image = image;
        const auto plan = make_plan(chain_of("depth_of_field", {}), frame);
        EXPECT_TRUE(plan.ok());
        return plan->hash();
    };
    const BokehKernel image = image_of(letter);
    EXPECT_EQ(hash_of(image), hash_of(*BokehKernel::make(image.values(), "other.png")));
    EXPECT_NE(hash_of(image), hash_of(image_of(turned)));
    EXPECT_NE(hash_of(image), hash_of({}));
}

}  // namespace
}  // namespace postchain::test
