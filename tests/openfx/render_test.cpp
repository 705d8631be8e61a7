// Pixels: those of the command, whatever the layout of the host's images.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "config/chain_find.h"
#include "tests/openfx/test_host.h"
#include "tests/run/fixture.h"
#include "tests/support/images.h"
#include "tests/support/text_file.h"

namespace postchain::openfx::test {
namespace {

using postchain::test::Planes;
using ::testing::HasSubstr;

constexpr int kWidth = 61, kHeight = 43;

struct Lens {
    const char* key;
    double value;
};
constexpr Lens kLens[] = {{"focal_length_mm", 50},
                          {"sensor_width_mm", 36},
                          {"f_stop", 1.4},
                          {"focus_distance", 2},
                          {"meters_per_unit", 0.05}};

ImageF scaled(ImageF image, float x, float y) {
    for (size_t i = 0; i < image.pixels(); ++i) {
        image.data[2 * i] *= x;
        image.data[2 * i + 1] *= y;
    }
    return image;
}

// Vectors from the frame before and to the next differ. The upper rows are sky.
Planes uneven_planes(int width, int height, int frame) {
    Planes planes = postchain::test::make_planes(width, height, frame);
    planes.back = scaled(planes.back, 0.75f, 0.5f);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < width; ++x) {
            planes.depth.at(x, y) = std::numeric_limits<float>::infinity();
            for (ImageF* vectors : {&planes.motion, &planes.back})
                std::fill_n(vectors->pixel(x, y), 2, 0.0f);
        }
    return planes;
}

// Frames 1 to 3 as Cycles writes them: Vector as R G B A.
ImageF cycles_vectors(const Planes& planes) {
    return joined(scaled(planes.back, -1, 1), scaled(planes.motion, -1, 1));
}

// `left`, `bottom`: of the images, pixels.
void connect_scene(Node& node, int width = kWidth, int height = kHeight, int left = 0,
                   int bottom = 0) {
    const auto feed = [=](auto plane) {
        return [=](double time) -> std::optional<Picture> {
            return Picture{
                .pixels = plane(uneven_planes(width, height, int(time))), .x = left, .y = bottom};
        };
    };
    node.connect("Source", feed([](const Planes& p) { return p.color; }), 1, 3);
    node.connect("Depth", feed([](const Planes& p) { return p.depth; }), 1, 3);
    node.connect("Motion", feed(cycles_vectors), 1, 3);
    node.choose("motion_meaning", "cycles");
}

void set_lens(Node& node) {
    for (const Lens& one : kLens) node.use(one.key, one.value);
}

class OpenFx : public sequence::SequenceTest {
  protected:
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.on_existing = io::OnExisting::overwrite;
        write_frames(1);
        std::string camera;
        for (const Lens& one : kLens)
            camera += concat(camera.empty() ? "" : ", ", "\"", one.key, "\": ", one.value);
        auto file = parse_camera("{" + camera + "}", "camera.json");
        EXPECT_TRUE(file.status().ok()) << file.status().message();
        settings_.source.camera = std::move(file);
    }
    void write_frames(float pixel_aspect, postchain::test::FrameFile file = {}) {
        file.attributes = {{"pixelAspectRatio", pixel_aspect}};
        for (const int frame : {1, 2, 3})
            postchain::test::write_frame(in(frame), uneven_planes(kWidth, kHeight, frame), file);
    }
    // Frame 2 by the command's own functions.
    ImageF of_command(Chain chain) {
        chain_ = std::move(chain);
        const auto summary = go();
        EXPECT_TRUE(summary.ok()) << summary.status().message();
        return postchain::test::read_color(out(2));
    }
    ImageF of_command(const std::string& shipped) {
        return of_command(std::move(load_chain(shipped, builtin_passes())->chain));
    }
    Host host_;
};

TEST_F(OpenFx, AChainHasTheBitsOfTheCommand) {
    Node node(host_, "postchain.chain", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    // `balanced` reads the frames before and after.
    for (const char* chain : {"balanced", "paper"}) {
        node.choose("chain", chain);
        EXPECT_EQ(node.rendered(2), of_command(chain)) << chain << "\n" << node.message();
    }
}

// Cycles writes neither the motion of the sky nor the zoom's part of it.
TEST_F(OpenFx, ACameraThatTurnsAndZoomsHasTheBitsOfTheCommand) {
    const std::string path = folder_.path("camera.json");
    settings_.source.camera_motion = sequence::CameraMotion::zoom;
    Node node(host_, "postchain.joint_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 5);
    node.set("camera_file", path);
    const auto write_camera = [&](const std::string& more) {
        postchain::test::write_text(
            path, concat(R"({"sensor_width_mm": 36, "f_stop": 1.4, "focus_distance": 2,
                             "meters_per_unit": 0.05, "focal_length_mm": 50)",
                         more, "}"));
    };
    const auto of_both = [&](const std::string& more) {
        write_camera(more);
        settings_.source.camera = parse_camera(postchain::test::read_text(path), path);
        EXPECT_TRUE(settings_.source.camera->status().ok()) << more;
        const ImageF color =
            of_command(postchain::test::chain_of("joint_blur", {{"samples", int64_t(5)}}));
        EXPECT_EQ(node.rendered(2), color) << more;
        return color;
    };
    const std::string zoom = R"(, "frames": {"1": {"focal_length_mm": 40},
        "2": {"focal_length_mm": 50}, "3": {"focal_length_mm": 60}})";
    // About y.
    const std::string turn = R"(, "camera_matrix_world": {
        "1": [[0.96, 0, -0.28, 0], [0, 1, 0, 0], [0.28, 0, 0.96, 0], [0, 0, 0, 1]],
        "2": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        "3": [[0.96, 0, 0.28, 0], [0, 1, 0, 0], [-0.28, 0, 0.96, 0], [0, 0, 0, 1]]})";
    const std::vector<ImageF> all = {of_both(""), of_both(zoom), of_both(turn),
                                     of_both(zoom + turn)};
    for (size_t a = 0; a < all.size(); ++a)
        for (size_t b = 0; b < a; ++b) EXPECT_NE(all[a], all[b]) << a << b;
    // Across a cut the sky takes no motion from the other camera.
    for (const int cut : {1, 2}) {
        settings_.source.cuts = {cut};
        node.animate("cut", [=](double time) { return time == cut ? 1 : 0; });
        EXPECT_NE(of_both(zoom + turn), all[3]) << cut;
    }
    node.animate("cut", [](double) { return 0; });
    // Vectors of other renderers have the zoom.
    node.choose("motion_meaning", "nuke");
    write_camera(zoom);
    const ImageF zooming = node.rendered(2);
    write_camera("");
    EXPECT_EQ(node.rendered(2), zooming);
}

TEST_F(OpenFx, AnEffectHasTheBitsOfItsPass) {
    Node node(host_, "postchain.joint_blur", kWidth, kHeight);
    connect_scene(node);
    for (const Lens& one : kLens)
        if (one.key != std::string("focus_distance")) node.use(one.key, one.value);
    node.set("samples", 9);
    node.set("seed", 5);
    std::vector<ImageF> colors;
    // Square pixels, and pixels twice as wide, whose canonical coordinates are too.
    for (const double aspect : {1.0, 2.0}) {
        write_frames(float(aspect));
        const double width = aspect * kWidth;
        node.object().properties.set("OfxImageEffectPropProjectSize", {width, double(kHeight)});
        for (auto& [name, clip] : node.object().clips)
            clip.properties.set("OfxImagePropPixelAspectRatio", {aspect});
        node.use("focus_at", 0.5 * width, 0.75 * kHeight);
        colors.push_back(of_command(postchain::test::chain_of(
            "joint_blur",
            {{"samples", int64_t(9)}, {"seed", int64_t(5)}, {"focus_at", std::array{0.5, 0.25}}})));
        EXPECT_EQ(node.rendered(2), colors.back()) << aspect;
        EXPECT_NE(colors.back(), uneven_planes(kWidth, kHeight, 2).color);
    }
    EXPECT_NE(colors[0], colors[1]);
    // Overscan of another width on each side: 5 pixels at the left, 7 at the top. The place in
    // focus is at the upper left corner of the square, whose pixels are most of those around it.
    constexpr int kLeft = 5, kTop = 7, kBottom = 2,
                  kDisplay[] = {kWidth - kLeft - 3, kHeight - kTop - kBottom};
    write_frames(2, {.origin_x = -kLeft,
                     .origin_y = -kTop,
                     .display = io::Window{0, 0, kDisplay[0] - 1, kDisplay[1] - 1}});
    node.object().properties.set("OfxImageEffectPropProjectSize",
                                 {2.0 * kDisplay[0], double(kDisplay[1])});
    connect_scene(node, kWidth, kHeight, -kLeft, -kBottom);
    for (auto& [name, clip] : node.object().clips)
        clip.properties.set("OfxImagePropPixelAspectRatio", {2.0});
    const auto planes = uneven_planes(kWidth, kHeight, 2);
    const int x = 22, y = 14;
    ASSERT_TRUE(planes.depth.at(x - 1, y - 1) == 2 && planes.depth.at(x - 2, y) == 6 &&
                planes.depth.at(x, y - 2) == 6);
    const std::array<double, 2> place = {(x + 0.5 - kLeft) / kDisplay[0],
                                         (y + 0.5 - kTop) / kDisplay[1]};
    node.use("focus_at", 2 * (x + 0.5 - kLeft), kDisplay[1] - (y + 0.5 - kTop));
    node.object().output = {.pixels = ImageF(kWidth, kHeight, 4), .x = -kLeft, .y = -kBottom};
    EXPECT_EQ(
        node.rendered(2),
        of_command(postchain::test::chain_of(
            "joint_blur", {{"samples", int64_t(9)}, {"seed", int64_t(5)}, {"focus_at", place}})));
}

// Where the image is, how its rows lie, and which part of it is asked for change no bit.
TEST(Pixels, BoundsAndRowsOfTheHost) {
    Host host;
    Node plain(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(plain);
    plain.set("samples", 5);
    const ImageF expected = plain.rendered(2);
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    node.set("samples", 4);  // an odd number is read
    node.object().properties.set("OfxImageEffectPropProjectOffset", {-7.0, -100.0});
    const auto feed = [](auto plane) {
        return [=](double time) -> std::optional<Picture> {
            return Picture{.pixels = plane(uneven_planes(kWidth, kHeight, int(time))),
                           .x = -7,
                           .y = -100,
                           .negative_rows = true,
                           .padding = 12};
        };
    };
    node.connect("Source", feed([](const Planes& p) { return p.color; }), 1, 3);
    node.connect("Depth", feed([](const Planes& p) {
                     return arranged(p.depth, {-1, 0, -1, -1});
                 }),
                 1, 3);
    node.choose("depth_channel", "G");
    node.connect("Motion", feed([](const Planes& p) {
                     return joined(scaled(p.motion, 1, -1), scaled(p.back, -1, 1));
                 }),
                 1, 3);
    node.choose("motion_meaning", "nuke");
    Picture& output = node.object().output;
    output = {.pixels = ImageF(kWidth, kHeight, 4, -5), .x = -7, .y = -100, .negative_rows = true};
    EXPECT_EQ(node.render(2), kStatOK) << node.message();
    EXPECT_EQ(output.pixels, expected);
    output.pixels = ImageF(kWidth, kHeight, 4, -5);
    EXPECT_EQ(node.render(2, {3, -90, 20, -80}), kStatOK);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const int host_x = x - 7, host_y = -100 + kHeight - 1 - y;
            const bool inside = host_x >= 3 && host_x < 20 && host_y >= -90 && host_y < -80;
            ASSERT_EQ(output.pixels.at(x, y, 1), inside ? expected.at(x, y, 1) : -5)
                << x << " " << y;
        }
}

// Color without an alpha is opaque, and an image without some channels gets those that it has.
TEST(Pixels, ImagesOfFewerChannels) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 3);
    node.choose("neighbors", "none");
    ImageF color = uneven_planes(kWidth, kHeight, 2).color;
    for (size_t i = 0; i < color.pixels(); ++i) color.data[4 * i + 3] = 1;
    node.connect("Source", Picture{.pixels = color});
    const ImageF expected = node.rendered(2);
    node.connect("Source", Picture{.pixels = arranged(color, {0, 1, 2})});
    EXPECT_EQ(node.rendered(2), expected);
    for (const auto& channels : {std::vector{0, 1, 2}, {3}}) {
        node.object().output.pixels = ImageF(kWidth, kHeight, int(channels.size()), -5);
        EXPECT_EQ(node.render(2), kStatOK);
        EXPECT_EQ(node.object().output.pixels, arranged(expected, channels));
    }
}

// A window that the output does not have is no fault, and neither is a host without a pixel aspect.
TEST(Pixels, NothingIsAskedFor) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 3);
    const ImageF expected = node.rendered(2);
    for (const double aspect : {0.0, -1.0}) {
        for (auto& [name, clip] : node.object().clips)
            clip.properties.set("OfxImagePropPixelAspectRatio", {aspect});
        EXPECT_EQ(node.rendered(2), expected);
    }
    node.object().output.pixels = ImageF(kWidth, kHeight, 4, -5);
    for (const auto& window : {std::array{kWidth, 0, kWidth + 9, kHeight},
                               {-9, 0, 0, kHeight},
                               {0, kHeight, kWidth, kHeight + 9},
                               {3, 3, 3, 9}})
        EXPECT_EQ(node.render(2, window), kStatOK) << node.message();
    EXPECT_EQ(node.object().output.pixels, ImageF(kWidth, kHeight, 4, -5));
}

TEST(Pixels, HalvesAreWithinTheirStep) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.choose("neighbors", "none");
    const ImageF floats = node.rendered(2);
    node.connect("Source", Picture{.pixels = uneven_planes(kWidth, kHeight, 2).color,
                                   .depth = "OfxBitDepthHalf"});
    node.object().output.depth = "OfxBitDepthHalf";
    const ImageF halves = node.rendered(2);
    // Half a step of the input and of the output each, for values below 1.
    EXPECT_LE(postchain::test::largest_difference(floats, halves), 0x1p-11);
    EXPECT_NE(halves, floats);
}

// Color without its alpha is filtered with it, and handed back without.
TEST(Pixels, Unpremultiplied) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    ImageF color = uneven_planes(kWidth, kHeight, 2).color, divided = color;
    for (size_t i = 0; i < color.pixels(); ++i) {
        const float alpha = i % 3 == 0 ? 0.5f : 0.25f;
        color.data[4 * i + 3] = divided.data[4 * i + 3] = alpha;
        for (size_t c = 0; c < 3; ++c) color.data[4 * i + c] *= alpha;
    }
    node.connect("Source", Picture{.pixels = color});
    ImageF expected = node.rendered(2);
    node.connect("Source",
                 Picture{.pixels = divided, .premultiplication = "OfxImageAlphaUnPremultiplied"});
    node.object().output.premultiplication = "OfxImageAlphaUnPremultiplied";
    ImageF found = node.rendered(2);
    EXPECT_NE(found, expected);
    node.object().output.premultiplication = "OfxImageAlphaPremultiplied";
    EXPECT_LE(postchain::test::largest_difference(node.rendered(2), expected), 1e-6);
    for (size_t i = 0; i < found.pixels(); ++i)
        for (size_t c = 0; c < 3; ++c) found.data[4 * i + c] *= found.data[4 * i + 3];
    EXPECT_LE(postchain::test::largest_difference(found, expected), 1e-6);
}

// Means of blocks of `side` pixels.
ImageF reduced(const ImageF& image, int side) {
    ImageF small(image.width / side, image.height / side, image.channels);
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x)
            for (int c = 0; c < image.channels; ++c) {
                double sum = 0;
                for (int j = 0; j < side; ++j)
                    for (int i = 0; i < side; ++i) sum += image.at(side * x + i, side * y + j, c);
                small.at(x, y, c) = float(sum / (side * side));
            }
    return small;
}

double rms(const ImageF& a, const ImageF& b) {
    double sum = 0;
    for (size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
    return std::sqrt(sum / double(a.data.size()));
}

// A proxy looks as the whole frame does, far closer than with vectors or limits of another size.
TEST(Pixels, ProxiesAreBlurredAlike) {
    constexpr int kLong = 160, kShort = 32;
    Host host;
    for (const bool upright : {false, true}) {
        const int wide = upright ? kShort : kLong, high = upright ? kLong : kShort;
        ImageF color(wide, high, 4, 1), motion(wide, high, 4);
        for (size_t i = 0; i < color.pixels(); ++i) {
            const size_t along = upright ? i / size_t(wide) : i % size_t(wide);
            color.data[4 * i] = float(0.5 + 0.4 * std::sin(0.05 * double(along)));
            motion.data[4 * i + size_t(upright)] = 80;
        }
        for (const bool limited : {false, true}) {
            Node node(host, "postchain.motion_blur", wide, high);
            node.choose("neighbors", "none");
            if (limited) node.use("max_blur_px", 16);
            const auto render = [&](int side) {
                node.object().scale_x = node.object().scale_y = 1.0 / side;
                node.connect("Source", Picture{.pixels = reduced(color, side)});
                node.connect("Depth", Picture{.pixels = ImageF(wide / side, high / side, 1, 5)});
                node.connect("Motion", Picture{.pixels = reduced(motion, side)});
                node.object().output.pixels = ImageF(wide / side, high / side, 4);
                return node.rendered(2);
            };
            const ImageF whole = render(1);
            EXPECT_GT(rms(whole, color), 0.01);
            for (const int side : {2, 4}) {
                const double alike = rms(render(side), reduced(whole, side));
                EXPECT_LT(alike, 0.25 * rms(reduced(color, side), reduced(whole, side))) << side;
            }
        }
    }
}

// A crop has the bits of a whole frame that is clear and far away outside of it.
TEST(Pixels, ACropIsClearAround) {
    constexpr int kLeft = 9, kBottom = 5, kWide = 31, kHigh = 27;
    Host host;
    Node node(host, "postchain.joint_blur", kWidth, kHeight);
    set_lens(node);
    node.choose("neighbors", "none");
    node.choose("motion_meaning", "cycles");
    node.set("samples", 9);
    const Planes planes = uneven_planes(kWidth, kHeight, 2);
    const auto render = [&](bool whole) {
        const auto connect = [&](const char* clip, const ImageF& plane, float outside) {
            const int width = whole ? kWidth : kWide, height = whole ? kHeight : kHigh;
            ImageF image(width, height, plane.channels, outside);
            const int top = kHeight - kBottom - kHigh;  // rows go down
            for (int y = 0; y < kHigh; ++y)
                std::copy_n(plane.pixel(kLeft, top + y), kWide * plane.channels,
                            whole ? image.pixel(kLeft, top + y) : image.pixel(0, y));
            node.connect(clip, Picture{.pixels = std::move(image),
                                       .x = whole ? 0 : kLeft,
                                       .y = whole ? 0 : kBottom});
        };
        connect("Source", planes.color, 0);
        connect("Depth", planes.depth, 1e10f);
        connect("Motion", cycles_vectors(planes), 0);
        return node.rendered(2);
    };
    const ImageF expected = render(true);
    EXPECT_EQ(render(false), expected);
    EXPECT_NE(expected, planes.color);
    EXPECT_EQ(node.changed("samples", 2), kStatOK);
    EXPECT_THAT(node.status(), testing::Not(HasSubstr("pixels with"))) << "no fault of its depth";
}

// The same vectors and depths in each meaning give the same frame.
TEST(Pixels, MeaningsOfVectorsAndDepth) {
    Host host;
    Node node(host, "postchain.joint_blur", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    node.choose("neighbors", "none");
    node.choose("motion_channels", "BA forward");
    const ImageF expected = node.rendered(2);
    const Planes planes = uneven_planes(kWidth, kHeight, 2);
    const auto closeness = [&](const char* meaning, float x, float y, const char* channels,
                               std::vector<int> order) {
        node.choose("motion_meaning", meaning);
        node.choose("motion_channels", channels);
        node.connect("Motion", Picture{.pixels = arranged(scaled(planes.motion, x, y), order)});
        return postchain::test::largest_difference(node.rendered(2), expected);
    };
    const std::vector<int> rg = {0, 1, -1, -1}, ba = {-1, -1, 0, 1};
    EXPECT_EQ(closeness("to_next", 1, -1, "RG forward", rg), 0);
    EXPECT_EQ(closeness("to_next", 1, -1, "BA forward", ba), 0);
    EXPECT_EQ(closeness("from_previous", 1, -1, "RG forward", rg), 0);
    EXPECT_EQ(closeness("to_previous", -1, 1, "RG forward", rg), 0);
    EXPECT_EQ(closeness("arnold", 1, -1, "as motion_meaning has them", rg), 0);
    EXPECT_EQ(closeness("generic", 1, 1, "RG forward", rg), 0);
    EXPECT_LT(closeness("uv", 1.f / kWidth, -1.f / kHeight, "RG forward", rg), 1e-3);
    EXPECT_LT(closeness("ndc", 2.f / kWidth, -2.f / kHeight, "RG forward", rg), 1e-3);
    EXPECT_GT(closeness("to_next", 1, 1, "RG forward", rg), 1e-2);
    node.choose("motion_meaning", "generic");
    const auto both = [&](const char* channels, const ImageF& first, const ImageF& second) {
        node.choose("motion_channels", channels);
        node.connect("Motion", Picture{.pixels = joined(first, second)});
        return node.rendered(2);
    };
    const ImageF back = scaled(planes.motion, -0.5f, 1.5f);
    const ImageF two = both("as motion_meaning has them", planes.motion, back);
    EXPECT_EQ(both("RG forward, BA backward", planes.motion, back), two);
    EXPECT_EQ(both("BA forward, RG backward", back, planes.motion), two);
    EXPECT_NE(both("RG forward, BA backward", back, planes.motion), two);
    node.set("motion_scale", 1, -1);
    EXPECT_EQ(closeness("to_next", 1, 1, "RG forward", rg), 0);

    const auto with_depth = [&](const char* meaning, auto stored) {
        ImageF depth = planes.depth;
        for (float& value : depth.data) value = float(stored(double(value)));
        node.choose("depth_meaning", meaning);
        node.connect("Depth", Picture{.pixels = depth});
        return postchain::test::largest_difference(node.rendered(2), expected);
    };
    EXPECT_LT(with_depth("inverse", [](double d) { return 1 / d; }), 1e-3);
    node.use("near_clip", 1);
    node.use("far_clip", 9);
    EXPECT_EQ(with_depth("normalized", [](double d) { return (d - 1) / 8; }), 0);
    EXPECT_EQ(with_depth("normalized_inverted", [](double d) { return 1 - (d - 1) / 8; }), 0);
    // Pixels that a crop lacks are as far away as in each other meaning.
    node.connect("Source", Picture{.pixels = ImageF(10, 8, 4, 1), .x = 20, .y = 9});
    ImageF cropped[2];
    for (const auto& [at, meaning, value] :
         {std::tuple(0, "linear", 5.f), {1, "normalized", 0.5f}}) {
        node.choose("depth_meaning", meaning);
        node.connect("Depth", Picture{.pixels = ImageF(10, 8, 1, value), .x = 20, .y = 9});
        cropped[at] = node.rendered(2);
    }
    EXPECT_EQ(cropped[0], cropped[1]);
    node.connect("Source", Picture{.pixels = planes.color});
    EXPECT_GT(with_depth("linear", [](double d) { return 1 / d; }), 1e-2);
}

}  // namespace
}  // namespace postchain::openfx::test
