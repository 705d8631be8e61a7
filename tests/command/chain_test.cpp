// Faults of chain files, overrides, arguments and camera files: messages and exit codes.
#include <sstream>

#include "tests/command/fixture.h"

namespace postchain::test::chain_test {
namespace {

class ChainTest : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        write_frame(in(1), make_planes(24, 16));
    }
    void write_dof(const std::string& aperture) const {
        write_text(at("dof.yaml"),
                   "postchain: 1\ncamera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, "
                   "focus_distance: 2, meters_per_unit: 0.05" +
                       aperture + "}\npasses: [depth_of_field: {samples: 4}]\n");
    }
};

// tests/config has the errors of chain files.
TEST_F(ChainTest, ChainErrorsNameTheirPlace) {
    write_text(at("bad.yaml"), "postchain: 1\npasses:\n  - fxaa: {a: 1, b: 2}\n  - nothing\n");
    const auto outcome = filter("bad");
    EXPECT_EQ(outcome.code, 3);
    // Each on its own line in the documented form, without a prefix.
    std::istringstream text(outcome.err);
    const auto objects = json_lines(filter("bad", {"--log-format", "json"}).err);
    ASSERT_EQ(objects.size(), 3u);
    size_t i = 0;
    for (const char* place :
         {":3:12: error: passes[0].a: unknown key", ":3:18: error: passes[0].b: unknown key",
          ":4:5: error: passes[1]: unknown pass"}) {
        std::string line;
        std::getline(text, line);
        EXPECT_TRUE(line.starts_with(at("bad.yaml") + place)) << line;
        EXPECT_EQ(objects[i]["level"], "error");
        EXPECT_EQ(objects[i++]["message"], line);
    }
    EXPECT_EQ(text.peek(), EOF) << outcome.err;
    EXPECT_EQ(run({"plan", at("bad.yaml"), "-i", in(1)}).code, 3);
    EXPECT_EQ(filter("no_such_chain").code, 3);
    EXPECT_TRUE(outputs().empty());
}

TEST_F(ChainTest, OverridesSayWhatIsWrongAndWhatGivesWay) {
    const auto bad = filter("fxaa", {"--set", "passes[7].preset=12"});
    EXPECT_EQ(bad.code, 2);
    EXPECT_TRUE(bad.err.starts_with("--set passes[7].preset=12: error: passes[7]: ")) << bad.err;
    expect_ends(
        run({"plan", at("motion_blur.yaml"), "-i", in(1), "--set", "camera.shutter_frames=1"}), 0,
        {"--set camera.shutter_frames=1: note: passes[0].shutter_frames"});
}

TEST_F(ChainTest, UsageErrorsHaveOneForm) {
    const auto subcommand = run({"rnu", "paper"});
    EXPECT_EQ(subcommand.code, 2);
    EXPECT_TRUE(subcommand.err.starts_with(
        "postchain: error: unknown subcommand 'rnu' (did you mean 'run'?)"))
        << subcommand.err;
    EXPECT_TRUE(run({"run", "-o", out(1)}).err.starts_with("postchain: error: CHAIN is required"));
    const auto objects = json_lines(run({"run", "paper", "-o", out(1), "--log-format=json"}).err);
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_EQ(objects[0]["level"], "error");
    EXPECT_TRUE(contains(objects[0]["message"].get<std::string>(), "--input is required"));
}

// tests/config has the errors of camera files.
TEST_F(ChainTest, CameraErrors) {
    write_text(at("camera.json"), "{\"f_stop\": -1}");
    for (const std::string& path : {at("camera.json"), at("none.json")})
        expect_ends(filter("fxaa", {"--camera", path}), 4, {path});
    // A lens that nothing states.
    write_text(at("dof.yaml"), "postchain: 1\npasses: [depth_of_field]\n");
    expect_ends(filter("dof"), 3, {in(1), "focal_length_mm", "--camera"});
    EXPECT_TRUE(outputs().empty());
    // A misspelled key is reported; keys of other programs are ignored.
    write_text(at("camera.json"), "{\"f_stp\": 2, \"lens_maker\": \"us\"}");
    const auto outcome = filter("fxaa", {"--camera", at("camera.json")});
    expect_ends(outcome, 0, {"f_stp"});
    EXPECT_FALSE(contains(outcome.err, "lens_maker")) << outcome.err;
}

// Names are relative to the file that has them, and those of --set to the working folder
// (tests/config). An unusable image ends the command with 4.
TEST_F(ChainTest, PicturesOfTheAperture) {
    std::filesystem::create_directory(at("pictures"));
    ImageF half(2, 2, 1, 1);
    half.at(0, 0) = half.at(0, 1) = 0;
    const std::string black = at("pictures/black.exr");
    ASSERT_TRUE(io::write_planes_exr(at("pictures/half.exr"), half, {"Y"}).ok());
    ASSERT_TRUE(io::write_planes_exr(black, ImageF(8, 8, 1), {"Y"}).ok());
    const auto filtered = [&](const Arguments& more, int code) {
        const auto outcome =
            filter("dof", joined(more, {"--on-existing", "overwrite"}), {.folder = at("pictures")});
        EXPECT_EQ(outcome.code, code) << outcome.text();
        return read_color(out(1));
    };
    write_dof(", aperture_image: pictures/half.exr");
    const ImageF from_chain = filtered({}, 0);
    filtered({"--set", "depth_of_field.aperture_blades=6"}, 3);
    write_dof("");
    EXPECT_NE(filtered({}, 0), from_chain);
    EXPECT_EQ(filtered({"--set", "camera.aperture_image=half.exr"}, 0), from_chain);
    write_text(at("pictures/camera.json"), R"({"aperture_image": "half.exr"})");
    EXPECT_EQ(filtered({"--camera", at("pictures/camera.json")}, 0), from_chain);
    filtered({"--set", "camera.aperture_image=" + black}, 4);
    expect_ends(run({"scene", "still", "-o", at("s"), "--aperture-image", black}), 4, {black});
    EXPECT_FALSE(exists(at("s")));
}

}  // namespace
}  // namespace postchain::test::chain_test
