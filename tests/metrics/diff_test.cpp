// postchain diff as a command.
#include <OpenImageIO/imagebuf.h>

#include <cmath>
#include <limits>

#include "tests/command/fixture.h"
#include "tests/metrics/support.h"
#include "tools/measure/metrics/compare.h"

namespace postchain::test {
namespace {

using io::PixelType;

class DiffTest : public CommandTest {
  protected:
    // A separate RGB file, float, with the given windows.
    void write_rgb(const std::string& path, const ImageF& image, int origin_x = 0,
                   std::optional<io::Window> display = {}) {
        io::PlanesFile file;
        for (int c = 0; c < 3; ++c)
            file.channels.push_back({std::string(1, "RGB"[c]), PixelType::float32, &image, c});
        file.origin_x = origin_x;
        file.display_window = display;
        const auto written = io::write_planes_exr(path, file);
        ASSERT_TRUE(written.ok()) << written.status().message();
    }
    void write_gray(const std::string& path, double v, int width = 16, int height = 12) {
        write_rgb(path, metrics::gray(width, height, v));
    }
    // a.#### is 0.5; b.#### differs by 0.1, 0.2, 0.3 in frames 1, 2, 3.
    void write_sequences() {
        for (int frame = 1; frame <= 3; ++frame) {
            write_gray(at("a.000" + std::to_string(frame) + ".exr"), 0.5);
            write_gray(at("b.000" + std::to_string(frame) + ".exr"), 0.5 + 0.1 * frame);
        }
    }
    Outcome diff(const std::string& a, const std::string& b, const Arguments& more = {}) {
        Arguments arguments = {"diff", at(a), at(b)};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }
};

TEST_F(DiffTest, PrintsOneObjectWithAKeyPerMetric) {
    write_gray(at("a.exr"), 0.5);
    write_gray(at("b.exr"), 0.7);
    const Outcome result = diff("a.exr", "b.exr", {"--json"});
    ASSERT_EQ(result.code, 0) << result.text();
    const auto lines = json_lines(result.out);
    ASSERT_EQ(lines.size(), 1u);
    const Json& json = lines[0];
    for (const char* key :
         {"flip", "hdr_flip", "relmse", "smape", "mse", "psnr", "ssim", "nonfinite"})
        EXPECT_TRUE(json.contains(key) && json[key].is_number()) << key;
    EXPECT_NEAR(json["mse"].get<double>(), 0.04, 1e-6);
    EXPECT_NEAR(json["relmse"].get<double>(), 0.04 / (0.51 * 0.51), 1e-5);
    EXPECT_EQ(json["settings"]["relmse_epsilon"], 0.01);
    EXPECT_EQ(json["settings"]["pixels_per_degree"], 67.02);
    EXPECT_EQ(json["settings"]["tone_mapper"], "aces");
    EXPECT_FALSE(json.contains("tde"));
}

TEST_F(DiffTest, PrintsTextWithItsConstants) {
    write_gray(at("a.exr"), 0.5);
    write_gray(at("b.exr"), 0.7);
    const Outcome result = diff("a.exr", "b.exr");
    ASSERT_EQ(result.code, 0) << result.text();
    for (const auto& row : metrics::metric_rows()) EXPECT_TRUE(contains(result.out, row.name));
    EXPECT_TRUE(contains(result.out, "relmse_epsilon 0.01"));
    EXPECT_TRUE(contains(result.out, "smape_epsilon 0.02"));
}

TEST_F(DiffTest, TheFirstImageIsTheReference) {
    write_gray(at("a.exr"), 0.99);
    write_gray(at("b.exr"), 1.99);
    const auto value = [&](const char* a, const char* b) {
        return json_lines(diff(a, b, {"--json", "--metric", "relmse"}).out)
            .at(0)["relmse"]
            .get<double>();
    };
    EXPECT_NEAR(value("a.exr", "b.exr"), 1, 1e-5);
    EXPECT_NEAR(value("b.exr", "a.exr"), 0.25, 1e-5);
}

TEST_F(DiffTest, ComparesAMultilayerRenderWithPlainRgb) {
    const Planes planes = make_planes(24, 16);
    write_frame(at("layers.exr"), planes);  // ViewLayer.Combined.R ... with depth and vectors
    write_rgb(at("plain.exr"), planes.color);
    const Outcome result = diff("layers.exr", "plain.exr", {"--json", "--metric", "mse"});
    ASSERT_EQ(result.code, 0) << result.text();
    EXPECT_EQ(json_lines(result.out).at(0)["mse"], 0);
}

TEST_F(DiffTest, ComparesUnpremultipliedColorAsPremultiplied) {
    ImageF color(16, 12, 4, 0.5f);  // alpha 0.5, premultiplied 0.5
    Planes planes = make_planes(16, 12);
    planes.color = color;
    write_frame(at("a.exr"), planes);
    write_gray(at("b.exr"), 0.5);
    EXPECT_EQ(json_lines(diff("a.exr", "b.exr", {"--json", "--metric", "mse"}).out).at(0)["mse"],
              0);
}

TEST_F(DiffTest, MetricsCanBeChosenAndRepeated) {
    write_gray(at("a.exr"), 0.5);
    write_gray(at("b.exr"), 0.7);
    const Outcome result =
        diff("a.exr", "b.exr", {"--json", "--metric", "smape", "--metric", "mse"});
    ASSERT_EQ(result.code, 0) << result.text();
    const Json json = json_lines(result.out).at(0);
    EXPECT_TRUE(json.contains("smape") && json.contains("mse"));
    EXPECT_FALSE(json.contains("flip") || json.contains("psnr"));
}

TEST_F(DiffTest, EqualImagesHaveNoPsnr) {
    write_gray(at("a.exr"), 0.5);
    const Json json = json_lines(diff("a.exr", "a.exr", {"--json"}).out).at(0);
    EXPECT_EQ(json["flip"], 0);
    EXPECT_TRUE(json["psnr"].is_null());
    EXPECT_EQ(json["ssim"], 1);
}

TEST_F(DiffTest, OnePixel) {
    write_gray(at("a.exr"), 0.5, 1, 1);
    write_gray(at("b.exr"), 0.7, 1, 1);
    const Outcome result = diff("a.exr", "b.exr", {"--json"});
    ASSERT_EQ(result.code, 0) << result.text();
    const Json json = json_lines(result.out).at(0);
    EXPECT_TRUE(json["ssim"].is_null());
    EXPECT_GT(json["hdr_flip"].get<double>(), 0);
}

TEST_F(DiffTest, BlackReferenceAndNonfinitePixels) {
    ImageF reference = metrics::gray(16, 12, 0), test = reference;
    reference.at(3, 3, 0) = std::numeric_limits<float>::infinity();
    test.at(5, 5, 1) = std::numeric_limits<float>::quiet_NaN();
    test.at(6, 5, 1) = std::numeric_limits<float>::infinity();
    write_rgb(at("a.exr"), reference);
    write_rgb(at("b.exr"), test);
    const Outcome result = diff("a.exr", "b.exr", {"--json"});
    ASSERT_EQ(result.code, 0) << result.text();
    const Json json = json_lines(result.out).at(0);
    EXPECT_EQ(json["nonfinite"], 2);
    EXPECT_EQ(json["nonfinite_reference"], 1);
    EXPECT_EQ(json["mse"], 0);
    EXPECT_EQ(json["hdr_flip"], 0);
    EXPECT_TRUE(contains(result.err, "a.exr"));
}

TEST_F(DiffTest, FailAboveExitsWithEight) {
    write_gray(at("a.exr"), 0.5);
    write_gray(at("b.exr"), 0.7);
    EXPECT_EQ(diff("a.exr", "b.exr", {"--fail-above", "mse=0.05"}).code, 0);
    const Outcome failed =
        diff("a.exr", "b.exr", {"--fail-above", "flip=0.9", "--fail-above", "mse=0.03"});
    EXPECT_EQ(failed.code, 8) << failed.text();
    EXPECT_TRUE(contains(failed.err, "mse"));
    EXPECT_FALSE(contains(failed.err, "flip"));
    // The limit's metric is measured even if another one is requested.
    EXPECT_EQ(diff("a.exr", "b.exr", {"--metric", "smape", "--fail-above", "mse=0.03"}).code, 8);
    EXPECT_EQ(diff("a.exr", "a.exr", {"--fail-above", "flip=0"}).code, 0);
}

// Metrics read them as 0: no limit of another metric would notice.
TEST_F(DiffTest, NonfinitePixelsFailEveryLimit) {
    ImageF clean = metrics::gray(16, 12, 0), bad = clean;
    bad.at(5, 5, 1) = std::numeric_limits<float>::quiet_NaN();
    bad.at(6, 5, 1) = std::numeric_limits<float>::infinity();
    write_rgb(at("clean.exr"), clean);
    write_rgb(at("bad.exr"), bad);
    const Outcome failed = diff("clean.exr", "bad.exr", {"--fail-above", "mse=1"});
    EXPECT_EQ(failed.code, 8) << failed.text();
    EXPECT_TRUE(contains(failed.err,
                         "bad.exr: NaN or infinite pixels: 2, which every other "
                         "metric reads as 0; mend the image, or allow them with "
                         "nonfinite=2"))
        << failed.err;
    EXPECT_EQ(diff("bad.exr", "clean.exr", {"--fail-above", "mse=1"}).code, 8);
    EXPECT_EQ(diff("clean.exr", "bad.exr", {}).code, 0);
    const auto allowed = [&](const char* limit) {
        return diff("clean.exr", "bad.exr", {"--fail-above", "mse=1", "--fail-above", limit}).code;
    };
    EXPECT_EQ(allowed("nonfinite=2"), 0);
    EXPECT_EQ(allowed("nonfinite=1"), 8);
}

TEST_F(DiffTest, EqualImagesHaveAnInfinitePsnr) {
    write_gray(at("a.exr"), 0.5, 8, 8);
    const Outcome equal = diff("a.exr", "a.exr", {});
    EXPECT_TRUE(contains(equal.out, "psnr             inf")) << equal.out;
    EXPECT_TRUE(contains(equal.out, "ssim             none")) << equal.out;  // too small
    // Which of the two it is stands beside the number, and the settings stand once.
    EXPECT_TRUE(contains(equal.out, "flip             0             of values clamped to 0..1"))
        << equal.out;
    EXPECT_TRUE(contains(equal.out, "hdr_flip         0             over ")) << equal.out;
    EXPECT_EQ(equal.out.find("pixels_per_degree"), equal.out.rfind("pixels_per_degree"));
}

TEST_F(DiffTest, UsageErrorsExitWithTwo) {
    write_gray(at("a.exr"), 0.5);
    write_sequences();
    const std::vector<Arguments> wrong = {{"--metric", "vmaf"},
                                          {"--fail-above", "flip"},
                                          {"--fail-above", "flip=x"},
                                          {"--fail-above", "flip="},
                                          {"--fail-above", "vmaf=1"},
                                          {"--fail-above", "psnr=30"},
                                          {"--fail-above", "flip=nan"},
                                          {"--ppd", "0"},
                                          {"--ppd", "nan"},
                                          {"--over", "nan"},
                                          {"--over", "-1"},
                                          {"--over", ""},
                                          {"--tone-mapper", "gamma"},
                                          {"--map", at("out/m.jpg")},
                                          {"--map-metric", "psnr"},
                                          {"--map-metric", ""},
                                          {"--frames", "1-3"},
                                          {"--metric", "tde"},
                                          {"--on-existing", "skip"},
                                          {"--map", at("a.exr"), "--on-existing", "overwrite"}};
    for (const auto& arguments : wrong)
        EXPECT_EQ(diff("a.exr", "a.exr", arguments).code, 2) << arguments[0] << " " << arguments[1];
    EXPECT_EQ(diff("a.####.exr", "a.exr").code, 2);
    EXPECT_EQ(run({"diff", at("a.exr")}).code, 2);
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--map", at("out/m.png")}).code, 2);
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--frames", "1:3"}).code, 2);
    // The known names are listed.
    EXPECT_TRUE(contains(diff("a.exr", "a.exr", {"--metric", "vmaf"}).err, "hdr_flip"));
    // No option is without effect.
    for (const Arguments& unread : {Arguments{"--map-metric", "flip"},
                                    {"--tone-mapper", "hable", "--metric", "flip"},
                                    {"--ppd", "50", "--metric", "psnr"}}) {
        const Outcome refused = diff("a.exr", "a.exr", unread);
        EXPECT_EQ(refused.code, 2) << unread[0];
        EXPECT_TRUE(contains(refused.err, unread[0] + ": has an effect on ")) << refused.err;
    }
    const Outcome map =
        diff("a.exr", "a.exr",
             {"--metric", "psnr", "--ppd", "50", "--map", at("m.exr"), "--map-metric", "flip"});
    EXPECT_EQ(map.code, 0) << map.text();
}

TEST_F(DiffTest, InputErrorsNameBothFiles) {
    write_gray(at("a.exr"), 0.5);
    write_gray(at("small.exr"), 0.5, 16, 11);
    const auto image = metrics::gray(16, 12, 0.5);
    write_rgb(at("display.exr"), image, 0, io::Window{0, 0, 31, 11});
    ASSERT_TRUE(io::write_planes_exr(at("depth.exr"), ImageF(16, 12, 1), {"Z"}).ok());
    write_text(at("text.exr"), "no picture");
    const auto fails = [&](const char* a, const char* b) {
        const Outcome result = diff(a, b);
        EXPECT_EQ(result.code, 4) << a << " " << b << result.text();
        EXPECT_TRUE(contains(result.err, a) && contains(result.err, b)) << result.err;
        return result.err;
    };
    EXPECT_TRUE(contains(fails("a.exr", "small.exr"), "16x11"));
    EXPECT_TRUE(contains(fails("a.exr", "display.exr"), "display windows"));
    EXPECT_TRUE(contains(fails("a.exr", "depth.exr"), "color"));
    EXPECT_TRUE(contains(fails("depth.exr", "a.exr"), "color"));
    fails("a.exr", "nowhere.exr");
    fails("nowhere.exr", "a.exr");
    fails("a.exr", "text.exr");
}

TEST_F(DiffTest, SequencesPrintALinePerFrameAndASummary) {
    write_sequences();
    const Outcome result = diff("a.####.exr", "b.####.exr", {"--json"});
    ASSERT_EQ(result.code, 0) << result.text();
    const auto lines = json_lines(result.out);
    ASSERT_EQ(lines.size(), 4u);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(lines[size_t(i)]["frame"], i + 1);
        EXPECT_NEAR(lines[size_t(i)]["mse"].get<double>(), 0.01 * (i + 1) * (i + 1), 1e-6);
    }
    const Json& summary = lines[3];
    EXPECT_EQ(summary["summary"], true);
    EXPECT_EQ(summary["frames"], 3);
    EXPECT_NEAR(summary["mse"].get<double>(), 0.14 / 3, 1e-6);
    EXPECT_NEAR(summary["difference_max"].get<double>(), 0.3, 1e-6);
    // The error grows by 0.1 a frame.
    EXPECT_TRUE(lines[0]["tde"].is_null());
    EXPECT_NEAR(lines[2]["tde"].get<double>(), 0.1, 1e-6);
    EXPECT_NEAR(summary["tde"].get<double>(), 0.1, 1e-6);
}

TEST_F(DiffTest, FramesChooseAndMissingOnesAreErrors) {
    write_sequences();
    const Outcome chosen =
        diff("a.####.exr", "b.####.exr", {"--json", "--frames", "1-3x2", "--metric", "mse"});
    ASSERT_EQ(chosen.code, 0) << chosen.text();
    EXPECT_EQ(json_lines(chosen.out).size(), 3u);
    const Outcome missing = diff("a.####.exr", "b.####.exr", {"--frames", "1-5"});
    EXPECT_EQ(missing.code, 4);
    EXPECT_TRUE(contains(missing.err, "4-5")) << missing.err;
    EXPECT_TRUE(missing.out.empty());
    std::filesystem::remove(at("b.0002.exr"));
    const Outcome hole = diff("a.####.exr", "b.####.exr");
    EXPECT_EQ(hole.code, 4);
    EXPECT_TRUE(contains(hole.err, "B 2")) << hole.err;
    EXPECT_EQ(diff("c.####.exr", "b.####.exr").code, 4);
    // Additional frames of B are reported but not an error.
    std::filesystem::remove(at("a.0002.exr"));
    std::filesystem::remove(at("a.0003.exr"));
    const Outcome more = diff("a.####.exr", "b.####.exr", {"--metric", "mse"});
    EXPECT_EQ(more.code, 0) << more.text();
    EXPECT_TRUE(contains(more.err, "3")) << more.err;
}

// Every frame is measured at the exposures of all references, which differ from its own.
TEST_F(DiffTest, ExposuresOfASequenceAreThoseOfAllReferences) {
    write_gray(at("a.0001.exr"), 0.1);
    write_gray(at("a.0002.exr"), 6.4);
    write_gray(at("b.0001.exr"), 0.11);
    write_gray(at("b.0002.exr"), 6.5);
    const Outcome both = diff("a.####.exr", "b.####.exr", {"--json", "--metric", "hdr_flip"});
    ASSERT_EQ(both.code, 0) << both.text();
    const auto settings = json_lines(both.out).at(2)["settings"];
    const double x = metrics::inverse_of(metrics::ToneMapper::aces, 0.85);
    EXPECT_NEAR(settings["exposure_start"].get<double>(), std::log2(x / 6.4), 1e-5);
    EXPECT_NEAR(settings["exposure_stop"].get<double>(), std::log2(x / 0.1), 1e-5);
    EXPECT_EQ(settings["exposures"], 6);  // log2(64)
}

TEST_F(DiffTest, FailAboveLooksAtEveryFrame) {
    write_sequences();
    const Outcome result =
        diff("a.####.exr", "b.####.exr", {"--metric", "mse", "--fail-above", "mse=0.08"});
    EXPECT_EQ(result.code, 8);  // frame 3 has 0.09, the mean is 0.047
    EXPECT_TRUE(contains(result.err, "b.0003.exr")) << result.err;
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--fail-above", "tde=0.05"}).code, 8);
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--fail-above", "tde=0.15"}).code, 0);
}

// 0.5 against 0.5, with pixels of 1.5 and 1: the difference map is 1 and 0.5 there and 0 elsewhere.
// Magma's ends are (0, 0, 4) and (252, 253, 191) of 255, its center (183, 55, 121).
TEST_F(DiffTest, WritesMapsAsMagmaPngAndExr) {
    ImageF test = metrics::gray(16, 12, 0.5);
    test.at(4, 7, 1) = 1.5f;
    test.at(9, 7, 1) = 1.0f;
    write_rgb(at("b.exr"), test);
    write_gray(at("a.exr"), 0.5);
    const Arguments maps = {"--map",        at("out/m.png"), "--map",    at("out/m.exr"),
                            "--map-metric", "difference",    "--metric", "mse"};
    const Outcome result = diff("a.exr", "b.exr", maps);
    ASSERT_EQ(result.code, 0) << result.text();
    auto file = io::ExrFile::open(at("out/m.exr"));
    ASSERT_TRUE(file.ok());
    const auto map = file->read_channels(0, {"Y"});
    ASSERT_TRUE(map.ok());
    EXPECT_EQ(map->at(4, 7), 1);
    EXPECT_EQ(map->at(5, 7), 0);

    const OIIO::ImageBuf png(at("out/m.png"));
    float pixel[4] = {};
    png.getpixel(4, 7, pixel);
    const int bright[3] = {252, 253, 191}, middle[3] = {183, 55, 121}, dark[3] = {0, 0, 4};
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c] * 255, bright[c], 1.01);
    png.getpixel(9, 7, pixel);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c] * 255, middle[c], 2.01);
    png.getpixel(5, 7, pixel);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c] * 255, dark[c], 1.01);

    // An existing map is not replaced by default.
    EXPECT_EQ(diff("a.exr", "b.exr", maps).code, 5);
    Arguments again = maps;
    again.insert(again.end(), {"--on-existing", "overwrite"});
    EXPECT_EQ(diff("a.exr", "b.exr", again).code, 0);
    EXPECT_EQ(diff("a.exr", "b.exr", {"--map", at("nowhere/m.png")}).code, 5);
}

TEST_F(DiffTest, WritesAMapPerFrame) {
    write_sequences();
    const Outcome result =
        diff("a.####.exr", "b.####.exr", {"--map", at("out/m.####.png"), "--metric", "mse"});
    ASSERT_EQ(result.code, 0) << result.text();
    for (int frame = 1; frame <= 3; ++frame)
        EXPECT_TRUE(exists(at("out/m.000" + std::to_string(frame) + ".png")));
}

// Red of 0.4 covering half of each pixel, against an image without alpha.
TEST_F(DiffTest, ComparesOverABackground) {
    ImageF half(16, 12, 4);
    for (size_t i = 0; i < half.pixels(); ++i) {
        half.data[4 * i] = 0.4f;
        half.data[4 * i + 3] = 0.5f;
    }
    const auto written = io::write_planes_exr(at("half.exr"), half, {"R", "G", "B", "A"});
    ASSERT_TRUE(written.ok()) << written.status().message();
    write_gray(at("gray.exr"), 0.1);
    const auto mse = [&](const Arguments& more) {
        Arguments arguments = {"--json", "--metric", "mse"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return json_lines(diff("gray.exr", "half.exr", arguments).out).at(0);
    };
    EXPECT_NEAR(mse({})["mse"].get<double>(), (0.09 + 0.01 + 0.01) / 3, 1e-7);
    EXPECT_FALSE(mse({})["settings"].contains("over"));
    // 0.4 + 0.1 and 0.1; the reference is unchanged.
    const auto over = mse({"--over", "0.2"});
    EXPECT_NEAR(over["mse"].get<double>(), 0.16 / 3, 1e-7);
    EXPECT_EQ(over["settings"]["over"], 0.2);
    EXPECT_NEAR(mse({"--over", "0"})["mse"].get<double>(), (0.09 + 0.01 + 0.01) / 3, 1e-7);
    EXPECT_TRUE(contains(diff("gray.exr", "half.exr", {"--over", "0.2"}).out, "over 0.2"));
}

TEST_F(DiffTest, ViewingDistanceAndToneMapperReachFlip) {
    const auto checker = metrics::make_image(32, 32, [](int x, int y) {
        const double v = (x + y) % 2;
        return metrics::Rgb{v, v, v};
    });
    write_rgb(at("a.exr"), checker);
    write_gray(at("b.exr"), 0.5, 32, 32);
    const auto value = [&](const char* metric, const Arguments& more) {
        Arguments arguments = {"--json", "--metric", metric};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return json_lines(diff("a.exr", "b.exr", arguments).out).at(0)[metric].get<double>();
    };
    EXPECT_LT(value("flip", {}), 0.02);
    EXPECT_GT(value("flip", {"--ppd", "20"}), 0.7);
    EXPECT_NE(value("hdr_flip", {}), value("hdr_flip", {"--tone-mapper", "hable"}));
}

}  // namespace
}  // namespace postchain::test
