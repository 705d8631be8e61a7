// Color in non-EXR formats. OpenImageIO writes and reads the stored values; the
// curves' formulas are repeated here from their standards.
#include <cmath>

#include "tests/run/pictures.h"
#include "tests/support/status.h"

namespace postchain::test::formats_test {
namespace {

const Kind kKinds[] = {
    {"c.png", kByte, 8, 3, true},
    {"c.png", kByte, 8, 4, true},
    {"c.png", kShort, 16, 3, true},
    {"c.png", kShort, 16, 4, true},
    {"c.tif", kByte, 8, 3},
    {"c.tif", kShort, 16, 4},
    {"c.tif", kShort, 16, 4, true},
    {"c.tif", kFloat, 32, 3},
    {"c.tiff", kFloat, 32, 4},
    {"c.tif", kFloat, 32, 4, true},
    {"c.dpx", kByte, 8, 3},
    {"c.dpx", kShort, 10, 3},
    {"c.dpx", kShort, 12, 3},
    {"c.dpx", kShort, 16, 4},
    {"c.dpx", kShort, 10, 3, false, "KodakLog"},
    {"c.hdr", kFloat, 32, 3},
};

TEST_F(FormatsTest, AChainThatDoesNothingGivesTheStoredValuesBack) {
    for (const Kind& kind : kKinds) {
        const std::string what =
            concat(kind.file, " ", kind.bits, " bits, ", kind.channels, " channels", kind.space);
        write_picture(at(kind.file), kind, noise_of(kind));
        OIIO::ImageSpec before, after;
        const Stored in = read_picture(at(kind.file), &before);
        const auto outcome = through(kind.file, kind.file);
        ASSERT_EQ(outcome.code, 0) << what << outcome.said;
        const Stored out = read_picture(at(std::string("out/") + kind.file), &after);
        EXPECT_EQ(out.width, in.width) << what;
        EXPECT_EQ(out.channels, in.channels) << what;
        EXPECT_EQ(after.format, before.format) << what;
        for (const char* number : {"oiio:BitsPerSample", "oiio:UnassociatedAlpha"})
            EXPECT_EQ(after.get_int_attribute(number), before.get_int_attribute(number)) << what;
        EXPECT_EQ(after.get_string_attribute("ImageDescription"),
                  before.get_string_attribute("ImageDescription"))
            << what;
        EXPECT_TRUE(out.values == in.values) << what;
    }
}

TEST_F(FormatsTest, ValuesAreDecodedByTheirCurve) {
    const Kind kind{"c.png", kByte, 8, 3, true};
    Stored ramp{256, 1, 3, {}};
    for (int i = 0; i < 256 * 3; ++i) ramp.values.push_back(float(i / 3) / 255);
    write_picture(at("c.png"), kind, ramp);
    const auto light_of = [&](const Words& more) {
        const auto outcome = through("c.png", "o.exr", more);
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        return read_color(at("out/o.exr"));
    };
    const auto curve = [&](const char* name) { return light_of({"--input-transfer", name}); };
    const ImageF plain = light_of({}), linear = curve("linear"), rec709 = curve("rec709"),
                 gamma = curve("gamma22"), cineon = curve("cineon");
    for (int code = 0; code < 256; ++code) {
        const double v = code / 255.0;
        EXPECT_NEAR(plain.at(code, 0, 1),
                    v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4), 1e-7)
            << code;
        EXPECT_NEAR(linear.at(code, 0, 1), v, 1e-7) << code;
        EXPECT_NEAR(rec709.at(code, 0, 1),
                    v < 0.08124 ? v / 4.5 : std::pow((v + 0.0992968) / 1.0992968, 1 / 0.45), 1e-7)
            << code;
        EXPECT_NEAR(gamma.at(code, 0, 1), std::pow(v, 2.2), 1e-7) << code;
        // Cineon as in Kodak's definition and OpenColorIO's default configurations: 685 is 1, 95 is
        // 0.
        const double black = std::pow(10, (95 - 685) * 0.002 / 0.6);
        const double log = (std::pow(10, (1023 * v - 685) * 0.002 / 0.6) - black) / (1 - black);
        EXPECT_NEAR(cineon.at(code, 0, 1), log, 2e-6 * std::max(1.0, log)) << code;
    }
}

TEST_F(FormatsTest, LightIsEncodedByTheCurveOfTheFormat) {
    write_exr("in.exr", {{0.5f, 0.002f, 1, 1}, {0.25f, 0, 0.125f, 0.5f}, {0, 0, 0, 0}});
    ASSERT_EQ(through("in.exr", "o.png").code, 0);
    const Stored png = read_picture(at("out/o.png"));
    ASSERT_EQ(png.channels, 4);
    // 1.055 * 0.5^(1/2.4) - 0.055, 12.92 * 0.002; the second pixel is divided by its alpha.
    const double expected[] = {0.735357, 0.02584, 1, 1, 0.735357, 0, 0.537099, 0.5, 0, 0, 0, 0};
    for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(png.values[i], expected[i], 1.0 / 65535) << i;
    ASSERT_EQ(through("in.exr", "o.tif").code, 0);
    const Stored tiff = read_picture(at("out/o.tif"));
    EXPECT_EQ(tiff.values,
              (std::vector<float>{0.5f, 0.002f, 1, 1, 0.25f, 0, 0.125f, 0.5f, 0, 0, 0, 0}));
    ASSERT_EQ(through("in.exr", "o.tif", {"--bits", "8", "--output-transfer", "linear"}).code, 0);
    OIIO::ImageSpec spec;
    EXPECT_EQ(read_picture(at("out/o.tif"), &spec).values[0], 128 / 255.f);
    EXPECT_EQ(spec.format, kByte);
    ASSERT_EQ(through("in.exr", "o.jpg").code, 0);
    EXPECT_THAT(sidecar_of("o.jpg")["write_notes"].dump(), testing::HasSubstr("alpha left out"));
}

TEST_F(FormatsTest, ValuesThatDoNotFitAreAnErrorOrClampedAndCounted) {
    write_exr("in.exr", {{1.5f, 0, 0, 1}, {0, -0.1f, 0, 1}, {1.000001f, -1e-7f, 0.5f, 1}});
    for (const auto& [name, more] : {std::pair<const char*, Words>{"o.png", {}},
                                     {"o.jpg", {"--overflow", "refuse"}},
                                     {"o.dpx", {"--overflow", "refuse"}}}) {
        const auto outcome = through("in.exr", name, more);
        EXPECT_EQ(outcome.code, 5) << name << outcome.said;
        EXPECT_TRUE(outcome.says("2 pixels do not fit")) << outcome.said;
        EXPECT_TRUE(outcome.says("--overflow clamp")) << outcome.said;
        EXPECT_FALSE(exists(at(std::string("out/") + name)));
    }
    // JPEG shows a picture on a display, where light above white is white.
    const auto jpeg = through("in.exr", "o.jpg");
    EXPECT_EQ(jpeg.code, 0) << jpeg.said;
    EXPECT_TRUE(jpeg.says("2 pixels clamped to the range of the format")) << jpeg.said;
    EXPECT_EQ(sidecar_of("o.jpg")["health"]["output_half_overflow"], 2);
    const auto outcome = through("in.exr", "o.png", {"--overflow", "clamp"});
    EXPECT_EQ(outcome.code, 0) << outcome.said;
    EXPECT_TRUE(outcome.says("2 pixels clamped")) << outcome.said;
    const Stored png = read_picture(at("out/o.png"));
    EXPECT_EQ(png.values[0], 1);
    EXPECT_EQ(png.values[5], 0);
    EXPECT_EQ(png.values[8], 1);
    // HDR holds values above 1 but none below 0; float TIFF holds both.
    const auto hdr = through("in.exr", "o.hdr");
    EXPECT_EQ(hdr.code, 5);
    EXPECT_TRUE(hdr.says("2 pixels do not fit (it holds no negative")) << hdr.said;
    ASSERT_EQ(through("in.exr", "o.tif").code, 0);
    EXPECT_EQ(read_picture(at("out/o.tif")).values[5], -0.1f);
}

TEST_F(FormatsTest, DamagedAndUnsuitablePicturesAreErrorsWithTheirName) {
    for (const Kind& kind :
         {kKinds[0], kKinds[5], kKinds[7], kKinds[11], kKinds[15], Kind{"c.jpg", kByte, 8, 3}}) {
        write_picture(at(kind.file), kind, noise_of(kind));
        const std::string whole = read_text(at(kind.file));
        for (const double part : {0.0, 0.1, 0.999}) {
            write_text(at(kind.file), whole.substr(0, size_t(part * double(whole.size()))));
            const auto outcome = through(kind.file, "o.exr");
            EXPECT_EQ(outcome.code, 4) << kind.file << " " << part << outcome.said;
            EXPECT_TRUE(outcome.says(at(kind.file))) << outcome.said;
            EXPECT_FALSE(exists(at("out/o.exr"))) << kind.file << " " << part;
        }
    }
    const Kind gray{"g.png", kByte, 8, 1};
    write_picture(at("g.png"), gray, noise_of(gray));
    EXPECT_TRUE(through("g.png", "o.exr").says("has 1 channels"));
    write_picture(at("c.png"), kKinds[0], noise_of(kKinds[0]));
    std::filesystem::copy(at("c.png"), at("named.tif"));
    EXPECT_TRUE(through("named.tif", "o.exr").says("its name says tiff"));
    const auto depth = run({"--input", concat("color=", at("c.png"), ",depth=", at("c.png")),
                            "--output", at("out/o.exr")});
    EXPECT_EQ(depth.code, 4);
    EXPECT_TRUE(depth.says("read from EXR")) << depth.said;
}

TEST_F(FormatsTest, SettingsThatDoNotSuitTheFormatAreRefused) {
    write_exr("in.exr", {{0, 0, 0, 1}});
    const std::tuple<const char*, Words, const char*> cases[] = {
        {"o.bmp", {}, "outputs end in .exr, .png"},
        {"o.png", {"--bits", "10"}, "png has 16, 8 bits, not 10"},
        {"o.png", {"--half"}, "apply only to EXR outputs"},
        {"o.png", {"--compression", "zip"}, "apply only to EXR outputs"},
        {"o.png", {"--channels", "R"}, "apply only to EXR outputs"},
        {"o.exr", {"--bits", "8"}, "do not apply to EXR outputs"},
        {"o.exr", {"--output-transfer", "srgb"}, "do not apply to EXR outputs"},
    };
    for (const auto& [name, more, why] : cases) {
        const auto outcome = through("in.exr", name, more);
        EXPECT_EQ(outcome.code, 2) << name << outcome.said;
        EXPECT_TRUE(outcome.says(why)) << outcome.said;
    }
}

TEST_F(FormatsTest, AnExrOfAPictureHasWhatIsAskedFor) {
    write_picture(at("c.png"), kKinds[1], noise_of(kKinds[1]));
    const auto written = [&](const Words& more) {
        const auto outcome = through("c.png", "o.exr", more);
        EXPECT_EQ(outcome.code, 0) << outcome.said;
        const io::ExrPart part = must(io::ExrFile::open(at("out/o.exr"))).parts()[0];
        std::string text = part.compression;
        for (const auto& channel : part.channels)
            text += concat(" ", channel.name, ":", io::name_of(channel.type));
        return text;
    };
    EXPECT_EQ(written({}), "zip A:float B:float G:float R:float");
    EXPECT_EQ(written({"--half", "--compression", "piz"}), "piz A:half B:half G:half R:half");
    EXPECT_EQ(written({"--channels", "R,G"}), "zip G:float R:float");
    // Values of channels that are not written do not have to fit.
    write_picture(at("c.tif"), {"c.tif", kFloat, 32, 3}, {1, 1, 3, {0.5f, 1e6f, 0.25f}});
    EXPECT_EQ(through("c.tif", "o.exr", {"--half"}).code, 5);
    EXPECT_EQ(through("c.tif", "o.exr", {"--half", "--channels", "R,B"}).code, 0);
}

// The filters see the same light, whichever file format it comes from.
TEST_F(FormatsTest, AFilteredPictureIsThatOfTheSameLightInAnExr) {
    write_sequence(at(""), {1});
    const Kind kind{"c.png", kByte, 8, 4, true};
    Stored picture = noise_of(kind, 48, 32);
    for (size_t i = 3; i < picture.values.size(); i += 4) picture.values[i] = 1;
    write_picture(at("c.png"), kind, picture);
    ASSERT_EQ(through("c.png", "light.exr").code, 0);
    chain_ = chain_of("motion_blur", {{"mode", "guertin"}, {"shutter_frames", 0.5}});
    const auto blurred = [&](const std::string& color, const std::string& name) {
        const auto outcome = run(
            {"--input",
             concat("color=", color, ",depth=", at("in.0001.exr"), ",motion=", at("in.0001.exr")),
             "--output", at(name), "--profile", "cycles"});
        EXPECT_EQ(outcome.code, 0) << outcome.said;
    };
    blurred(at("c.png"), "out/a.exr");
    blurred(at("out/light.exr"), "out/b.exr");
    const ImageF a = read_color(at("out/a.exr"));
    EXPECT_EQ(a.data, read_color(at("out/b.exr")).data);
    EXPECT_GT(largest_difference(a, read_color(at("out/light.exr"))), 0.05);
}

TEST_F(FormatsTest, WhatIsDoneIsKeptByItsSidecar) {
    write_exr("in.exr", {{0.5f, 0.5f, 0.5f, 1}});
    const auto again = [&](Words more) {
        more.insert(more.end(), {"--on-existing", "skip"});
        return through("in.exr", "o.png", more);
    };
    EXPECT_TRUE(again({}).says("written"));
    EXPECT_TRUE(again({}).says("skipped"));
    write_text(at("out/o.png"), "cut");
    EXPECT_TRUE(again({}).says("written"));
}

}  // namespace
}  // namespace postchain::test::formats_test
