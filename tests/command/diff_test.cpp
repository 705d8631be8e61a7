// postchain diff as a command.
#include <cmath>
#include <limits>

#include "tests/command/fixture.h"
#include "tests/metrics/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tools/metrics/compare.h"
#include "tools/metrics/display.h"

namespace postchain::test {
namespace {

class DiffCommand : public CommandTest {
  protected:
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
    // The object of a single pair, or of the first frame.
    Json json(const std::string& a, const std::string& b, Arguments more = {}) {
        more.push_back("--json");
        const Outcome result = diff(a, b, more);
        EXPECT_EQ(result.code, 0) << result.text();
        const auto lines = json_lines(result.out);
        return lines.empty() ? Json::object() : lines[0];
    }
    double value(const std::string& a, const std::string& b, const std::string& metric,
                 Arguments more = {}) {
        more.insert(more.end(), {"--metric", metric});
        return json(a, b, more).at(metric).get<double>();
    }
    Outcome diff(const std::string& a, const std::string& b, const Arguments& more = {}) {
        Arguments arguments = {"diff", at(a), at(b)};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }
};

TEST_F(DiffCommand, TheFirstImageIsTheReference) {
    write_gray(at("a.exr"), 0.99, 1, 1);
    write_gray(at("b.exr"), 1.99, 1, 1);
    EXPECT_NEAR(value("a.exr", "b.exr", "relmse"), 1, 1e-5);
    EXPECT_NEAR(value("b.exr", "a.exr", "relmse"), 0.25, 1e-5);
}

TEST_F(DiffCommand, ComparesAMultilayerRenderAndUnpremultipliedColorWithPlainRgb) {
    Planes planes = make_planes(24, 16);
    write_frame(at("layers.exr"), planes);  // ViewLayer.Combined.R ... with depth and vectors
    write_rgb(at("plain.exr"), planes.color);
    EXPECT_EQ(value("layers.exr", "plain.exr", "mse"), 0);
    planes.color = ImageF(24, 16, 4, 0.5f);  // alpha 0.5, premultiplied 0.5
    write_frame(at("half.exr"), planes);
    write_gray(at("gray.exr"), 0.5, 24, 16);
    EXPECT_EQ(value("half.exr", "gray.exr", "mse"), 0);
}

// Metrics read them as 0: no limit of another metric would notice.
TEST_F(DiffCommand, NonfinitePixelsFailEveryLimit) {
    ImageF clean = metrics::gray(16, 12, 0), bad = clean;
    bad.at(5, 5, 1) = std::numeric_limits<float>::quiet_NaN();
    bad.at(6, 5, 1) = std::numeric_limits<float>::infinity();
    write_rgb(at("clean.exr"), clean);
    write_rgb(at("bad.exr"), bad);
    EXPECT_EQ(json("clean.exr", "bad.exr")["nonfinite"], 2);
    EXPECT_EQ(json("bad.exr", "clean.exr")["nonfinite_reference"], 2);
    expect_ends(diff("clean.exr", "bad.exr", {"--fail-above", "mse=1"}), 8,
                {"bad.exr: NaN or infinite pixels: 2"});
    EXPECT_EQ(diff("bad.exr", "clean.exr", {"--fail-above", "mse=1"}).code, 8);
    for (const auto& [limit, code] : {std::pair{"nonfinite=2", 0}, {"nonfinite=1", 8}})
        expect_ends(diff("clean.exr", "bad.exr", {"--fail-above", "mse=1", "--fail-above", limit}),
                    code);
}

TEST_F(DiffCommand, UsageErrorsExitWithTwo) {
    write_gray(at("a.exr"), 0.5);
    write_sequences();
    struct Row {
        const char *a, *b;
        Arguments more;
        const char* said = "";
    };
    const std::vector<Row> rows = {
        {"a.exr", "a.exr", {"--metric", "vmaf"}, "hdr_flip"},  // the known names are listed
        {"a.exr", "a.exr", {"--fail-above", "vmaf=1"}},
        {"a.exr", "a.exr", {"--fail-above", "psnr=30"}},
        {"a.exr", "a.exr", {"--ppd", "0"}},
        {"a.exr", "a.exr", {"--over", "nan"}},
        {"a.exr", "a.exr", {"--tone-mapper", "gamma"}},
        {"a.exr", "a.exr", {"--map", at("out/m.jpg")}},
        {"a.exr", "a.exr", {"--map", at("m.exr"), "--map-metric", "psnr"}},
        {"a.exr", "a.exr", {"--frames", "1-3"}},
        {"a.exr", "a.exr", {"--metric", "tde"}, "tde needs two frames"},
        {"a.exr", "a.exr", {"--metric", "temporal_error"}, "temporal_error needs two frames"},
        {"a.exr", "a.exr", {"--on-existing", "skip"}},
        {"a.exr", "a.exr", {"--map", at("a.exr"), "--on-existing", "overwrite"}},
        {"a.####.exr", "a.exr", {}},
        {"a.####.exr", "b.####.exr", {"--map", at("out/m.png")}},
        {"a.####.exr", "b.####.exr", {"--frames", "1:3"}},
        // No option is without effect.
        {"a.exr", "a.exr", {"--map-metric", "flip"}, "--map-metric: has an effect on "},
        {"a.exr", "a.exr", {"--tone-mapper", "hable", "--metric", "flip"}, "has an effect on "},
        {"a.exr", "a.exr", {"--ppd", "50", "--metric", "psnr"}, "has an effect on "}};
    for (const auto& [a, b, more, said] : rows) {
        SCOPED_TRACE(more.empty() ? a : more[0] + " " + more[1]);
        expect_ends(diff(a, b, more), 2, {said});
    }
    expect_ends(
        diff("a.exr", "a.exr",
             {"--metric", "psnr", "--ppd", "50", "--map", at("m.exr"), "--map-metric", "flip"}),
        0);
}

// Every frame is measured at the exposures of all references, which differ from its own.
TEST_F(DiffCommand, ExposuresOfASequenceAreThoseOfAllReferences) {
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

TEST_F(DiffCommand, FailAboveLooksAtEveryFrame) {
    write_sequences();
    // Frame 3 has 0.09, the mean is 0.047.
    expect_ends(diff("a.####.exr", "b.####.exr", {"--metric", "mse", "--fail-above", "mse=0.08"}),
                8, {"b.0003.exr"});
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--fail-above", "tde=0.05"}).code, 8);
    EXPECT_EQ(diff("a.####.exr", "b.####.exr", {"--fail-above", "tde=0.15"}).code, 0);
}

// 0.5 against 0.5, with a pixel of 1.5: the difference map is 1 there and 0 elsewhere.
TEST_F(DiffCommand, WritesMaps) {
    ImageF test = metrics::gray(16, 12, 0.5);
    test.at(4, 7, 1) = 1.5f;
    write_rgb(at("b.exr"), test);
    write_gray(at("a.exr"), 0.5);
    Arguments maps = {"--map",        at("out/m.png"), "--map",    at("out/m.exr"),
                      "--map-metric", "difference",    "--metric", "mse"};
    const Outcome result = diff("a.exr", "b.exr", maps);
    ASSERT_EQ(result.code, 0) << result.text();
    const ImageF map = must(must(io::ExrFile::open(at("out/m.exr"))).read_channels(0, {"Y"}));
    EXPECT_EQ(map.at(4, 7), 1);
    EXPECT_EQ(map.at(5, 7), 0);
    EXPECT_TRUE(exists(at("out/m.png")));
    // An existing map is not replaced by default.
    expect_ends(diff("a.exr", "b.exr", maps), 5);
    maps.insert(maps.end(), {"--on-existing", "overwrite"});
    expect_ends(diff("a.exr", "b.exr", maps), 0);
}

// Red of 0.4 covering half of each pixel, against an image without alpha.
TEST_F(DiffCommand, ComparesOverABackground) {
    const ImageF half = make_image(16, 12, 4, [](int, int, int c) {
        return c == 0 ? 0.4 : c == 3 ? 0.5 : 0;
    });
    must(io::write_planes_exr(at("half.exr"), half, {"R", "G", "B", "A"}));
    write_gray(at("gray.exr"), 0.1);
    const double black = (0.09 + 0.01 + 0.01) / 3;
    EXPECT_NEAR(value("gray.exr", "half.exr", "mse"), black, 1e-7);
    // 0.4 + 0.1 and 0.1; the reference is unchanged.
    EXPECT_NEAR(value("gray.exr", "half.exr", "mse", {"--over", "0.2"}), 0.16 / 3, 1e-7);
    EXPECT_FALSE(json("gray.exr", "half.exr")["settings"].contains("over"));
    EXPECT_TRUE(contains(diff("gray.exr", "half.exr", {"--over", "0.2", "-v"}).out, "over 0.2"));
}

TEST_F(DiffCommand, ViewingDistanceAndToneMapperReachFlip) {
    write_rgb(at("a.exr"), make_image(32, 32, 3, [](int x, int y, int) { return (x + y) % 2; }));
    write_gray(at("b.exr"), 0.5, 32, 32);
    EXPECT_LT(value("a.exr", "b.exr", "flip"), 0.02);
    EXPECT_GT(value("a.exr", "b.exr", "flip", {"--ppd", "20"}), 0.7);
    EXPECT_NE(value("a.exr", "b.exr", "hdr_flip"),
              value("a.exr", "b.exr", "hdr_flip", {"--tone-mapper", "hable"}));
}

}  // namespace
}  // namespace postchain::test
