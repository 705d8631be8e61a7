// Color in and out through an OpenColorIO configuration whose transforms have closed
// forms, repeated here.
#include <cmath>
#include <limits>

#include "tests/run/pictures.h"

namespace postchain::test::ocio_test {
namespace {

// Stored values: halved is half of lin, fourfold four times it; camera is log10 after the inverse
// of kMatrix, film the power 1/2.4 after kPrint.
constexpr double kMatrix[3][3] = {{0.9, 0.1, 0}, {0.05, 0.9, 0.05}, {0, 0.2, 0.8}};
constexpr double kPrint[3][3] = {{0.8, 0.2, 0}, {0.1, 0.8, 0.1}, {0, 0.1, 0.9}};
constexpr const char* kConfig =
    "ocio_profile_version: 1\n"
    "search_path: ''\n"
    "roles: {scene_linear: lin, default: lin}\n"
    "displays:\n"
    "  screen:\n"
    "    - !<View> {name: Plain, colorspace: lin}\n"
    "    - !<View> {name: Halved, colorspace: halved}\n"
    "  wall:\n"
    "    - !<View> {name: Bright, colorspace: fourfold}\n"
    "    - !<View> {name: Film, colorspace: film}\n"
    "active_displays: [screen, wall]\n"
    "active_views: [Plain, Halved, Bright, Film]\n"
    "colorspaces:\n"
    "  - !<ColorSpace>\n"
    "    name: lin\n"
    "  - !<ColorSpace>\n"
    "    name: halved\n"
    "    from_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, "
    "0, 0, 0, 1]}\n"
    "  - !<ColorSpace>\n"
    "    name: fourfold\n"
    "    from_reference: !<MatrixTransform> {matrix: [4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0, "
    "0, 0, 0, 1]}\n"
    "  - !<ColorSpace>\n"
    "    name: camera\n"
    "    to_reference: !<GroupTransform>\n"
    "      children:\n"
    "        - !<LogTransform> {base: 10, direction: inverse}\n"
    "        - !<MatrixTransform> {matrix: [0.9, 0.1, 0, 0, 0.05, 0.9, 0.05, 0, 0, 0.2, 0.8, 0, "
    "0, 0, 0, 1]}\n"
    "  - !<ColorSpace>\n"
    "    name: film\n"
    "    from_reference: !<GroupTransform>\n"
    "      children:\n"
    "        - !<MatrixTransform> {matrix: [0.8, 0.2, 0, 0, 0.1, 0.8, 0.1, 0, 0, 0.1, 0.9, 0, "
    "0, 0, 0, 1]}\n"
    "        - !<ExponentTransform> {value: [2.4, 2.4, 2.4, 1], direction: inverse}\n";

using Triple = std::array<double, 3>;
Triple times(const double (&m)[3][3], const Triple& v) {
    Triple out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) out[i] += m[i][k] * v[k];
    return out;
}

class OcioTest : public FormatsTest {
  protected:
    void SetUp() override {
        FormatsTest::SetUp();
        write_text(config(), kConfig);
    }
    std::string config() const { return at("config.ocio"); }
    Words with_config(Words more) const {
        more.insert(more.end(), {"--ocio", config()});
        return more;
    }
};

TEST_F(OcioTest, StoredValuesOfAColorSpaceAreReadAsItsTransformSays) {
    set_variable("OCIO", at("none.ocio"));  // the option counts
    const Kind kind{"c.png", kByte, 8, 3, true};
    const Stored picture = noise_of(kind);
    write_picture(at("c.png"), kind, picture);
    const auto outcome =
        through("c.png", "o.exr", with_config({"--input-transfer", "ocio:camera"}));
    ASSERT_EQ(outcome.code, 0) << outcome.said;
    const ImageF light = read_color(at("out/o.exr"));
    double largest = 0;
    for (size_t i = 0; i < light.pixels(); ++i) {
        Triple v{};
        for (size_t c = 0; c < 3; ++c) v[c] = std::pow(10, double(picture.values[3 * i + c]));
        v = times(kMatrix, v);
        for (size_t c = 0; c < 3; ++c)
            largest = std::max(largest, std::abs(light.data[3 * i + c] / v[c] - 1));
    }
    EXPECT_LT(largest, 1e-5);
    // Another space for the frames: four times the light.
    ASSERT_EQ(
        through("c.png", "o.exr",
                with_config({"--input-transfer", "ocio:camera", "--ocio-colorspace", "fourfold"}))
            .code,
        0);
    const ImageF more = read_color(at("out/o.exr"));
    for (size_t i = 0; i < light.data.size(); i += 97)
        EXPECT_NEAR(more.data[i] / light.data[i], 4, 1e-5) << i;
    // A role stands for its space.
    ASSERT_EQ(
        through("c.png", "o.exr", with_config({"--input-transfer", "ocio:scene_linear"})).code, 0);
    EXPECT_NEAR(read_color(at("out/o.exr")).data[30], picture.values[30], 1e-7);
}

TEST_F(OcioTest, LightIsStoredInAColorSpaceOrAsAViewShowsIt) {
    set_variable("OCIO", at("none.ocio"));  // the option counts
    std::vector<std::array<float, 4>> pixels;
    std::vector<Triple> codes;
    for (int i = 0; i < 64; ++i) {
        const Triple v = {i / 63.0, (i * 5 % 64) / 63.0, (i * 11 % 64) / 63.0};
        const Triple light = times(
            kMatrix, {std::pow(10, v[0]) / 16, std::pow(10, v[1]) / 16, std::pow(10, v[2]) / 16});
        codes.push_back(v);
        pixels.push_back({float(light[0]), float(light[1]), float(light[2]), 1});
    }
    write_exr("in.exr", pixels);
    const auto stored = [&](const Words& more) {
        const auto outcome = through("in.exr", "o.png", with_config(more));
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        return read_picture(at("out/o.png"));
    };
    const Stored camera = stored({"--output-transfer", "ocio:camera", "--overflow", "clamp"});
    const Stored film = stored({"--output-transfer", "view", "--ocio-view", "Film",
                                "--ocio-display", "wall", "--bits", "8"});
    for (size_t i = 0; i < pixels.size(); ++i) {
        const Triple print =
            times(kPrint, {double(pixels[i][0]), double(pixels[i][1]), double(pixels[i][2])});
        for (size_t c = 0; c < 3; ++c) {
            const size_t at = i * size_t(film.channels) + c;
            // Half a step plus single-precision error.
            EXPECT_NEAR(film.values[at] * 255, std::pow(print[c], 1 / 2.4) * 255, 0.506) << i;
            // The light is divided by sixteen, and log10(16) is subtracted.
            EXPECT_NEAR(camera.values[at], std::max(0.0, codes[i][c] - std::log10(16.0)),
                        1.5 / 65535)
                << i;
        }
    }
}

TEST_F(OcioTest, AlphaIsNoColorAndColorIsTransformedAsItIsStored) {
    write_exr("in.exr", {{0.25f, 0, 0.125f, 0.5f}, {0, 0, 0, 0}, {0.5f, 0.5f, 0.5f, 1}});
    const auto film = [](Triple v) {
        v = times(kPrint, v);
        for (double& one : v) one = std::pow(one, 1 / 2.4);
        return v;
    };
    for (const auto& [name, first] :
         {std::pair{"o.png", film({0.5, 0, 0.25})}, {"o.tif", film({0.25, 0, 0.125})}}) {
        const auto outcome =
            through("in.exr", name,
                    with_config({"--output-transfer", "view", "--ocio-view", "Film",
                                 "--ocio-display", "wall", "--bits", "16"}));
        ASSERT_EQ(outcome.code, 0) << outcome.said;
        const Stored out = read_picture(at(std::string("out/") + name));
        ASSERT_EQ(out.channels, 4);
        for (size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(out.values[c], first[c], 3e-5) << name;
            EXPECT_EQ(out.values[4 + c], 0) << name;
            EXPECT_NEAR(out.values[8 + c], std::pow(0.5, 1 / 2.4), 3e-5) << name;
        }
        EXPECT_NEAR(out.values[3], 0.5, 1.0 / 65535) << name;
        EXPECT_EQ(out.values[7], 0) << name;
    }
}

TEST_F(OcioTest, WhatDoesNotFitAfterTheTransformIsAnErrorOrClamped) {
    const float inf = std::numeric_limits<float>::infinity();
    write_exr("in.exr", {{0.5f, 0.1f, 0.1f, 1}, {0.2f, 0.2f, 0.2f, 1}, {inf, 0.1f, 0.1f, 1}});
    const Words bright =
        with_config({"--output-transfer", "ocio:fourfold", "--nonfinite", "clamp"});
    const auto refused = through("in.exr", "o.png", bright);
    EXPECT_EQ(refused.code, 5) << refused.said;
    EXPECT_TRUE(refused.says("2 pixels do not fit")) << refused.said;
    // A view is clamped unless it is refused.
    const auto outcome =
        through("in.exr", "o.png",
                with_config({"--output-transfer", "view", "--ocio-display", "wall", "--ocio-view",
                             "Bright", "--nonfinite", "clamp", "--bits", "8"}));
    ASSERT_EQ(outcome.code, 0) << outcome.said;
    EXPECT_TRUE(outcome.says("2 pixels clamped")) << outcome.said;
    const Stored out = read_picture(at("out/o.png"));
    EXPECT_EQ(out.values[0], 1);
    EXPECT_NEAR(out.values[1], 102 / 255.0, 1e-6);
    EXPECT_NEAR(out.values[4], 204 / 255.0, 1e-6);
    EXPECT_EQ(out.values[8], 1);
    EXPECT_NEAR(out.values[9], 102 / 255.0, 1e-6);
}

// Round trip through a transform in single precision: less than half a 16-bit code.
TEST_F(OcioTest, AChainThatDoesNothingGivesTheStoredValuesBack) {
    const Kind kinds[] = {{"c.png", kByte, 8, 4, true}, {"c.png", kShort, 16, 3, true},
                          {"c.dpx", kShort, 10, 3},     {"c.dpx", kShort, 12, 3},
                          {"c.tif", kByte, 8, 3},       {"c.tif", kShort, 16, 4}};
    for (const Kind& kind : kinds) {
        write_picture(at(kind.file), kind, noise_of(kind));
        const Stored in = read_picture(at(kind.file));
        for (const char* space : {"ocio:camera", "ocio:halved"}) {
            const auto outcome =
                through(kind.file, kind.file, with_config({"--input-transfer", space}));
            ASSERT_EQ(outcome.code, 0) << outcome.said;
            EXPECT_EQ(read_picture(at(std::string("out/") + kind.file)).values, in.values)
                << kind.file << " " << kind.bits << " " << space;
        }
    }
}

// tests/io notices a changed table of a configuration.
TEST_F(OcioTest, WhatAConfigurationShowsIsMadeAgainWhenItHasChanged) {
    write_exr("in.exr", {{0.5f, 0.25f, 0.125f, 1}});
    const auto again = [&](const char* name, const Words& more) {
        Words words = {"--on-existing", "skip"};
        words.insert(words.end(), more.begin(), more.end());
        const auto outcome = through("in.exr", name, words);
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        return outcome.says("written");
    };
    const auto red = [&] {
        return int(std::lround(read_picture(at("out/o.png")).values.front() * 255));
    };
    const Words view = with_config({"--output-transfer", "view"});
    EXPECT_TRUE(again("view.png", view));
    EXPECT_FALSE(again("view.png", view));
    const Words halved = with_config({"--png", "--ocio-view", "Halved"});
    for (const auto& [words, shown] : {std::pair<Words, int>{{"--png"}, 155},
                                       {with_config({"--png", "--ocio-display", "wall"}), 255},
                                       {halved, 64}}) {
        EXPECT_TRUE(again("o.exr", words));
        EXPECT_FALSE(again("o.exr", words));
        EXPECT_EQ(red(), shown);
    }
    // Another configuration of the same name.
    std::string doubled = kConfig;
    const std::string matrix = "matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5";
    doubled.replace(doubled.find(matrix), matrix.size(),
                    "matrix: [1.5, 0, 0, 0, 0, 1.5, 0, 0, 0, 0, 1.5");
    write_text(config(), doubled);
    EXPECT_TRUE(again("view.png", view));
    EXPECT_TRUE(again("o.exr", halved));
    EXPECT_EQ(red(), 191);
    // A run without a preview compares none.
    EXPECT_FALSE(again("o.exr", {}));
}

TEST_F(OcioTest, APreviewIsTheViewOfAConfiguration) {
    write_exr("in.exr", {{0.5f, 0.25f, -1, 1}, {3, 0.125f, 0, 1}});
    const auto preview = [&](Words more) {
        more.push_back("--png");
        const auto outcome = through("in.exr", "o.exr", more);
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        std::vector<int> codes;
        for (const float v : read_picture(at("out/o.png")).values)
            codes.push_back(int(std::lround(v * 255)));
        return codes;
    };
    using Codes = std::vector<int>;
    const Codes plain = {128, 64, 0, 255, 32, 0};
    EXPECT_EQ(preview(with_config({})), plain);
    EXPECT_EQ(preview(with_config({"--ocio-view", "Halved"})), (Codes{64, 32, 0, 255, 16, 0}));
    // Stored as four times the light: the same view shows a quarter.
    EXPECT_EQ(preview(with_config({"--ocio-colorspace", "fourfold"})),
              (Codes{32, 16, 0, 191, 8, 0}));
    EXPECT_EQ(preview(with_config({"--ocio-display", "wall"})), (Codes{255, 255, 0, 255, 128, 0}));
    set_variable("OCIO", config());
    EXPECT_EQ(preview({}), plain);
    set_variable("OCIO", at("none.ocio"));
    EXPECT_EQ(preview(with_config({})), plain) << "the option counts";
    set_variable("OCIO", "");
    EXPECT_EQ(preview({})[0], 155);  // (0.5 / 1.5)^(1/2.2)
}

TEST_F(OcioTest, AConfigurationThatCannotBeUsedIsAnErrorThatSaysWhatThereIs) {
    write_text(at("broken.ocio"), "ocio_profile_version: [");
    write_exr("in.exr", {{0.5f, 0.25f, 0, 1}});
    struct Case {
        const char* output;
        Words words;
        int code;
        const char* why;
    };
    for (const Case& one : std::vector<Case>{
             {"o.exr", {"--png", "--ocio", at("none.ocio")}, 4, "no such file"},
             {"o.exr", {"--png", "--ocio", at("broken.ocio")}, 4, "broken.ocio"},
             {"o.exr", with_config({"--png", "--ocio-view", "Film"}), 2, "Plain, Halved"},
             {"o.exr", with_config({"--png", "--ocio-display", "tv"}), 2, "screen, wall"},
             {"o.exr", with_config({"--png", "--ocio-colorspace", "aces"}), 2, "lin, halved"},
             {"o.exr", with_config({}), 2, "has no effect by itself"},
             {"o.exr", with_config({"--ocio-view", "Halved"}), 2, "--output-transfer view"},
             {"o.exr", {"--output-transfer", "view"}, 2, "needs an OpenColorIO configuration"},
             {"o.exr", with_config({"--output-transfer", "ocio:halved"}), 2, "EXR outputs, which"},
             {"o.exr", with_config({"--output-transfer", "view"}), 2, "look at it with --png"},
             {"o.exr", with_config({"--input-transfer", "ocio:halved"}), 2, "leave it out"},
             {"o.exr", with_config({"--input-transfer", "view"}), 2, "cannot be inverted"},
             {"o.exr", with_config({"--input-transfer", "halved"}), 2, "ocio:SPACE"},
             {"o.exr", {"--png", "--ocio-view", "Film"}, 2, "--ocio-view needs an OpenColorIO"},
             {"o.exr", {"--png", "--ocio-display", "tv"}, 2, "--ocio-display needs an OpenColorIO"},
             {"o.png", with_config({"--output-transfer", "ocio:film2"}), 2,
              "has no 'film2'; it has"},
             {"o.png", with_config({"--output-transfer", "view", "--ocio-view", "Noir"}), 2,
              "Plain, Halved"},
             {"o.png",
              {"--output-transfer", "ocio:film", "--ocio", at("broken.ocio")},
              4,
              "broken.ocio"}}) {
        const auto outcome = through("in.exr", one.output, one.words);
        EXPECT_EQ(outcome.code, one.code) << one.why << outcome.said;
        EXPECT_TRUE(outcome.says(one.why)) << one.why << outcome.said;
        EXPECT_FALSE(exists(at(std::string("out/") + one.output)));
    }
}

}  // namespace
}  // namespace postchain::test::ocio_test
