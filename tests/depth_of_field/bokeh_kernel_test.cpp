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
    return must(BokehKernel::make(std::move(values), "picture.png"));
}

double right_half(double x, double) {
    return x > 0 ? 1 : 0;
}

// A sector of an eighth of the disc, below the axis to the right: no mirroring, exchange of axes or
// half turn maps it to itself.
double sector(double x, double y) {
    return y > 0 && x > y ? 1 : 0;
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

// R = 8 px for sky, -24 px for the near plane. A sector's centroid is on its axis, at a distance of
// 2 sin(a)/(3 a) from the corner; a is half of its angle.
TEST(ApertureImageDot, IsTurnedByHalfInFrontOfTheFocus) {
    const double a = std::numbers::pi / 8, distance = 2 * std::sin(a) / (3 * a);
    for (const auto& [inverse_depth, radius] : {std::pair{0.0f, 8.0}, {1.0f, -24.0}}) {
        const Moments m = moments_of(dot(inverse_depth, {}, 0, 0, image_of(sector)), 48, 48);
        EXPECT_NEAR(m.light, 1, 0.03) << radius;
        EXPECT_NEAR(m.x, radius * distance * std::cos(a), 0.5) << radius;
        EXPECT_NEAR(m.y, radius * distance * std::sin(a), 0.5) << radius;
    }
}

TEST(BokehKernel, AgreesWithItsReference) {
    TestFrame frame = layered_frame(61, 45, {9, 4}, {-3, 2});
    Camera& camera = frame.description.camera;
    camera.f_stop = 0.2;
    camera.aperture_image = image_of(sector);
    camera.aperture_rotation_deg = 30;
    camera.cats_eye = 0.7;
    const Chain chain = chain_of("joint_blur", {{"samples", int64_t(20)}});
    const ImageF gpu =
        filter(chain, frame.description, frame.planes, {.elide = false}).at(Role::color);
    const auto difference = [&] {
        const auto expected = reference(chain, frame.description, frame.planes);
        return compare(gpu, expected.planes.at(Role::color), 1e-3).fraction;
    };
    EXPECT_LE(difference(), 0.01);
    camera.aperture_image = {};
    EXPECT_GT(difference(), 0.1) << "a disc's is another";
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
    camera.aperture_image = image_of(sector);
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
    const auto hash_of = [](const BokehKernel& image) {
        FrameDescription frame = describe_round(deep_planes(40, 30));
        frame.camera.aperture_image = image;
        return must(make_plan(chain_of("depth_of_field"), frame)).hash();
    };
    const BokehKernel image = image_of(sector);
    EXPECT_EQ(hash_of(image), hash_of(*BokehKernel::make(image.values(), "other.png")));
    EXPECT_NE(hash_of(image), hash_of(image_of(right_half)));
    EXPECT_NE(hash_of(image), hash_of({}));
}

}  // namespace
}  // namespace postchain::test
