// Invalid chain files and camera files, through the command.
#include <cmath>
#include <sstream>

#include "tests/command/fixture.h"

namespace postchain::test::chain_test {
namespace {

namespace fs = std::filesystem;
using ChainTest = CommandTest;

// NaN is outside every range, for every subcommand.
TEST_F(ChainTest, OptionsRefuseWhatIsNoNumber) {
    write_frame(in(1), make_planes(24, 16));
    for (const auto& arguments : std::vector<Arguments>{
             {"ab", at("all.yaml"), at("reversed.yaml"), "-i", in(), "-o", at("out/r"), "--ppd"},
             {"bench", at("all.yaml"), "-i", in(), "-o", at("out/r"), "--ppd"},
             {"diff", in(1), in(1), "--ppd"},
             {"diff", in(1), in(1), "--over"}}) {
        Arguments with_nan = arguments;
        with_nan.push_back("nan");
        const auto outcome = run(with_nan);
        EXPECT_EQ(outcome.code, 2) << arguments[0] << "\n" << outcome.text();
        EXPECT_TRUE(contains(outcome.err, arguments.back())) << outcome.err;
        EXPECT_TRUE(contains(outcome.err, "not a number")) << outcome.err;
        EXPECT_FALSE(exists(at("out/r")));
    }
}

TEST_F(ChainTest, ChainErrorsNameTheirPlace) {
    write_frame(in(1), make_planes(24, 16));
    const struct {
        std::string text;
        std::vector<std::string> words;
    } cases[] = {
        {"postchain: 1\npasses:\n  - motion_blur: {sampels: 25}\n",
         {":3:19: error", "sampels", "did you mean 'samples'"}},
        {"postchain: 1\npasses:\n  - fxaa: {preset: high}\n", {":3:20: error", "preset"}},
        {"postchain: 1\npasses:\n  - motion_blur: {samples: 99999}\n", {":3:28: error", "99999"}},
        {"postchain: 1\npasses:\n  - motion_blur: {samples: 24}\n", {":3:28: error", "odd"}},
        {"postchain: 1\npasses: []\npasses: []\n", {":3:1: error", "duplicate"}},
        {"postchain: 1\npasses: [&a fxaa, *a]\n", {":2:", "error"}},
        {"postchain: 1\npasses: " + std::string(1 << 20, '['), {"error"}},
        {"", {"empty"}},
        {"postchain: 1\npasses: [\xff\xfe]\n", {":2:10: error", "UTF-8"}},
        {"postchain: 1\npasses: [fxaa: {subpix: .nan}]\n", {":2:", "error", "subpix"}},
        {"postchain: 1\npasses: [blur]\n", {":2:10: error", "blur"}},
    };
    for (const auto& bad : cases) {
        write_text(at("bad.yaml"), bad.text);
        const auto outcome = filter("bad");
        EXPECT_EQ(outcome.code, 3) << bad.text.substr(0, 80) << "\n" << outcome.text();
        EXPECT_TRUE(contains(outcome.err, at("bad.yaml"))) << outcome.err.substr(0, 400);
        for (const auto& word : bad.words)
            EXPECT_TRUE(contains(outcome.err, word)) << word << "\n" << outcome.err.substr(0, 400);
        EXPECT_EQ(run({"plan", at("bad.yaml"), "-i", in(1)}).code, 3);
    }
    // All errors at once.
    write_text(at("bad.yaml"), "postchain: 1\npasses:\n  - fxaa: {a: 1, b: 2}\n  - nothing\n");
    const auto outcome = filter("bad");
    for (const char* place : {":3:12: error", ":3:18: error", ":4:5: error"})
        EXPECT_TRUE(contains(outcome.err, place)) << outcome.err;
    // Each on its own line in the documented form, without a prefix.
    std::vector<std::string> lines;
    std::istringstream text(outcome.err);
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    ASSERT_EQ(lines.size(), 3u) << outcome.err;
    const std::string file = at("bad.yaml");
    EXPECT_TRUE(lines[0].starts_with(file + ":3:12: error: passes[0].a: unknown key")) << lines[0];
    EXPECT_TRUE(lines[1].starts_with(file + ":3:18: error: passes[0].b: unknown key")) << lines[1];
    EXPECT_TRUE(lines[2].starts_with(file + ":4:5: error: passes[1]: unknown pass")) << lines[2];
    const auto objects = json_lines(filter("bad", {"--log-format", "json"}).err);
    ASSERT_EQ(objects.size(), 3u);
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(objects[i]["level"], "error");
        EXPECT_EQ(objects[i]["message"], lines[i]);
    }
    EXPECT_EQ(filter("no_such_chain").code, 3);
    EXPECT_TRUE(fs::is_empty(at("out")));
}

TEST_F(ChainTest, OverridesSayWhatIsWrongAndWhatGivesWay) {
    write_frame(in(1), make_planes(24, 16));
    const auto bad = filter("fxaa", {"--set", "passes[7].preset=12"});
    EXPECT_EQ(bad.code, 2);
    EXPECT_TRUE(bad.err.starts_with("--set passes[7].preset=12: error: passes[7]: ")) << bad.err;
    write_text(at("own.yaml"), "postchain: 1\npasses: [motion_blur: {shutter_frames: 0.5}]\n");
    const auto plan =
        run({"plan", at("own.yaml"), "-i", in(1), "--set", "camera.shutter_frames=1"});
    EXPECT_EQ(plan.code, 0) << plan.text();
    EXPECT_TRUE(contains(plan.err, "--set camera.shutter_frames=1: note: passes[0].shutter_frames"))
        << plan.err;
}

TEST_F(ChainTest, UsageErrorsHaveOneForm) {
    const auto subcommand = run({"rnu", "paper"});
    EXPECT_EQ(subcommand.code, 2);
    EXPECT_TRUE(subcommand.err.starts_with(
        "postchain: error: unknown subcommand 'rnu' (did you mean 'run'?)"))
        << subcommand.err;
    EXPECT_TRUE(run({"run", "-o", out(1)}).err.starts_with("postchain: error: CHAIN is required"));
    for (const Arguments& form : {Arguments{"--log-format", "json"}, {"--log-format=json"}}) {
        Arguments arguments = {"run", "paper", "-o", out(1)};
        arguments.insert(arguments.end(), form.begin(), form.end());
        const auto objects = json_lines(run(arguments).err);
        ASSERT_EQ(objects.size(), 1u);
        EXPECT_EQ(objects[0]["level"], "error");
        EXPECT_TRUE(contains(objects[0]["message"].get<std::string>(), "--input is required"));
    }
}

TEST_F(ChainTest, CameraErrors) {
    write_frame(in(1), make_planes(24, 16));
    for (const char* text : {"{\"f_stop\": \"wide\"}", "{\"f_stop\": -1}", "{", "", "[1]"}) {
        write_text(at("camera.json"), text);
        const auto outcome = filter("fxaa", {"--camera", at("camera.json")});
        EXPECT_EQ(outcome.code, 4) << text << outcome.text();
        EXPECT_TRUE(contains(outcome.err, at("camera.json"))) << outcome.err;
    }
    EXPECT_EQ(filter("fxaa", {"--camera", at("none.json")}).code, 4);
    EXPECT_EQ(filter("fxaa", {"--camera", at("out")}).code, 4);
    EXPECT_TRUE(fs::is_empty(at("out")));
    // A misspelled key is reported; keys of other programs are ignored.
    write_text(at("camera.json"), "{\"f_stp\": 2, \"lens_maker\": \"us\"}");
    const auto outcome = filter("fxaa", {"--camera", at("camera.json")});
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, "f_stp")) << outcome.err;
    EXPECT_FALSE(contains(outcome.err, "lens_maker")) << outcome.err;
}

// An unusable image ends the command with 4, whichever file names it; two shapes for one aperture
// give the exit code of the file that has both.
TEST_F(ChainTest, PicturesOfTheAperture) {
    write_frame(in(1), make_planes(24, 16));
    const std::string dof = "passes: [depth_of_field: {samples: 4}]\n";
    const std::string lens =
        "focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, focus_distance: 2, "
        "meters_per_unit: 0.05";
    fs::create_directory(at("pictures"));
    const auto picture = [&](const std::string& name, const ImageF& values) {
        ASSERT_TRUE(io::write_planes_exr(at("pictures/" + name), values, {"Y"}).ok());
    };
    ImageF half(8, 8, 1);
    for (int y = 0; y < 8; ++y)
        for (int x = 4; x < 8; ++x) half.at(x, y) = 1;
    picture("half.exr", half);
    picture("black.exr", ImageF(8, 8, 1));
    picture("wide.exr", ImageF(8, 4, 1, 1));

    // Relative to the chain file, not to the working folder.
    const auto chain = [&](const std::string& image) {
        write_text(at("dof.yaml"), "postchain: 1\ncamera: {" + lens +
                                       (image.empty() ? "" : ", aperture_image: " + image) + "}\n" +
                                       dof);
    };
    Launch elsewhere;
    elsewhere.folder = at("pictures");
    chain("pictures/half.exr");
    const auto seen = [&](const Arguments& more, const Launch& launch = {}) {
        const auto outcome = filter("dof", more, launch);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        const ImageF color = read_color(out(1));
        fs::remove(out(1));
        fs::remove(out(1) + ".json");
        return color;
    };
    const ImageF from_chain = seen({}, elsewhere);
    // --set: relative to the working folder. Camera file: relative to it.
    chain("");
    EXPECT_EQ(seen({"--set", "camera.aperture_image=half.exr"}, elsewhere), from_chain);
    write_text(at("pictures/camera.json"), R"({"aperture_image": "half.exr"})");
    EXPECT_EQ(seen({"--camera", at("pictures/camera.json")}), from_chain);
    EXPECT_NE(seen({}), from_chain);

    const struct {
        std::string name, words;
    } bad[] = {{"none.exr", "no such file"}, {"black.exr", "black"}, {"wide.exr", "square"}};
    for (const auto& [name, words] : bad) {
        const std::string path = at("pictures/" + name);
        const auto expect_said = [&, words = words](const Outcome& outcome,
                                                    const std::string& place) {
            EXPECT_EQ(outcome.code, 4) << outcome.text();
            EXPECT_TRUE(contains(outcome.err, place + ": " + path + ": ")) << outcome.err;
            EXPECT_TRUE(contains(outcome.err, words)) << outcome.err;
        };
        chain("pictures/" + name);
        expect_said(filter("dof"), "camera.aperture_image");
        expect_said(run({"plan", at("dof.yaml"), "-i", in(1)}), "camera.aperture_image");
        chain("");
        expect_said(filter("dof", {"--set", "camera.aperture_image=" + path}),
                    "camera.aperture_image");
        write_text(at("camera.json"),
                   "{\"frames\": {\"1\": {\"aperture_image\": \"pictures/" + name + "\"}}}");
        expect_said(filter("dof", {"--camera", at("camera.json")}),
                    at("camera.json") + ": frames.1.aperture_image");
        expect_said(run({"scene", "still", "-o", at("s"), "--aperture-image", path}),
                    "--aperture-image");
    }
    chain("pictures/half.exr, aperture_blades: 6");
    EXPECT_EQ(filter("dof").code, 3);
    chain("pictures/half.exr");
    EXPECT_EQ(filter("dof", {"--set", "depth_of_field.aperture_blades=6"}).code, 3);
    EXPECT_EQ(
        filter("dof", {"--set", "camera.aperture_image=a", "--set", "camera.aperture_curvature=1"})
            .code,
        2);
    write_text(at("camera.json"), R"({"aperture_image": "half.exr", "aperture_blades": 6})");
    EXPECT_EQ(filter("dof", {"--camera", at("camera.json")}).code, 4);
    EXPECT_EQ(run({"scene", "still", "-o", at("s"), "--aperture-image", at("pictures/half.exr"),
                   "--aperture-blades", "6"})
                  .code,
              2);
    EXPECT_FALSE(exists(at("s")));
    EXPECT_TRUE(fs::is_empty(at("out")));
}

// The frame is made again if the image has changed under the same name.
TEST_F(ChainTest, AnotherPictureIsAnotherChain) {
    write_frame(in(1), make_planes(24, 16));
    write_text(at("dof.yaml"),
               "postchain: 1\ncamera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, "
               "focus_distance: 2, meters_per_unit: 0.05, aperture_image: a.exr}\n"
               "passes: [depth_of_field: {samples: 4}]\n");
    const auto skip = [&](float value) {
        ImageF picture(2, 2, 1, 1);
        picture.at(0, 0) = value;
        EXPECT_TRUE(
            io::write_planes_exr(at("a.exr"), picture, {"Y"}, io::OnExisting::overwrite).ok());
        const auto outcome = filter("dof", {"--on-existing", "skip"});
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        return contains(outcome.err, "1 written");
    };
    EXPECT_TRUE(skip(0));
    EXPECT_FALSE(skip(0));
    EXPECT_TRUE(skip(0.5f));
}

// A generated scene with an aperture image: filtering with the scene's own camera is closer to the
// ground truth than with a disc.
TEST_F(ChainTest, ASceneThroughAPictureIsNearerToItsTruthWithIt) {
    constexpr int kSide = 64;
    ImageF ring(kSide, kSide, 1);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            ring.at(x, y) = std::hypot(x - 31.5, y - 31.5) > 22 && x > 20;
    ASSERT_TRUE(io::write_planes_exr(at("ring.exr"), ring, {"Y"}).ok());
    ASSERT_EQ(run({"scene", "still", "-o", at("still"), "--size", "64x36", "--truth-samples", "16",
                   "--f-stop", "0.5", "--aperture-image", at("ring.exr")})
                  .code,
              0);
    write_text(at("dof.yaml"),
               "postchain: 1\npasses: [depth_of_field: {samples: 128, max_radius_px: 20}]\n");
    const auto error = [&](const Arguments& more) {
        Arguments arguments = {"run",
                               at("dof.yaml"),
                               "-i",
                               at("still/sharp.####.exr"),
                               "--camera",
                               at("still/camera.json"),
                               "-o",
                               out(),
                               "--on-existing",
                               "overwrite"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const auto outcome = run(arguments);
        EXPECT_EQ(outcome.code, 0) << outcome.text();
        const ImageF seen = read_color(out(1)), truth = read_color(at("still/dof.0001.exr"));
        double squares = 0;
        for (int y = 0; y < truth.height; ++y)
            for (int x = 0; x < truth.width; ++x)
                for (int c = 0; c < 3; ++c) {
                    const auto shown = [](double v) { return v > 0 ? v / (1 + v) : 0; };
                    squares += std::pow(shown(seen.at(x, y, c)) - shown(truth.at(x, y, c)), 2);
                }
        return std::sqrt(squares / double(3 * truth.pixels()));
    };
    const double with_image = error({}), with_disc = error({"--set", "camera.aperture_blades=0"});
    EXPECT_LT(with_image, 0.85 * with_disc) << with_image << " " << with_disc;
}

TEST_F(ChainTest, AMissingLensIsNamed) {
    write_frame(in(1), make_planes(24, 16));
    write_text(at("dof.yaml"), "postchain: 1\npasses: [depth_of_field]\n");
    const auto outcome = filter("dof");
    EXPECT_EQ(outcome.code, 3) << outcome.text();
    for (const auto& word : {in(1), std::string("focal_length_mm"), std::string("--camera")})
        EXPECT_TRUE(contains(outcome.err, word)) << outcome.err;
    EXPECT_TRUE(fs::is_empty(at("out")));
}

}  // namespace
}  // namespace postchain::test::chain_test
