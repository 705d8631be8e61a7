// Which layers of a file are filtered, why the others are not, and that a run filters them.
#include "tools/sequence/layers/frame_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "chain/frame/behind.h"
#include "config/profile.h"
#include "tests/io/exr_files.h"
#include "tests/run/fixture.h"
#include "tests/support/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/layers/fill_mask.h"
#include "tools/sequence/planes/cryptomatte.h"
#include "tools/sequence/source/frame_source.h"
#include "tools/sequence/source/neighbor_planes.h"

namespace postchain::sequence::frame_layers_test {
namespace {

using test::must;
using ::testing::ElementsAre;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

// Layers of color that differ from "plain" in what keeps them from being filtered.
class FrameLayersTest : public testing::Test {
  protected:
    void SetUp() override {
        test::FilePart color{
            .name = "color", .data = {{0, 0}, {7, 7}}, .display = {{0, 0}, {7, 7}}};
        const auto add = [](test::FilePart& part, const std::string& layer,
                            Imf::PixelType type = Imf::HALF, int x_sampling = 1,
                            int y_sampling = 1) {
            for (const char* channel : {"B", "G", "R"})
                part.channels.push_back({layer + channel, type, x_sampling, y_sampling});
        };
        add(color, "");
        add(color, "ids.", Imf::UINT);
        add(color, "plain.");
        add(color, "small.", Imf::HALF, 2);
        add(color, "low.", Imf::HALF, 1, 2);
        color.channels.push_back({"normal.X"});
        test::FilePart apart{
            .name = "apart", .data = {{0, 0}, {5, 7}}, .display = {{0, 0}, {7, 7}}};
        add(apart, "apart.");
        test::write_file(path_, {color, apart});
    }
    Result<FrameLayers> found() {
        SourceSettings settings;
        settings.layers = settings_;
        auto header = open_source_frame(settings, {{Role::color, path_}}, 1);
        if (!header.ok()) return header.status();
        return std::move(header->layers);
    }
    static std::vector<std::string> filtered(const FrameLayers& layers) {
        std::vector<std::string> names;
        for (const FileLayer& layer : layers.filtered) names.push_back(layer.name);
        return names;
    }
    static std::map<std::string, std::string> left(const FrameLayers& layers) {
        std::map<std::string, std::string> why;
        for (const LeftLayer& layer : layers.left) why[layer.name] = layer.why;
        return why;
    }

    test::TempFolder folder_;
    const std::string path_ = folder_.path("f.exr");
    LayerSettings settings_;
};

TEST_F(FrameLayersTest, OfAllThoseAreLeftThatCannotBeFiltered) {
    settings_.aovs = "all";
    const auto layers = found();
    ASSERT_TRUE(layers.ok()) << layers.status().message();
    EXPECT_THAT(filtered(*layers), ElementsAre("color.plain"));
    EXPECT_THAT(left(*layers),
                UnorderedElementsAre(Pair("color.ids", testing::HasSubstr("integer")),
                                     Pair("color.small", testing::HasSubstr("subsampled")),
                                     Pair("color.low", testing::HasSubstr("subsampled")),
                                     Pair("color.normal", testing::HasSubstr("not R, G, B")),
                                     Pair("apart", testing::HasSubstr("size"))));
}

TEST_F(FrameLayersTest, OneThatIsNamedAndCannotBeFilteredIsAnError) {
    const std::pair<const char*, StatusCode> cases[] = {
        {"plain", StatusCode::ok},     {"ids", StatusCode::input},
        {"small", StatusCode::input},  {"apart", StatusCode::input},
        {"normal", StatusCode::usage}, {"nothing", StatusCode::usage}};
    for (const auto& [name, code] : cases) {
        settings_.aovs = name;
        const auto layers = found();
        EXPECT_EQ(layers.status().code(), code) << name << layers.status().message();
    }
}

TEST_F(FrameLayersTest, WhatIsNotWrittenIsNotFiltered) {
    settings_.aovs = "plain";
    EXPECT_THAT(left(*found()), testing::Contains(Pair("color.small", "not requested")));
    settings_.written.channels = {"R", "G", "B", "small.*"};
    const auto layers = found();
    ASSERT_TRUE(layers.ok());
    EXPECT_TRUE(layers->filtered.empty());
    EXPECT_THAT(left(*layers),
                testing::IsSupersetOf({Pair("color.plain", "is excluded by {channels}"_keyed),
                                       Pair("color.small", std::string("not requested"))}));
}

TEST_F(FrameLayersTest, AMatteIsAChannelThatColorCovers) {
    const std::pair<const char*, StatusCode> cases[] = {{"plain.G", StatusCode::ok},
                                                        {"normal.X", StatusCode::ok},
                                                        {"small.G", StatusCode::input},
                                                        {"ids.R", StatusCode::input},
                                                        {"apart.R", StatusCode::input},
                                                        {"plain.H", StatusCode::input},
                                                        {"cryptomatte:hero", StatusCode::input}};
    for (const auto& [name, code] : cases) {
        settings_.mattes = {name};
        const auto layers = found();
        EXPECT_EQ(layers.status().code(), code) << name << layers.status().message();
    }
    settings_.fill_mask = "plain";
    settings_.mattes = {};
    EXPECT_TRUE(found().ok());  // plain.frame and the like are not in the file
}

// A pattern has no hash.
TEST_F(FrameLayersTest, IdsWithoutAManifestAreFoundByWholeNames) {
    test::FrameFile file;
    for (const char* channel : {"R", "G", "B", "A"})
        file.mattes[concat("crypto00.", channel)] = ImageF(8, 8, 1);
    const std::string key = "cryptomatte/1234567/";
    file.attributes = {{key + "name", std::string("crypto")},
                       {key + "hash", std::string("MurmurHash3_32")},
                       {key + "conversion", std::string("uint32_to_float32")}};
    test::write_frame(path_, test::make_planes(8, 8), file);
    settings_.cryptomatte = CryptomatteChoice::filter;
    settings_.ids = {"ball"};
    const auto layers = found();
    ASSERT_TRUE(layers.ok()) << layers.status().message();
    EXPECT_THAT(layers->filtered_ids.at(0), ElementsAre(io::id_of_name("ball")));
    EXPECT_THAT(layers->warnings,
                testing::Contains(testing::HasSubstr("'ball' is found by the hash of its name")));
    for (const char* pattern : {"ba*", "bal?"}) {
        settings_.ids = {pattern};
        EXPECT_EQ(found().status().code(), StatusCode::input) << pattern;
    }
}

// Two cryptomattes: both have the ball, one a cube.
TEST_F(FrameLayersTest, AMatteOfIdsNamesItsCryptomatte) {
    const std::string cube = R"({"ball": "00000007", "cube": "00000009"})";
    const auto message = [&](const std::string& matte, const std::string& first = "{}",
                             const char* second = R"({"ball": "00000007"})",
                             const char* hash = "MurmurHash3_32") {
        test::FrameFile file;
        for (const char* name : {"first", "second"}) {
            const bool is_first = *name == 'f';
            for (const char* channel : {"R", "G", "B", "A"})
                file.mattes[concat(name, "00.", channel)] = ImageF(8, 8, 1);
            const std::string key = concat("cryptomatte/", name, "/");
            file.attributes[key + "name"] = std::string(name);
            file.attributes[key + "hash"] = std::string(is_first ? "MurmurHash3_32" : hash);
            file.attributes[key + "manifest"] = is_first ? first : std::string(second);
        }
        test::write_frame(path_, test::make_planes(8, 8), file);
        settings_.mattes = {matte};
        return test::error_of(found());
    };
    using testing::HasSubstr;
    EXPECT_EQ(message("cryptomatte:cube", cube), "");
    EXPECT_EQ(found()->mattes[0].ids.begin()->second, std::vector<io::CryptoId>{0x00800009u});
    EXPECT_EQ(message("first:ball", cube), "");
    EXPECT_THAT(message("second:cube", cube),
                HasSubstr("no 'cube' in the cryptomatte; it has ball"));
    EXPECT_THAT(
        message("cryptomatte:ball", cube),
        HasSubstr("'ball' is in several cryptomattes; choose one: first:ball or second:ball"));
    EXPECT_THAT(message("cryptomatte:,", cube), HasSubstr("give a name after the colon"));
    EXPECT_THAT(message("third:ball", cube), HasSubstr("unknown channel; give a channel"));
    // Without manifests.
    EXPECT_EQ(message("cryptomatte:hero"), "") << "by its hash, in the first";
    EXPECT_THAT(message("cryptomatte:he*"), HasSubstr("patterns need a manifest"));
    EXPECT_THAT(message("cryptomatte:hero", "{}", "{}"),
                HasSubstr("several cryptomattes have no manifest; choose one"));
    // One that cannot be used.
    EXPECT_THAT(message("second:ball", cube, "{}", "MD5"), HasSubstr("its hash is \"MD5\""));
    EXPECT_THAT(message("cryptomatte:hero", cube, "{}", "MD5"),
                testing::AllOf(HasSubstr("no 'hero' in"), HasSubstr("; and "), HasSubstr("MD5")));
    std::string many = "{";
    for (int i = 100; i < 141; ++i) many += concat(i > 100 ? ", " : "", "\"id", i, "\": \"7\"");
    EXPECT_THAT(message("first:hero", many + "}"), HasSubstr("id138, id139, ..."));
}

// The ball, in the left half, and a cube are in one cryptomatte, the glass is in another.
TEST_F(FrameLayersTest, AMatteSumsItsIdsInAllCryptomattes) {
    test::FrameFile file;
    const auto add = [&](const std::string& name, const char* manifest, float id, float coverage,
                         float other, float of_other) {
        std::map<std::string, ImageF> ranks;
        for (const auto& [channel, value] : {std::pair("R", id), {"B", other}, {"A", of_other}})
            ranks[channel] = ImageF(8, 8, 1, value);
        ranks["G"] = ImageF(8, 8, 1);
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 4; ++x) ranks["G"].at(x, y) = coverage;
        for (auto& [channel, plane] : ranks) file.mattes[name + "00." + channel] = plane;
        const std::string key = concat("cryptomatte/", name, "/");
        file.attributes[key + "name"] = name;
        file.attributes[key + "hash"] = std::string("MurmurHash3_32");
        file.attributes[key + "manifest"] = std::string(manifest);
    };
    add("first", R"({"ball": "40000000", "cube": "40400000"})", 2, 0.25f, 3, 0.125f);
    add("second", R"({"glass": "40800000"})", 0, 0, 4, 0.5f);
    ImageF& mask = file.mattes["mask"] = ImageF(8, 8, 1, 0.75f);
    mask.at(0, 0) = NAN;
    mask.at(1, 0) = INFINITY;
    mask.at(2, 0) = -1;
    mask.at(3, 0) = 2;
    test::write_frame(path_, test::make_planes(8, 8), file);
    settings_.mattes = {"cryptomatte:ball,glass", "mask", "first:cube,ball"};
    const FrameLayers layers = must(found());
    const auto pixels = must(io::open_pixels(path_));
    io::StoredFrame read;
    read.window = pixels->parts()[0].data_window;
    MatteFindings findings;
    const ImageF mattes = must(read_mattes(layers, *pixels, read, findings));
    ImageF expected(8, 24, 1);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
            const float ball = x < 4 ? 0.25f : 0;
            expected.at(x, y) = ball + 0.5f;
            expected.at(x, 8 + y) = 0.75f;
            expected.at(x, 16 + y) = ball + 0.125f;
        }
    expected.at(0, 8) = expected.at(2, 8) = 0;
    expected.at(1, 8) = expected.at(3, 8) = 1;
    EXPECT_EQ(mattes, expected);
    EXPECT_EQ(findings.faulty, 2u);
    EXPECT_EQ(findings.warnings.size(), 2u) << "not finite, above 1";
}

TEST(FillMask, IsAboveTheLayersOfEachFrame) {
    const auto image = [](float value, int rows = 1) {
        return std::make_shared<const ImageF>(2, rows, 4, value);
    };
    FrameDescription frame;
    frame.width = 2;
    frame.height = 1;
    for (const bool layered : {false, true}) {
        SharedPlanes planes = {
            {Role::color, image(1)}, {Role::color_before, image(2)}, {Role::color_after, image(3)}};
        if (layered) {
            planes[Role::layers] = image(4);
            planes[Role::layers_before] = image(5);
            planes[Role::layers_after] = image(6);
            frame.layers = 1;
        }
        planes[Role::behind] = image(7, kBehindPlanes + int(layered));
        frame.planes = {};
        for (const auto& [role, plane] : planes) frame.planes.add(role);
        planes = planes_with_fill_mask(planes, frame);
        float value = 4;
        for (const Role role : {Role::layers, Role::layers_before, Role::layers_after}) {
            ASSERT_TRUE(planes.contains(role)) << name_of(role);
            ImageF rest = *planes.at(role);
            EXPECT_EQ(take_fill_mask(rest, 1).data, (std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0}));
            EXPECT_EQ(rest, layered ? *image(value++) : ImageF());
        }
        EXPECT_EQ(with_fill_mask(frame).layers, layered ? 2 : 1);
        // Behind, it is the first layer.
        const ImageF& behind = *planes.at(Role::behind);
        EXPECT_EQ(behind.height, kBehindPlanes + int(layered) + 1);
        for (int y = 0; y < behind.height; ++y)
            for (int c = 0; c < 2; ++c)
                EXPECT_EQ(behind.at(1, y, c), y == kBehindPlanes ? float(1 - c) : 7) << y;
    }
}

TEST(FillMask, HasAName) {
    EXPECT_TRUE(check_fill_mask("fill-2.mask_A").ok());
    for (const std::string& name :
         {std::string(300, 'f'), std::string(".fill"), std::string("a b")})
        EXPECT_FALSE(check_fill_mask(name).ok()) << name;
}

// The shares of each pixel sum to 1, also if a pass has made one of them negative.
TEST(FillMask, IsTakenFromTheTopOfTheLayers) {
    ImageF layers(3, 2, 4, 7);
    layers.data = {-0.25f, 0.5f, 1.5f, 0, 2, 0, 0, 0, -1, -1, 0, 0,
                   7,      7,    7,    7, 7, 7, 7, 7, 7,  7,  7, 7};
    const ImageF mask = take_fill_mask(layers, 1);
    EXPECT_EQ(mask.data, (std::vector<float>{0, 0.25f, 0.75f, 0, 1, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(layers, ImageF(3, 1, 4, 7));
    take_fill_mask(layers, 1);
    EXPECT_TRUE(layers.empty());
}

// A frame with three light groups whose sum is color, and a cryptomatte of four objects.
class LayersOfARun : public SequenceTest {
  protected:
    static constexpr const char* kFrames = POSTCHAIN_SOURCE_DIR "/tests/data/layers/";
    void SetUp() override {
        SequenceTest::SetUp();
        settings_.input = *io::InputSpec::parse(std::string(kFrames) + "layers.####.exr");
        settings_.on_existing = io::OnExisting::overwrite;
        frames("2");
        chain_ = test::chain_of("motion_blur", {{"mode", "guertin"}, {"shutter_frames", 0.5}});
    }
    static ImageF read(const std::string& path, const std::string& layer) {
        auto file = io::ExrFile::open(path);
        EXPECT_TRUE(file.ok());
        const std::string name = "ViewLayer." + layer + ".";
        auto image = file->read_channels(0, {name + "R", name + "G", name + "B"});
        EXPECT_TRUE(image.ok()) << image.status().message();
        return std::move(*image);
    }
    static ImageF matte(const std::string& path, const std::string& name) {
        const auto file = io::open_pixels(path);
        EXPECT_TRUE(file.ok());
        const auto mattes = io::find_cryptomattes(**file, io::Manifests::not_read);
        EXPECT_TRUE(mattes.ok() && mattes->size() == 1);
        const auto ranks = io::read_ranks(**file, mattes->at(0), (*file)->parts()[0].data_window);
        EXPECT_TRUE(ranks.ok());
        return io::coverage_of(*ranks, {io::id_of_name(name)});
    }
    const std::string before_ = std::string(kFrames) + "layers.0002.exr";
    const std::vector<std::string> groups_ = {"Combined_fill", "Combined_glow", "Combined_key"};
};

TEST_F(LayersOfARun, LightGroupsStillSumToTheColorAndTheRestStays) {
    settings_.source.layers.aovs = "Combined_*";
    ASSERT_TRUE(last_frame().status.ok());
    const ImageF color = read(out(2), "Combined");
    ImageF sum(color.width, color.height, 3);
    for (const std::string& group : groups_) {
        const ImageF light = read(out(2), group);
        EXPECT_GT(test::largest_difference(light, read(before_, group)), 0.05) << group;
        for (size_t i = 0; i < sum.data.size(); ++i) sum.data[i] += light.data[i];
    }
    EXPECT_LT(test::largest_difference(sum, color), 1e-5);
    EXPECT_EQ(read(out(2), "Emit"), read(before_, "Emit"));
    EXPECT_EQ(matte(out(2), "ball"), matte(before_, "ball"));
    EXPECT_EQ(sidecar(2)["layers"]["filtered"].size(), 3u);
}

TEST_F(LayersOfARun, AFilteredCryptomatteIsBlurredAndItsCoveragesSumToOne) {
    settings_.source.layers.cryptomatte = CryptomatteChoice::filter;
    ASSERT_TRUE(last_frame().status.ok());
    ImageF sum(read(out(2), "Combined").width, read(out(2), "Combined").height, 1);
    for (const char* name : {"wall", "post", "lamp", "ball"}) {
        const ImageF coverage = matte(out(2), name);
        for (size_t i = 0; i < sum.data.size(); ++i) sum.data[i] += coverage.data[i];
    }
    for (const float value : sum.data) ASSERT_NEAR(value, 1, 1e-5);
    EXPECT_GT(test::largest_difference(matte(out(2), "ball"), matte(before_, "ball")), 0.1);
    EXPECT_EQ(sidecar(2)["layers"]["cryptomattes"][0]["ids"], 4);
    const ImageF ball = matte(out(2), "ball");
    // Only the ids that are named.
    settings_.source.layers.ids = {"b*"};
    ASSERT_TRUE(last_frame().status.ok());
    EXPECT_EQ(matte(out(2), "ball"), ball);
    for (const float value : matte(out(2), "wall").data) ASSERT_EQ(value, 0);
    // Nothing is filtered.
    chain_ = test::chain_of("motion_blur", {{"shutter_frames", 0.0}});
    settings_.source.layers.ids.clear();
    ASSERT_TRUE(last_frame().status.ok());
    EXPECT_EQ(matte(out(2), "ball"), matte(before_, "ball"));
}

// Each is filtered as without the other, also if the frames beside it lack the other.
TEST_F(SequenceTest, TwoCryptomattesAreFilteredEachByItself) {
    settings_.source.layers.cryptomatte = CryptomatteChoice::filter;
    settings_.on_existing = io::OnExisting::overwrite;
    frames("2");
    using Ranks = std::pair<std::vector<io::CryptoId>, std::vector<float>>;
    const auto filtered = [&](const std::vector<std::string>& names, bool beside = true) {
        for (const int frame : {1, 2, 3}) {
            test::FrameFile file;
            for (const std::string& name : names) {
                const bool first = name == "first";
                if (!first && !beside && frame != 2) continue;
                const auto value = [&](const char* channel, const auto& at) {
                    ImageF& plane = file.mattes[concat(name, "00.", channel)] = ImageF(48, 32, 1);
                    for (int y = 0; y < 32; ++y)
                        for (int x = 0; x < 48; ++x) plane.at(x, y) = at(x, y);
                };
                // The same ids in columns, and in rows.
                value("R", [&](int x, int y) { return (first ? x < 20 : y < 13) ? 3.0f : 5.0f; });
                value("G", [&](int, int) { return first ? 1.0f : 0.5f; });
                for (const char* channel : {"B", "A"})
                    value(channel, [](int, int) { return 0.0f; });
                const std::string key = concat("cryptomatte/", name, "/");
                file.attributes[key + "name"] = name;
                file.attributes[key + "hash"] = std::string("MurmurHash3_32");
            }
            test::write_frame(in(frame), test::make_planes(48, 32, frame), file);
        }
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        std::map<std::string, Ranks> ranks;
        const auto file = must(io::open_pixels(out(2)));
        for (const io::Cryptomatte& one :
             must(io::find_cryptomattes(*file, io::Manifests::not_read))) {
            const auto read = must(io::read_ranks(*file, one, file->parts()[0].data_window));
            ranks[one.name] = {read.ids, read.coverages};
        }
        return ranks;
    };
    for (const char* mode : {"guertin", "inverse_warp"}) {
        chain_ = test::chain_of("motion_blur", {{"mode", mode}, {"shutter_frames", 0.5}});
        const auto both = filtered({"first", "second"});
        ASSERT_EQ(both.size(), 2u);
        EXPECT_NE(both.at("first"), both.at("second"));
        for (const auto& [name, ranks] : both) EXPECT_EQ(ranks, filtered({name}).at(name)) << name;
        EXPECT_EQ(filtered({"first", "second"}, false).at("first"), both.at("first")) << mode;
    }
}

// A layer that a neighbor lacks is filtered apart, and written in its place.
TEST_F(SequenceTest, ALayerThatNeighborsLackStaysInItsPlace) {
    settings_.on_existing = io::OnExisting::overwrite;
    chain_ = test::chain_of("motion_blur", {{"mode", "inverse_warp"}, {"shutter_frames", 0.5}});
    const std::vector<std::string> names = {"a", "b", "c"};
    for (const int frame : {1, 2, 3}) {
        test::FrameFile file;
        for (size_t i = 0; i < names.size(); ++i)
            for (const char* channel : {"R", "G", "B"}) {
                if (i == 1 && frame != 2) continue;
                ImageF& plane = file.mattes[names[i] + "." + channel] = ImageF(48, 32, 1);
                for (int y = 0; y < 32; ++y)
                    for (int x = 0; x < 48; ++x)
                        plane.at(x, y) = float((x + 3 * frame) / 4 % (i + 2)) + float(i * 10);
            }
        test::write_frame(in(frame), test::make_planes(48, 32, frame), file);
    }
    frames("2");
    const auto filtered = [&](const std::string& aovs) {
        settings_.source.layers.aovs = aovs;
        const FrameReport report = last_frame();
        EXPECT_TRUE(report.status.ok()) << report.status.message();
        std::map<std::string, ImageF> layers;
        for (const std::string& name : names)
            layers[name] = must(must(io::ExrFile::open(out(2))).read_channels(0, {name + ".R"}));
        return layers;
    };
    const auto rendered = filtered("none"), all = filtered("a,b,c");
    for (const std::string& name : names) {
        EXPECT_GT(test::largest_difference(all.at(name), rendered.at(name)), 0.1) << name;
        EXPECT_LT(test::largest_difference(all.at(name), filtered(name).at(name)), 1e-9) << name;
    }
}

// A layer is stored like color, premultiplied or not: one that equals color equals it afterwards.
TEST_F(SequenceTest, ALayerIsWrittenInTheConventionOfColor) {
    ImageF stored(24, 16, 7);
    for (int y = 0; y < stored.height; ++y)
        for (int x = 0; x < stored.width; ++x) {
            const bool edge = 2 * x + y > 30;
            for (int c = 0; c < 3; ++c)
                stored.at(x, y, c) = stored.at(x, y, 4 + c) = edge ? 0.1f : 0.3f * float(c + 1);
            stored.at(x, y, 3) = edge ? 0.5f : 1;
        }
    ASSERT_TRUE(io::write_planes_exr(at("in.0001.exr"), stored,
                                     {"R", "G", "B", "A", "light.R", "light.G", "light.B"})
                    .ok());
    chain_ = test::chain_of("fxaa");
    settings_.on_existing = io::OnExisting::overwrite;
    settings_.source.layers.aovs = "light";
    for (const char* unassociated : {"true", "false"}) {
        const ProfileFile own = parse_profile(
            concat("profile: 1\nname: own\ncolor: [{channels: [[R, G, B, A]], unpremultiplied: ",
                   unassociated, "}]\n"),
            "own.yaml");
        ASSERT_TRUE(own.status().ok()) << own.status().message();
        settings_.source.profile = own.profile;
        ASSERT_TRUE(last_frame().status.ok());
        auto file = io::ExrFile::open(out(1));
        ASSERT_TRUE(file.ok());
        const auto color = file->read_channels(0, {"R", "G", "B"}),
                   layer = file->read_channels(0, {"light.R", "light.G", "light.B"});
        ASSERT_TRUE(color.ok() && layer.ok());
        EXPECT_LT(test::largest_difference(*layer, *color), 1e-6) << unassociated;
        const auto before = must(io::ExrFile::open(in(1))).read_channels(0, {"R", "G", "B"});
        EXPECT_GT(test::largest_difference(*color, *before), 0.01) << unassociated;
    }
}

// The text is part of the fingerprint: what is not in it is not made again.
TEST(FrameLayersText, NamesWhatDecidesPixels) {
    FrameLayers plain;
    for (const char* name : {"first", "second"}) plain.cryptomattes.emplace_back().name = name;
    plain.filtered.resize(1);
    plain.filtered[0].channels = {1, {"R", "G"}};
    plain.mattes.resize(1);
    plain.mattes[0].channel = {0, {"mask"}};
    const std::pair<const char*, std::function<void(FrameLayers&)>> changes[] = {
        {"nothing", [](FrameLayers&) {}},
        {"part of a layer", [](FrameLayers& l) { l.filtered[0].channels.part = 2; }},
        {"channel of a layer", [](FrameLayers& l) { l.filtered[0].channels.channels[1] = "B"; }},
        {"a layer more", [](FrameLayers& l) { l.filtered.push_back(l.filtered[0]); }},
        {"a filtered cryptomatte", [](FrameLayers& l) { l.filtered_cryptomattes = 1; }},
        {"both", [](FrameLayers& l) { l.filtered_cryptomattes = 2; }},
        {"some ids",
         [](FrameLayers& l) {
             l.filtered_cryptomattes = 2;
             l.filtered_ids[0] = {7};
         }},
        {"ids of the second",
         [](FrameLayers& l) {
             l.filtered_cryptomattes = 2;
             l.filtered_ids[1] = {7};
         }},
        {"other ids",
         [](FrameLayers& l) {
             l.filtered_cryptomattes = 2;
             l.filtered_ids[0] = {7, 8};
         }},
        {"no id",
         [](FrameLayers& l) {
             l.filtered_cryptomattes = 2;
             l.cryptomattes[0].name = "third";
         }},
        {"channel of a matte", [](FrameLayers& l) { l.mattes[0].channel.channels = {"other"}; }},
        {"part of a matte", [](FrameLayers& l) { l.mattes[0].channel.part = 1; }},
        {"ids of a matte", [](FrameLayers& l) { l.mattes[0].ids[0] = {7}; }},
        {"cryptomatte of a matte", [](FrameLayers& l) { l.mattes[0].ids[1] = {7}; }},
        {"two ids of a matte",
         [](FrameLayers& l) {
             l.mattes[0].ids[0] = {7, 8};
         }},
        {"no matte", [](FrameLayers& l) { l.mattes.clear(); }},
        {"fill mask", [](FrameLayers& l) { l.fill_mask = "fill"; }},
        {"another fill mask", [](FrameLayers& l) { l.fill_mask = "fill2"; }}};
    std::map<std::string, std::string> names;
    for (const auto& [name, change] : changes) {
        FrameLayers layers = plain;
        change(layers);
        const auto [same, is_new] = names.try_emplace(layers.text(), name);
        EXPECT_TRUE(is_new) << name << " has the text of " << same->second;
    }
}

// Only the first cryptomattes are filtered.
TEST(LayersLacking, NamesWhatTheOtherFrameDoesNotFilter) {
    const auto layers_of = [](std::vector<std::string> names, size_t filtered) {
        FrameLayers layers;
        for (std::string& name : names) layers.cryptomattes.emplace_back().name = std::move(name);
        layers.filtered_cryptomattes = filtered;
        return layers;
    };
    const FrameLayers frame = layers_of({"Object", "Material", "Asset"}, 2);
    EXPECT_THAT(layers_lacking(frame, layers_of({"Material", "Object"}, 2)), ElementsAre());
    EXPECT_THAT(layers_lacking(frame, layers_of({"Material", "Object"}, 1)), ElementsAre("Object"));
    EXPECT_THAT(layers_lacking(frame, FrameLayers()), ElementsAre("Object", "Material"));
    EXPECT_THAT(layers_lacking(FrameLayers(), frame), ElementsAre());
}

}  // namespace
}  // namespace postchain::sequence::frame_layers_test
