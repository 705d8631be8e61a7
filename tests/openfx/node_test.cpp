// Life of a node in a host's graph: identity, messages, focus, cuts, abort, many instances.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <regex>
#include <thread>

#include "tests/command/frames.h"
#include "tests/openfx/test_host.h"
#include "tests/support/environment.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tests/support/transcript.h"

namespace postchain::openfx::test::node_test {
namespace {

using postchain::test::make_planes;
using postchain::test::Planes;
using postchain::test::Transcript;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

constexpr int kWidth = 53, kHeight = 37;

ImageF vectors(const Planes& planes) {
    return joined(planes.motion, planes.back);
}

// Frames 1 to 9 in the convention `generic`.
void connect_scene(Node& node) {
    const auto feed = [](auto plane) {
        return [=](double time) -> std::optional<Picture> {
            return Picture{.pixels = plane(make_planes(kWidth, kHeight, int(time)))};
        };
    };
    node.connect("Source", feed([](const Planes& p) { return p.color; }), 1, 9);
    node.connect("Depth", feed([](const Planes& p) { return p.depth; }), 1, 9);
    node.connect("Motion", feed(vectors), 1, 9);
    node.choose("motion_meaning", "generic");
}

ImageF source(int frame = 2) {
    return make_planes(kWidth, kHeight, frame).color;
}

void set_lens(Node& node) {
    node.use("focal_length_mm", 50);
    node.use("sensor_width_mm", 36);
    node.use("f_stop", 1.4);
    node.use("focus_distance", 2);
    node.use("meters_per_unit", 0.05);
}

TEST(Identity, OfParametersWithItsReason) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    EXPECT_EQ(node.identity(2), "");
    node.use("shutter_frames", 0);
    EXPECT_EQ(node.identity(2), "Source");
    EXPECT_EQ(node.changed("shutter_frames"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("left out: motion_blur: shutter_frames is 0"));
    // Also where the plane is missing that it would need.
    node.connect("Motion", Feed());
    EXPECT_EQ(node.identity(2), "Source");
    node.animate("shutter_frames", [](double time) { return time == 2 ? 0.5 : 0; });
    EXPECT_EQ(node.identity(3), "Source");
    EXPECT_EQ(node.identity(2), "");
}

// Source passes through if the plan leaves everything out, without GL.
TEST(Identity, OfFactsIsACopyWithItsReason) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.choose("neighbors", "none");
    node.connect("Motion", Picture{.pixels = ImageF(kWidth, kHeight, 4)});
    EXPECT_EQ(node.identity(2), "");
    EXPECT_EQ(node.rendered(2), source());
    EXPECT_EQ(node.changed("samples"), kStatOK);
    EXPECT_THAT(node.status(),
                HasSubstr("left out: motion_blur: largest half-velocity 0 px <= 0.5 px"));
    EXPECT_THAT(node.status(), HasSubstr("every motion vector is zero"));
    EXPECT_THAT(node.status(), Not(HasSubstr("filtered on")));
}

TEST(Regions, FramesAndRegions) {
    Host host;
    Node node(host, "postchain.joint_blur", kWidth, kHeight);
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/openfx/expected");
    const auto say = [](const std::string& title, const auto& by_clip) {
        std::string line = title + ":";
        for (const auto& [clip, numbers] : by_clip) {
            line += " " + clip;
            for (const double number : numbers) line += concat(" ", number);
        }
        Transcript::say(line);
    };
    connect_scene(node);
    set_lens(node);
    for (const char* neighbors : {"both", "before", "none"}) {
        node.choose("neighbors", neighbors);
        say(neighbors, node.frames_needed(5));
    }
    say("regions", node.regions_of_interest(5));
    EXPECT_FALSE(node.frame_varying());
    node.set("animate_noise", 1);
    EXPECT_TRUE(node.frame_varying());
    // A cropped Source is blurred into the rest of the frame.
    node.connect("Source", Picture{.pixels = ImageF(10, 8, 4, 1), .x = 20, .y = 9});
    std::array<double, 4> region;
    EXPECT_EQ(node.region_of_definition(5, region), kStatOK);
    EXPECT_THAT(region, ElementsAre(0, 0, kWidth, kHeight));
    node.choose("frame_size", "source");
    EXPECT_EQ(node.region_of_definition(5, region), kStatOK);
    EXPECT_THAT(region, ElementsAre(20, 9, 30, 17));
    node.choose("frame_size", "project");
    for (const auto& [width, height] : {std::pair(0, kHeight), {kWidth, 0}}) {
        node.object().properties.set("OfxImageEffectPropProjectSize",
                                     {double(width), double(height)});
        EXPECT_EQ(node.region_of_definition(5, region), kStatOK);
        EXPECT_THAT(region, ElementsAre(20, 9, 30, 17)) << "a host without a project's size";
    }
    // FXAA moves no light out of Source, and asks for nothing of clips that it does not have.
    Node fxaa(host, "postchain.fxaa", kWidth, kHeight);
    fxaa.connect("Source", Picture{.pixels = ImageF(10, 8, 4, 1), .x = 20, .y = 9});
    EXPECT_EQ(fxaa.region_of_definition(5, region), kStatOK);
    EXPECT_THAT(region, ElementsAre(20, 9, 30, 17));
    EXPECT_THAT(fxaa.regions_of_interest(5),
                ElementsAre(Pair("Source", ElementsAre(20, 9, 30, 17))));
    EXPECT_THAT(fxaa.frames_needed(5), ElementsAre(Pair("Source", ElementsAre(5, 5))));
}

// Regions are in canonical coordinates, whatever the size of the render and of its pixels.
TEST(Regions, OfProxiesAndWidePixels) {
    Host host;
    for (const double aspect : {1.0, 2.0}) {
        Node node(host, "postchain.motion_blur", 48, 40);
        node.object().properties.set("OfxImageEffectPropProjectSize", {aspect * 48, 40.0});
        node.object().scale_x = 0.5, node.object().scale_y = 0.25;
        node.connect("Source", Picture{.pixels = ImageF(5, 2, 4, 1), .x = 10, .y = 2});
        for (auto& [name, clip] : node.object().clips)
            clip.properties.set("OfxImagePropPixelAspectRatio", {aspect});
        std::array<double, 4> region;
        EXPECT_EQ(node.region_of_definition(5, region), kStatOK);
        EXPECT_THAT(region, ElementsAre(0, 0, aspect * 48, 40));
        EXPECT_THAT(node.regions_of_interest(5)["Depth"], ElementsAre(0, 0, aspect * 48, 40));
        node.choose("frame_size", "source");
        EXPECT_EQ(node.region_of_definition(5, region), kStatOK);
        EXPECT_THAT(region, ElementsAre(aspect * 20, 8, aspect * 30, 16));
    }
}

// Each cause is a message on the node, and the message goes with it.
TEST(Messages, GoWithTheirCause) {
    Host host;
    Node node(host, "postchain.joint_blur", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    node.set("samples", 3);
    const ImageF expected = node.rendered(2);
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/openfx/expected");
    static const std::regex varying("filtered on [^\n]*|[0-9]+ ms");
    EXPECT_EQ(node.changed("samples", 2), kStatOK);
    Transcript::say(std::regex_replace(node.status(), varying, "T"));
    EXPECT_EQ(node.changed("check", 2), kStatOK);
    Transcript::say(node.status());
    const auto fails = [&] {
        EXPECT_EQ(node.render(2), kStatFailed);
        Transcript::say(node.message());
        EXPECT_EQ(node.object().message_type, "OfxMessageError");
    };
    const auto works = [&] {
        connect_scene(node);
        EXPECT_EQ(node.rendered(2), expected);
        EXPECT_EQ(node.message(), "");
    };
    node.connect("Depth", Feed());
    fails();
    node.changed("check", 2);
    EXPECT_THAT(node.status(), HasSubstr("; connect Depth"));
    node.connect("Motion", Feed());
    fails();
    works();
    const auto still = [](const Picture& picture) -> Feed {
        return [picture](double) { return std::optional(picture); };
    };
    const auto of = [&](int channels, int x = 0, int y = 0,
                        const char* depth = "OfxBitDepthFloat") {
        return still({ImageF(kWidth, kHeight, channels, 3), x, y, depth});
    };
    const std::pair<const char*, Feed> spoiled[] = {
        {"Source", Feed()},
        {"Motion", [](double) { return std::optional<Picture>(); }},
        {"Depth", still({ImageF(kWidth - 1, kHeight, 1, 3)})},
        {"Depth", of(1, 1)},
        {"Motion", of(4, -1)},
        {"Depth", of(1, 0, 1)},
        {"Motion", of(4, 0, -1)},
        {"Depth", of(1, 0, 0, "OfxBitDepthByte")},
        {"Motion", of(3)},
        {"Motion", of(1)},
        {"Source", of(1)},
        {"Motion", of(2)}};
    for (const auto& [clip, feed] : spoiled) {
        node.connect(clip, feed);
        fails();
        works();
    }
    for (const char* field : {"OfxFieldLower", "OfxFieldUpper"}) {
        node.object().field = field;
        fails();
    }
    node.object().field = "OfxFieldBoth";
    works();
    const double depth_meaning = node.object().parameters.at("depth_meaning").numbers(2)[0];
    node.choose("depth_meaning", "normalized");
    fails();
    node.use("near_clip", 0.1);
    fails();
    node.set("use_near_clip", 0);
    node.use("far_clip", 100);
    fails();
    node.set("use_far_clip", 0);
    node.set("depth_meaning", depth_meaning);
    works();
    node.set("use_f_stop", 0);
    fails();
    node.use("f_stop", 1.4);
    works();
    node.use("shutter_angle_deg", 180);
    node.use("shutter_frames", 0.5);
    fails();
    node.set("use_shutter_angle_deg", 0);
    works();
    node.set("camera_file", "/no/such/camera.json");
    fails();
    node.set("camera_file", "");
    works();
    const auto set_project = [&](double width, double height) {
        node.object().properties.set("OfxImageEffectPropProjectSize", {width, height});
    };
    for (const auto& [width, height] : {std::pair(16385, 9), {9, 16385}, {900000, 900000}}) {
        set_project(width, height);
        fails();
    }
    set_project(kWidth, kHeight);
    works();
    // Options of a later release.
    for (const char* key : {"motion_meaning", "motion_channels", "depth_meaning", "depth_channel",
                            "matte_channel", "noise"}) {
        const double known = node.object().parameters.at(key).numbers(2)[0];
        for (const double number : {-1.0, 99.0}) {
            node.set(key, number);
            fails();
        }
        node.set(key, known);
    }
    works();
    // A neighbor that cannot be read is left out.
    node.connect("Depth", [](double time) -> std::optional<Picture> {
        if (time != 2) return std::nullopt;
        return Picture{.pixels = make_planes(kWidth, kHeight, 2).depth};
    });
    EXPECT_EQ(node.render(2), kStatOK);
    EXPECT_EQ(node.changed("check", 2), kStatOK);
    EXPECT_THAT(node.status(),
                HasSubstr("without the frame before: Depth: has no image at frame 1"));
    Transcript::say(node.status());
}

TEST(Messages, OfChainsAndValues) {
    Host host;
    Node node(host, "postchain.chain", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    node.set("chain", 99);
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("chain: has no option number 99"));
    node.choose("chain", "from chain_file");
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("chain_file: is empty"));
    const postchain::test::TempFolder folder;
    const std::string path = folder.path("own.yaml");
    postchain::test::write_text(path, "postchain: 1\npasses: [fxaaa]\n");
    node.set("chain_file", path);
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("own.yaml:2"));
    postchain::test::write_text(path, "postchain: 1\npasses: [fxaa, joint_blur: {samples: 4}]\n");
    const ImageF four = node.rendered(2);
    EXPECT_EQ(node.message(), "");
    node.set("overrides", "joint_blur.samples=3\njoint_blur.seed=7\n");
    EXPECT_NE(node.rendered(2), four);
    node.set("overrides", "joint_blur.samples=none");
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("samples"));
}

// Values from a camera file, frame by frame; those of the node replace them.
TEST(Camera, FileByFrame) {
    Host host;
    Node node(host, "postchain.depth_of_field", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    node.choose("neighbors", "none");
    const ImageF expected = node.rendered(2);
    const postchain::test::TempFolder folder;
    const std::string path = folder.path("camera.json");
    postchain::test::write_text(
        path,
        R"({"focal_length_mm": 50, "sensor_width_mm": 36, "f_stop": 22, "meters_per_unit": 0.05,
            "focus_distance": 6, "frames": {"2": {"f_stop": 1.4, "focus_distance": 2}}})");
    for (const char* key :
         {"focal_length_mm", "sensor_width_mm", "f_stop", "focus_distance", "meters_per_unit"})
        node.set(concat("use_", key), 0);
    node.set("camera_file", path);
    EXPECT_EQ(node.rendered(2), expected);
    ImageF other = node.rendered(3);
    EXPECT_NE(other, expected);
    node.use("f_stop", 22);
    EXPECT_NE(node.rendered(2), expected);
}

// The point's surface is in focus, and another one at another time.
TEST(Focus, AtAPointOverTime) {
    Host host;
    Node node(host, "postchain.depth_of_field", kWidth, kHeight);
    connect_scene(node);
    node.use("focal_length_mm", 50);
    node.use("sensor_width_mm", 36);
    node.use("f_stop", 1.4);
    node.use("meters_per_unit", 0.05);
    node.choose("neighbors", "none");
    node.set("use_focus_at", 1);
    // The square, whose depth is 2, is at the center of frame 2; the ground, 6, in the corner.
    node.object().parameters.at("focus_at").numbers = [](double time) {
        return time == 2 ? std::array{kWidth / 2.0, kHeight / 2.0}
                         : std::array{1.0, double(kHeight - 1)};
    };
    const ImageF near = node.rendered(2), far = node.rendered(3);
    node.set("use_focus_at", 0);
    node.use("focus_distance", 2);
    EXPECT_EQ(node.rendered(2), near);
    node.use("focus_distance", 6);
    EXPECT_EQ(node.rendered(3), far);
    Node chain(host, "postchain.chain", kWidth, kHeight);
    connect_scene(chain);
    set_lens(chain);
    chain.choose("chain", "fast");
    chain.use("focus_at", kWidth / 2.0, kHeight / 2.0);
    const ImageF at_point = chain.rendered(2);
    chain.set("use_focus_at", 0);
    EXPECT_EQ(chain.rendered(2), at_point);
}

TEST(Signs, AreCheckedOnceAndDismissed) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 3);
    EXPECT_EQ(node.render(2), kStatOK);
    EXPECT_EQ(node.message(), "");
    EXPECT_EQ(node.changed("samples"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("signs of the motion vectors: confirmed"));
    node.set("motion_scale", -1, 1);
    EXPECT_EQ(node.render(2), kStatOK);
    EXPECT_EQ(node.object().message_type, "OfxMessageWarning");
    EXPECT_THAT(node.message(), HasSubstr("scale` multiplied by (-1, 1)"));
    const int messages = node.object().messages;
    EXPECT_EQ(node.render(3), kStatOK);
    EXPECT_EQ(node.object().messages, messages);
    node.set("check_motion", 0);
    EXPECT_EQ(node.changed("check_motion"), kStatOK);
    EXPECT_EQ(node.message(), "");
    node.set("check_motion", 1);
    EXPECT_EQ(node.render(2), kStatOK);
    EXPECT_NE(node.message(), "");
    node.set("motion_scale", 1, 1);
    EXPECT_EQ(node.render(2), kStatOK);
    EXPECT_EQ(node.message(), "");
}

// Each value that changes the vectors makes what was found of the others void.
TEST(Signs, AreCheckedAgainForOtherVectors) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    // Backward vectors of the wrong signs: forward in their place, they contradict the next frame.
    node.connect("Motion", [](double time) -> std::optional<Picture> {
        const ImageF motion = make_planes(kWidth, kHeight, int(time)).motion;
        ImageF back = motion;
        for (float& value : back.data) value = -value;
        return Picture{.pixels = joined(motion, back)};
    });
    const auto verdict = [&](const std::string& change) {
        EXPECT_EQ(node.changed("check", 2), kStatOK);
        const std::string status = node.status();
        const size_t from = status.find("vectors: ") + 9;
        const std::string found = status.substr(from, status.find_first_of(",:", from) - from);
        EXPECT_EQ(node.message().empty(), found != "contradicted") << change << ": " << status;
        return found;
    };
    const auto channels = [&](const char* names) {
        node.choose("motion_channels", names);
        return verdict(names);
    };
    EXPECT_EQ(verdict("generic"), "confirmed");
    for (int i = 0; i < 2; ++i) {
        EXPECT_EQ(channels("BA forward, RG backward"), "contradicted");
        EXPECT_EQ(channels("RG forward, BA backward"), "confirmed");
        EXPECT_EQ(channels("BA forward"), "contradicted");
        EXPECT_EQ(channels("RG forward"), "confirmed");
    }
    for (const auto& [x, y] : {std::pair(-1, 1), {1, -1}}) {
        node.set("motion_scale", x, y);
        EXPECT_EQ(verdict("motion_scale"), "contradicted") << x << " " << y;
        node.set("motion_scale", 1, 1);
        EXPECT_EQ(verdict("motion_scale"), "confirmed");
    }
    node.set("motion_scale", 1, -1);
    for (const auto& [meaning, found] : {std::pair("to_next", "confirmed"),
                                         {"to_previous", "contradicted"},
                                         {"from_previous", "confirmed"},
                                         {"uv", "not checked"},
                                         {"to_next", "confirmed"}}) {
        node.choose("motion_meaning", meaning);
        EXPECT_EQ(verdict(meaning), found) << meaning;
    }
}

// Frames without motion say nothing about its signs, and the next one is checked.
TEST(Signs, AreCheckedWhereSomethingMoves) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 3);
    node.set("motion_scale", -1, 1);
    node.connect("Motion", [](double time) -> std::optional<Picture> {
        if (time == 2) return Picture{.pixels = ImageF(kWidth, kHeight, 4)};
        return Picture{.pixels = vectors(make_planes(kWidth, kHeight, int(time)))};
    });
    EXPECT_EQ(node.changed("check", 2), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("signs of the motion vectors: not checked: "));
    EXPECT_EQ(node.message(), "");
    EXPECT_EQ(node.changed("check", 3), kStatOK);
    EXPECT_EQ(node.object().message_type, "OfxMessageWarning");
    EXPECT_THAT(node.status(), HasSubstr("signs of the motion vectors: contradicted"));
}

// Across a cut no frame is read, and its motion is that from the frame before.
TEST(Cuts, NoFrameAcross) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    const ImageF inside = node.rendered(2);
    node.animate("cut", [](double time) { return time == 2 ? 1 : 0; });
    const ImageF before_cut = node.rendered(2);
    EXPECT_NE(before_cut, inside);
    EXPECT_EQ(node.changed("cut"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("without the frame after: a cut follows frame 2"));
    EXPECT_EQ(node.render(3), kStatOK);
    EXPECT_EQ(node.changed("cut"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("without the frame before: a cut follows frame 2"));
    // Without vectors of the other side there is no motion to blur by.
    node.choose("motion_channels", "RG forward");
    EXPECT_EQ(node.rendered(2), source());
    EXPECT_EQ(node.render(1), kStatOK);
    EXPECT_EQ(node.changed("cut"), kStatOK);
    EXPECT_THAT(node.status(),
                HasSubstr("without the frame before: frame 1 is the first of Source"));
    EXPECT_EQ(node.render(9), kStatOK);
    EXPECT_EQ(node.changed("cut"), kStatOK);
    EXPECT_THAT(node.status(), HasSubstr("without the frame after: frame 9 is the last of Source"));
}

TEST(Mattes, KeepWhatTheyCover) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    const ImageF blurred = node.rendered(2);
    ImageF matte(kWidth, kHeight, 4);
    for (size_t i = 0; i < matte.pixels(); ++i) matte.data[4 * i + 1] = 1;
    node.connect("Matte", Picture{.pixels = matte});
    EXPECT_EQ(node.rendered(2), blurred);
    node.choose("matte_channel", "G");
    EXPECT_EQ(node.rendered(2), source());
    node.choose("matte_effect", "unmoved");
    EXPECT_EQ(node.rendered(2), source());
    node.set("matte_effect", 99);
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("matte_effect"));
}

// One channel serves as each; a smaller matte is 0 around; values are coverages.
TEST(Mattes, OfOneChannelOfAPartAndOfOtherValues) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    const ImageF blurred = node.rendered(2);
    const auto with_matte = [&](ImageF matte, int x = 0, int y = 0) {
        node.connect("Matte", Picture{.pixels = std::move(matte), .x = x, .y = y});
        return node.rendered(2);
    };
    EXPECT_EQ(with_matte(ImageF(kWidth, kHeight, 1, 1)), source());
    EXPECT_EQ(with_matte(ImageF(kWidth, kHeight, 1, 7)), source());
    for (const float none : {0.f, -1.f, std::numeric_limits<float>::quiet_NaN()})
        EXPECT_EQ(with_matte(ImageF(kWidth, kHeight, 1, none)), blurred) << none;
    ImageF whole(kWidth, kHeight, 1);
    for (int y = kHeight - 20; y < kHeight - 9; ++y)  // rows from the top, of 9 to 20 from below
        for (int x = 20; x < 30; ++x) whole.at(x, y) = 1;
    const ImageF part = with_matte(ImageF(10, 11, 1, 1), 20, 9);
    EXPECT_EQ(part, with_matte(whole));
    EXPECT_NE(part, blurred);
    EXPECT_NE(part, source());
}

// A chain that names the matte at one pass takes it there alone.
TEST(Mattes, OfAChainThatNamesOne) {
    Host host;
    Node node(host, "postchain.chain", kWidth, kHeight);
    connect_scene(node);
    node.choose("chain", "from chain_file");
    const postchain::test::TempFolder folder;
    node.set("chain_file", folder.path("chain.yaml"));
    const auto passes = [&](const char* text) {
        postchain::test::write_text(folder.path("chain.yaml"),
                                    concat("postchain: 1\npasses: [", text, "]\n"));
        return node.rendered(2);
    };
    const ImageF fxaa = passes("fxaa");
    EXPECT_NE(fxaa, source());
    node.connect("Matte", Picture{.pixels = ImageF(kWidth, kHeight, 1, 1)});
    EXPECT_EQ(passes("fxaa, motion_blur: {samples: 3}"), source());
    EXPECT_EQ(passes("fxaa, motion_blur: {samples: 3, matte: Matte}"), fxaa);
}

// Light of surfaces that the frame does not show.
TEST(Behind, GivesLight) {
    Host host;
    Node node(host, "postchain.joint_blur", kWidth, kHeight);
    connect_scene(node);
    set_lens(node);
    node.choose("neighbors", "none");
    const ImageF alone = node.rendered(2);
    node.connect("Behind", Picture{.pixels = ImageF(kWidth, kHeight, 4, 1)});
    EXPECT_EQ(node.render(2), kStatFailed);
    EXPECT_THAT(node.message(), HasSubstr("BehindDepth: is not connected"));
    for (const Feed& none : {Feed([](double) { return std::optional<Picture>(); }),
                             Feed([](double) { return Picture{.pixels = ImageF(9, 9, 1, 6)}; })}) {
        node.connect("BehindDepth", none);
        EXPECT_EQ(node.render(2), kStatFailed);
        EXPECT_THAT(node.message(), HasSubstr("the layer behind: BehindDepth: "));
    }
    node.connect("BehindDepth", Picture{.pixels = ImageF(kWidth, kHeight, 1, 6)});
    const ImageF with_layer = node.rendered(2);
    EXPECT_NE(with_layer, alone);
    node.connect("BehindMotion", Picture{.pixels = ImageF(kWidth, kHeight, 4, 3)});
    EXPECT_NE(node.rendered(2), with_layer);
}

// Before a frame begins, and while the device works on it.
TEST(Life, AbortEndsARender) {
    constexpr int kWide = 151, kHigh = 101;
    Host host;
    Node node(host, "postchain.joint_blur", kWide, kHigh);
    const Planes planes = make_planes(kWide, kHigh, 2);
    node.connect("Source", Picture{.pixels = planes.color});
    node.connect("Depth", Picture{.pixels = planes.depth});
    node.connect("Motion", Picture{.pixels = vectors(planes)});
    node.choose("motion_meaning", "generic");
    set_lens(node);
    node.set("samples", 3);
    const ImageF few = node.rendered(2);
    node.set("samples", 1023);
    for (const int asked : {1, 2}) {
        node.object().output.pixels = ImageF(kWide, kHigh, 4, -5);
        node.object().abort_asked = 0;
        node.object().abort = [&] { return node.object().abort_asked >= asked; };
        EXPECT_EQ(node.render(2), kStatFailed);
        EXPECT_EQ(node.object().output.pixels, ImageF(kWide, kHigh, 4, -5));
        EXPECT_EQ(node.message(), "");
    }
    node.object().abort = {};
    node.set("samples", 3);
    EXPECT_EQ(node.rendered(2), few);
}

TEST(Life, GraysOutWhatHasNoEffect) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    const auto enabled = [&](const char* name) {
        const auto& set = node.object().parameters.at(name).properties;
        return !set.values.contains("OfxParamPropEnabled") ||
               set.integer("OfxParamPropEnabled") != 0;
    };
    EXPECT_FALSE(enabled("center_weight"));
    EXPECT_FALSE(enabled("max_blur_px"));
    EXPECT_TRUE(enabled("path_px_per_time"));
    node.choose("mode", "guertin");
    node.use("max_blur_px", 9);
    EXPECT_EQ(node.changed("mode"), kStatOK);
    EXPECT_TRUE(enabled("center_weight"));
    EXPECT_TRUE(enabled("max_blur_px"));
    EXPECT_FALSE(enabled("path_px_per_time"));
    EXPECT_FALSE(enabled("status"));
    // A value that is none leaves the others to decide.
    node.set("samples", -1);
    node.choose("mode", "inverse_warp");
    EXPECT_EQ(node.changed("samples"), kStatOK);
    EXPECT_TRUE(enabled("path_px_per_time"));
    EXPECT_FALSE(enabled("center_weight"));
}

TEST(Life, TwoThreadsAndManyInstances) {
    Host host;
    Node first(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(first);
    first.set("samples", 3);
    const ImageF expected = first.rendered(2);
    std::vector<std::unique_ptr<Node>> nodes;
    for (int i = 0; i < 200; ++i) {
        nodes.push_back(std::make_unique<Node>(
            host, i % 2 ? "postchain.motion_blur" : "postchain.fxaa", kWidth, kHeight));
        if (i % 2) connect_scene(*nodes.back());
    }
    const auto render = [&](size_t from) {
        for (size_t i = from; i < 16; i += 2) {
            Node& node = *nodes[2 * i + 1];
            node.set("samples", 3);
            EXPECT_EQ(node.rendered(2), expected);
        }
    };
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    std::thread other(render, 0);
    render(1);
    other.join();
    EXPECT_EQ(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr(), "");
}

// A message, and a copy of the frame that needs no GL.
TEST(LifeDeathTest, WithoutADriver) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");  // a process in which no context was made
    const postchain::test::TempFolder folder;
    const std::string file = folder.path("vendor.json");
    postchain::test::write_text(
        file, R"({"file_format_version": "1.0.0", "ICD": {"library_path": "/no/such.so"}})");
    const auto render = [&] {
        postchain::test::set_variable("__EGL_VENDOR_LIBRARY_FILENAMES", file);
        Host host;
        Node node(host, "postchain.fxaa", kWidth, kHeight);
        node.connect("Source", Picture{.pixels = source()});
        if (node.render(2) != kStatFailed || node.message().find("EGL") == std::string::npos ||
            node.object().message_type != "OfxMessageError")
            std::fprintf(stderr, "message: %s", node.message().c_str());
        node.connect("Source", Picture{.pixels = ImageF(kWidth, kHeight, 4, 0.5f)});
        if (node.render(2) != kStatOK || !node.message().empty()) std::fprintf(stderr, "no copy");
        std::_Exit(0);
    };
    EXPECT_EXIT(render(), ::testing::ExitedWithCode(0), "^$");
}

// The next render makes anew what it needs.
TEST(Life, PurgeDeletesTheDevicesTextures) {
    Host host;
    Node node(host, "postchain.motion_blur", kWidth, kHeight);
    connect_scene(node);
    node.set("samples", 3);
    const ImageF before = node.rendered(2);
    static std::atomic<bool> deleted;
    deleted = false;
    const auto delete_textures = epoxy_glDeleteTextures;
    epoxy_glDeleteTextures = [](GLsizei, const GLuint*) { deleted = true; };
    EXPECT_EQ(
        host.act(host.plugin("postchain.motion_blur"), "OfxActionPurgeCaches", &node.object()),
        kStatOK);
    for (int i = 0; i < 1000 && !deleted; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(deleted);
    EXPECT_EQ(node.rendered(2), before);  // after the purge
    epoxy_glDeleteTextures = delete_textures;
}

// The last effect that is unloaded ends the device; the next render makes another.
TEST(Life, LoadedAgain) {
    std::vector<ImageF> colors;
    for (int i = 0; i < 2; ++i) {
        Host host;
        Node node(host, "postchain.motion_blur", kWidth, kHeight);
        connect_scene(node);
        node.set("samples", 3);
        colors.push_back(node.rendered(2));
    }
    EXPECT_EQ(colors[0], colors[1]);
}

}  // namespace
}  // namespace postchain::openfx::test::node_test
