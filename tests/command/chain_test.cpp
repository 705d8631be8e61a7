// Invalid chain files and camera files, through the command.
#include <sstream>

#include "tests/command/fixture.h"

namespace postchain::test::chain_test {
namespace {

namespace fs = std::filesystem;
using ChainTest = CommandTest;

// tests/config has the errors of chain files.
TEST_F(ChainTest, ChainErrorsNameTheirPlace) {
    write_frame(in(1), make_planes(24, 16));
    for (const std::string& text :
         {std::string(), "postchain: 1\npasses: " + std::string(1 << 20, '['),
          std::string("postchain: 1\npasses: [\xff\xfe]\n")}) {
        write_text(at("bad.yaml"), text);
        expect_ends(filter("bad"), 3, {at("bad.yaml")});
    }
    write_text(at("bad.yaml"), "postchain: 1\npasses:\n  - fxaa: {a: 1, b: 2}\n  - nothing\n");
    EXPECT_EQ(run({"plan", at("bad.yaml"), "-i", in(1)}).code, 3);
    const auto outcome = filter("bad");
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
        const Arguments arguments = joined({"run", "paper", "-o", out(1)}, form);
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
        expect_ends(filter("fxaa", {"--camera", at("camera.json")}), 4, {at("camera.json")});
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

// Names are relative to the file that has them, and those of --set to the working folder. An
// unusable image ends the command with 4; two shapes for one aperture give the exit code of the
// file that has both.
TEST_F(ChainTest, PicturesOfTheAperture) {
    write_frame(in(1), make_planes(24, 16));
    fs::create_directory(at("pictures"));
    ImageF half(8, 8, 1);
    for (int y = 0; y < 8; ++y)
        for (int x = 4; x < 8; ++x) half.at(x, y) = 1;
    ASSERT_TRUE(io::write_planes_exr(at("pictures/half.exr"), half, {"Y"}).ok());
    ASSERT_TRUE(io::write_planes_exr(at("pictures/black.exr"), ImageF(8, 8, 1), {"Y"}).ok());
    const auto chain = [&](const std::string& aperture) {
        write_text(at("dof.yaml"),
                   "postchain: 1\ncamera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, "
                   "focus_distance: 2, meters_per_unit: 0.05" +
                       aperture + "}\npasses: [depth_of_field: {samples: 4}]\n");
    };
    Launch elsewhere;
    elsewhere.folder = at("pictures");
    const auto seen = [&](Arguments more) {
        more.insert(more.end(), {"--on-existing", "overwrite"});
        expect_ends(filter("dof", more, elsewhere), 0);
        return read_color(out(1));
    };
    chain(", aperture_image: pictures/half.exr");
    const ImageF from_chain = seen({});
    EXPECT_EQ(
        filter("dof", {"--set", "depth_of_field.aperture_blades=6", "--on-existing", "overwrite"})
            .code,
        3);
    chain("");
    EXPECT_NE(seen({}), from_chain);
    EXPECT_EQ(seen({"--set", "camera.aperture_image=half.exr"}), from_chain);
    write_text(at("pictures/camera.json"), R"({"aperture_image": "half.exr"})");
    EXPECT_EQ(seen({"--camera", at("pictures/camera.json")}), from_chain);
    write_text(at("camera.json"), R"({"aperture_image": "half.exr", "aperture_blades": 6})");
    EXPECT_EQ(filter("dof", {"--camera", at("camera.json")}).code, 4);

    const std::string black = at("pictures/black.exr");
    for (const Outcome& refused :
         {filter("dof", {"--set", "camera.aperture_image=" + black}),
          run({"plan", at("dof.yaml"), "-i", in(1), "--set", "camera.aperture_image=" + black}),
          run({"scene", "still", "-o", at("s"), "--aperture-image", black})}) {
        EXPECT_EQ(refused.code, 4) << refused.text();
        EXPECT_TRUE(contains(refused.err, black)) << refused.err;
    }
    EXPECT_FALSE(exists(at("s")));
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
