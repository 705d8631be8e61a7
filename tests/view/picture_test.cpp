// The place of drawing: the view's zoom and pan, the paint of images, the camera's keys.
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "tools/apps/view/paint.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/view_port.h"
#include "tools/sequence/files/json.h"

namespace postchain::view {
namespace {

TEST(ViewPort, TheImageFitsAndStaysFitted) {
    ViewPort port;
    port.set(640, 360, 1, {1280, 800});
    EXPECT_DOUBLE_EQ(port.zoom(), 2);
    EXPECT_EQ(port.to_screen({0, 0}), (Point{0, 40}));
    EXPECT_EQ(port.to_image({1280, 760}), (Point{640, 360}));
    port.set(640, 360, 1, {320, 800});
    EXPECT_DOUBLE_EQ(port.zoom(), 0.5);
    EXPECT_EQ(port.visible(), (Rect{0, 0, 640, 360}));
}

TEST(ViewPort, ZoomKeepsThePointUnderTheCursor) {
    ViewPort port;
    port.set(640, 360, 1, {1280, 800});
    const Point at = {300, 200}, before = port.to_image(at);
    port.zoom_at(at, 3);
    EXPECT_DOUBLE_EQ(port.zoom(), 6);
    EXPECT_NEAR(port.to_image(at)[0], before[0], 1e-9);
    EXPECT_NEAR(port.to_image(at)[1], before[1], 1e-9);
    port.pan(60, -30);
    EXPECT_NEAR(port.to_image(at)[0], before[0] - 10, 1e-9);
    EXPECT_NEAR(port.to_image(at)[1], before[1] + 5, 1e-9);
    port.one_to_one();
    EXPECT_DOUBLE_EQ(port.zoom(), 1);
    for (int i = 0; i < 1000; ++i) port.zoom_at(at, 1.5);
    EXPECT_LE(port.zoom(), 64);
    EXPECT_FALSE(port.visible().empty());
}

TEST(ViewPort, PixelsThatAreNotSquare) {
    ViewPort port;
    port.set(100, 100, 2, {400, 400});
    EXPECT_DOUBLE_EQ(port.zoom(), 2) << "the image is twice as wide as high";
    EXPECT_EQ(port.to_screen({100, 0}), (Point{400, 100}));
}

// A window of one pixel, no image yet.
TEST(ViewPort, SmallestSizes) {
    ViewPort port;
    port.set(0, 0, 1, {0, 0});
    port.zoom_at({0, 0}, 2);
    EXPECT_TRUE(port.visible().empty());
    port.set(4096, 2160, 1, {1, 1});
    EXPECT_GT(port.zoom(), 0);
    EXPECT_FALSE(port.visible().empty());
}

TEST(Paint, OneChannelIsGray) {
    ImageF image(1, 1, 4);
    image.data = {0.25f, 0.5f, 1.0f, 0.2f};
    io::PreviewOptions view;
    view.curve = io::ToneCurve::none;
    const Rgba color = *painted(image, Look::color, view);
    const std::pair<Channel, int> cases[] = {{Channel::red, color.data[0]},
                                             {Channel::green, color.data[1]},
                                             {Channel::blue, color.data[2]},
                                             {Channel::alpha, 51}};
    for (const auto& [channel, value] : cases) {
        Rgba shown = color;
        show_channel(shown, image, channel);
        for (size_t c = 0; c < 3; ++c) EXPECT_EQ(shown.data[c], value) << int(channel);
    }
    Rgba opaque = color;
    show_channel(opaque, ImageF(1, 1, 3), Channel::alpha);
    EXPECT_EQ(opaque.data[0], 255);
}

TEST(Paint, ColorIsThePreviewsColor) {
    ImageF color(2, 1, 4);
    color.data = {0, 0.5f, 1, 1, 4, -1, std::numeric_limits<float>::quiet_NaN(), 0};
    io::PreviewOptions view;
    view.exposure_stops = 1;
    const auto rgba = painted(color, Look::color, view);
    const auto bytes = io::shown_image(color, view);
    ASSERT_TRUE(rgba.ok() && bytes.ok());
    for (int x = 0; x < 2; ++x)
        for (int c = 0; c < 3; ++c) EXPECT_EQ(rgba->at(x, 0, c), bytes->at(x, 0, c));
    EXPECT_EQ(rgba->at(1, 0, 3), 255);
}

TEST(Paint, ValuesSpanBlackToWhite) {
    ImageF depth(3, 1, 1);
    depth.data = {2, std::numeric_limits<float>::infinity(), 6};
    std::string legend;
    const auto rgba = painted(depth, Look::values, {}, &legend);
    ASSERT_TRUE(rgba.ok());
    EXPECT_EQ(rgba->at(0, 0), 0);
    EXPECT_EQ(rgba->at(2, 0), 255);
    EXPECT_EQ(legend, "black 2 .. white 6");
}

TEST(Paint, VectorsHaveTheHueOfTheirDirection) {
    ImageF motion(4, 1, 2);
    motion.data = {5, 0, -2.5f, 0, 0, 0, 0, 5};
    const auto rgba = painted(motion, Look::vectors, {});
    ASSERT_TRUE(rgba.ok());
    const auto pixel = [&](int x) {
        return std::vector<int>{rgba->at(x, 0, 0), rgba->at(x, 0, 1), rgba->at(x, 0, 2)};
    };
    EXPECT_EQ(pixel(0), (std::vector<int>{255, 0, 0}));
    for (const auto& [channel, value] : {std::pair(0, 0), {1, 128}, {2, 128}})
        EXPECT_NEAR(pixel(1)[size_t(channel)], value, 1);
    EXPECT_EQ(pixel(2), (std::vector<int>{0, 0, 0}));
    EXPECT_NE(pixel(3), pixel(0));
}

TEST(Paint, LimitsOfSharpnessAreLinesBetweenPixels) {
    ImageF inverse_depth(6, 1, 1);
    inverse_depth.data = {1, 0.5f, 0.5f, 0.25f, 0.25f, 0};  // 1, 2, 2, 4, 4 units, sky
    const Rgba lines = sharpness_limits(inverse_depth, 1.5, 3);
    for (int x = 0; x < 5; ++x) EXPECT_EQ(lines.at(x, 0, 3), x == 0 || x == 2 ? 255 : 0) << x;
    EXPECT_GT(lines.at(0, 0, 0), lines.at(0, 0, 2)) << "near: orange";
    EXPECT_GT(lines.at(2, 0, 2), lines.at(2, 0, 0)) << "far: cyan";
    // Sharp to infinity: the sky is sharp as well.
    const Rgba infinite =
        sharpness_limits(inverse_depth, 1.5, std::numeric_limits<double>::infinity());
    EXPECT_EQ(infinite.at(4, 0, 3), 0);
}

// 10 log10(1/MSE) of gray steps over the visible part, by hand.
TEST(Paint, MetricsAreOfTheVisiblePart) {
    const auto gray = [](float left, float right) {
        auto image = std::make_shared<ImageF>(32, 16, 4, 1.0f);
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 32; ++x) std::fill_n(image->pixel(x, y), 3, x < 16 ? left : right);
        return image;
    };
    PaintJob job;
    job.image = gray(1, 1);
    job.other = gray(1, 3);
    job.visible = {0, 0, 16, 16};
    const auto value = [](const Painted& painted, const std::string& name) {
        for (const auto& [metric, number] : painted.metrics)
            if (metric == name) return number;
        return std::optional<double>(-1);
    };
    Painted painted = paint(job);
    ASSERT_TRUE(painted.status.ok()) << painted.status.message();
    EXPECT_FALSE(value(painted, "psnr")) << "equal there";
    job.visible = {16, 0, 16, 16};
    painted = paint(job);
    const double step = std::pow(0.75, 1 / 2.2) - std::pow(0.5, 1 / 2.2);
    EXPECT_NEAR(*value(painted, "psnr"), -20 * std::log10(step), 1e-4);
    job.map = "difference";
    painted = paint(job);
    ASSERT_TRUE(painted.map) << painted.status.message();
    EXPECT_GT(painted.map->at(20, 8, 0), painted.map->at(4, 8, 0));
    job.other = gray(1, 1);
    job.image = std::make_shared<ImageF>(16, 8, 4, 1.0f);
    painted = paint(job);
    EXPECT_TRUE(painted.status.ok()) << "a draft of another size is not measured";
    EXPECT_TRUE(painted.metrics.empty());
}

TEST(Save, KeysAreAddedToTheCameraFile) {
    const auto json = camera_with_focus(
        R"({"f_stop": 2, "frames": {"1": {"f_stop": 4}}, "comment": "x"})", {}, {{1, 1.5}, {2, 3}});
    ASSERT_TRUE(json.ok());
    const io::Json read = io::Json::parse(*json);
    EXPECT_EQ(read["f_stop"], 2);
    EXPECT_EQ(read["comment"], "x");
    EXPECT_EQ(read["frames"]["1"]["f_stop"], 4);
    EXPECT_EQ(read["frames"]["1"]["focus_distance"], 1.5);
    EXPECT_EQ(read["frames"]["2"]["focus_distance"], 3);
    EXPECT_EQ(camera_with_focus("f_stop: 2", {}, {{1, 1}}).status().code(), StatusCode::input);
    Camera values;
    values.focal_length_mm = 50;
    const auto made = camera_with_focus("", values, {{1, 1.5}});
    ASSERT_TRUE(made.ok());
    const CameraFile file = parse_camera(*made, "made");
    EXPECT_TRUE(file.status().ok()) << *made;
    EXPECT_EQ(file.camera_for(1, {}).focus_distance, 1.5);
    EXPECT_EQ(file.camera_for(1, {}).focal_length_mm, 50);
}

}  // namespace
}  // namespace postchain::view
