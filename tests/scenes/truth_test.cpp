// Ground truths against closed forms of lens and shutter. F = 50/36 * width pixels per unit slope.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/scenes/support.h"
#include "tests/support/status.h"

namespace postchain::scenes::test::truth_test {
namespace {

constexpr int kSide = 72;
constexpr double kF = 100;

RenderSettings settings_of(int samples, double shutter, bool lens) {
    RenderSettings settings;
    settings.width = settings.height = kSide;
    settings.samples = samples;
    settings.shutter_frames = shutter;
    settings.lens = lens;
    return settings;
}

SceneModel one_lamp(PoseAt pose, double radius, double focus, double f_stop) {
    SceneModel model = empty_model(focus, f_stop);
    model.objects = {unlit(sphere(radius, std::move(pose), {}), {30, 30, 30})};
    return model;
}

TEST(CircleOfConfusion, IsTheFormula) {
    // 50 mm, f/2, focus at 2, point at 1, 36 mm over 720 px: 0.0025/2 * 1/2 * 20000 = 12.5 px.
    EXPECT_NEAR(circle_of_confusion_px(50, 2, 36, 2, 1, 720), 12.5, 1e-9);
    EXPECT_NEAR(lens_radius(50, 2), 0.0125, 1e-12);
}

TEST(CircleOfConfusion, OfAHighlightInTheTruthIsTheFormula) {
    // A uniform disc of diameter D has the variance D^2/16 along each axis. The lamp, a square of
    // half side 3 pixels across the axis, adds 3^2/3 and the pixel's box 1/12.
    for (auto [z, focus, f_stop] :
         {std::tuple{1.0, 2.0, 0.25}, {4.0, 2.0, 0.08}, {1.5, 1.2, 0.1}}) {
        const double expected = circle_of_confusion_px(50, f_stop, 36, focus, z, kSide);
        ASSERT_GT(expected, 7);
        SceneModel model = empty_model(focus, f_stop);
        const double half = 3 * z / kF;
        model.objects = {unlit(rectangle(half, half, still(at({0, 0, z})), {}), {30, 30, 30})};
        const ScenePlanes planes = render(model, settings_of(512, 0, true));
        const Moments m = moments_of(planes.color);
        for (double variance : {m.xx, m.yy})
            EXPECT_NEAR(4 * std::sqrt(variance - 3 - 1.0 / 12) / expected, 1, 0.015) << "z " << z;
        EXPECT_NEAR(m.x, 36, 0.05);
        EXPECT_NEAR(m.y, 36, 0.05);
        EXPECT_NEAR(m.sum / (30 * 36), 1, 0.005) << "energy";
    }
}

// A point light behind the focus seen through an aperture: mean and second moments of its disc, in
// radii, at x, y pixels from the center of an image of width x width, of a lens of 400 pixels per
// unit slope.
Moments through(const SceneModel& shape, double x, double y, int width = kSide) {
    SceneModel model = shape;
    const double focal = 4 * kF * 36 / width;
    model.camera = [=](double) { return CameraPose{Pose{}, focal, 2}; };
    model.lens.f_stop = focal / 156.25;  // the same radius of the lens
    const double z = 4, px = z / (4 * kF);
    model.objects = {
        unlit(rectangle(3 * px, 3 * px, still(at({x * px, -y * px, z})), {}), {30, 30, 30})};
    RenderSettings settings = settings_of(128, 0, true);
    settings.width = settings.height = width;
    Moments m = moments_of(render(model, settings).color);
    EXPECT_NEAR(m.sum / (30 * 36), 1, 0.04) << "energy";
    const double radius = 0.5 * circle_of_confusion_px(focal, *model.lens.f_stop, 36, 2, z, width);
    for (double* variance : {&m.xx, &m.yy})
        *variance = (*variance - 3 - 1.0 / 12) / (radius * radius);
    m.x = (m.x - width / 2 - x) / radius;
    m.y = (m.y - width / 2 - y) / radius;
    return m;
}

TEST(ApertureOfTheTruth, HasTheMomentsOfItsShape) {
    SceneModel model = empty_model(2, 1);
    model.lens.aperture_blades = 3;
    Moments m = through(model, 0, 0);
    EXPECT_NEAR(m.xx, (2 + std::cos(2 * M_PI / 3)) / 12, 0.004);
    EXPECT_NEAR(m.yy, (2 + std::cos(2 * M_PI / 3)) / 12, 0.004);
    model.lens.aperture_curvature = 1;
    EXPECT_NEAR(through(model, 0, 0).xx, 0.25, 0.008);
    model.lens.aperture_blades = 0;
    model.lens.aperture_ratio = 2;
    m = through(model, 0, 0);
    EXPECT_NEAR(m.xx, 1.0 / 16, 0.003);
    EXPECT_NEAR(m.yy, 1.0 / 4, 0.008);
}

// The right half of a disc, whose lower quarter transmits a third of the light: with the quarters'
// moments k = 4/(3 pi) and 1/4, weights 3/4 and 1/4.
TEST(ApertureOfTheTruth, HasTheMomentsOfItsPicture) {
    constexpr int kCells = BokehKernel::kSide;
    std::vector<float> values(kCells * kCells);
    for (int y = 0; y < kCells; ++y)
        for (int x = kCells / 2; x < kCells; ++x)
            values[size_t(y * kCells + x)] = y < kCells / 2 ? 1.0f : 1.0f / 3;
    SceneModel model = empty_model(2, 1);
    model.lens.aperture_image = *BokehKernel::make(values);
    const double k = 4 / (3 * M_PI);
    Moments m = through(model, 0, 0);
    EXPECT_NEAR(m.x, k, 0.01);
    EXPECT_NEAR(m.y, -k / 2, 0.01);
    EXPECT_NEAR(m.xx, 0.25 - k * k, 0.008);
    EXPECT_NEAR(m.yy, 0.25 - k * k / 4, 0.008);
    // Counterclockwise: the right moves to the top, the upper quarter to the left.
    model.lens.aperture_rotation_deg = 90;
    m = through(model, 0, 0);
    EXPECT_NEAR(m.x, -k / 2, 0.01);
    EXPECT_NEAR(m.y, -k, 0.01);
    model.lens.aperture_ratio = 2;
    m = through(model, 0, 0);
    EXPECT_NEAR(m.x, -k / 4, 0.01);
    EXPECT_NEAR(m.y, -k, 0.01);
}

// Behind the focus, the barrel's remaining area is shifted to the image center: by half of cats_eye
// in a corner, which is 144 sqrt(2) pixels away.
TEST(ApertureOfTheTruth, IsCutAwayFromTheMiddle) {
    SceneModel model = empty_model(2, 1);
    model.lens.cats_eye = 0.8;
    const Moments m = through(model, 72, 72, 4 * kSide);
    EXPECT_NEAR(m.x, -0.5 * 0.4 * std::sqrt(0.5), 0.02);
    EXPECT_NEAR(m.y, -0.5 * 0.4 * std::sqrt(0.5), 0.02);
    const Moments middle = through(model, 0, 0);
    EXPECT_NEAR(middle.x, 0, 0.01);
    EXPECT_NEAR(middle.xx, 0.25, 0.008);
}

// A corner on the right, behind the focus: uneven light has a third moment.
TEST(ApertureOfTheTruth, IsUprightBehindTheFocus) {
    SceneModel model = empty_model(2, 0.08);
    model.lens.aperture_blades = 3;
    model.lens.aperture_rotation_deg = -60;
    for (const double z : {4.0, 1.4}) {
        model.objects = {
            unlit(rectangle(0.01 * z, 0.01 * z, still(at({0, 0, z})), {}), {90, 90, 90})};
        const ImageF color = render(model, settings_of(512, 0, true)).color;
        double third = 0;
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) third += color.at(x, y) * std::pow(x + 0.5 - 36, 3);
        EXPECT_GT(z > 2 ? third : -third, 0) << z;
    }
}

TEST(Shutter, AStreakIsMotionTimesShutter) {
    // F v / z = 100 * 0.32 / 2 = 16 pixels per frame; a uniform streak of length L has the variance
    // L^2/12. The lamp, a disc of radius 3 pixels, adds 9/4, the pixel's box 1/12.
    for (double shutter : {0.25, 0.5, 1.0}) {
        const SceneModel model = one_lamp(
            [](double t) {
                return at({0.32 * (t - 2), 0, 2});
            },
            0.06, 2, 2);
        RenderSettings settings = settings_of(256, shutter, false);
        settings.time = 2;
        const Moments m = moments_of(render(model, settings).color);
        EXPECT_NEAR(std::sqrt(12 * (m.xx - 2.25 - 1.0 / 12)), 16 * shutter, 0.01 * 16 * shutter);
        EXPECT_NEAR(m.yy, 2.25 + 1.0 / 12, 0.06);
        EXPECT_NEAR(m.x, 36, 0.05);  // the shutter is centered on the frame
    }
}

TEST(Truth, TheNoiseChangesBetweenFrames) {
    RenderSettings settings = settings_of(4, 0, true);
    const SceneModel model = one_lamp(still(at({0, 0, 1})), 0.05, 2, 0.35);
    settings.seed = 1;
    const ScenePlanes a = render(model, settings);
    settings.seed = 2;
    EXPECT_NE(render(model, settings).color, a.color);
}

// The images of a frame: each is rendered with the shutter and the lens that its name says.
TEST(Truth, EachImageHasItsShutterAndItsLens) {
    SceneRequest request;
    request.name = "wheels";
    request.width = request.height = kSide;
    request.truth_samples = 4;
    request.camera.shutter_frames = 0.7;
    const SceneModel model = postchain::test::must(model_for(request));
    for (const auto& [picture, shutter, lens] : {std::tuple{Picture::mb, 0.7, false},
                                                 {Picture::dof, 0.0, true},
                                                 {Picture::both, 0.7, true}}) {
        RenderSettings settings = settings_of(4, shutter, lens);
        settings.time = settings.seed = 3;
        EXPECT_EQ(postchain::test::must(render_frame(renderer(), request, 3, picture)).color,
                  render(model, settings).color)
            << name_of(picture);
    }
}

TEST(Truth, StopsWhenToldTo) {
    int calls = 0;
    auto planes = renderer().render(empty_model(), settings_of(64, 0.5, true), [&](double done) {
        EXPECT_GT(done, 0);
        return ++calls < 3;
    });
    ASSERT_FALSE(planes.ok());
    EXPECT_EQ(planes.status().code(), StatusCode::canceled);
    EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace postchain::scenes::test::truth_test
