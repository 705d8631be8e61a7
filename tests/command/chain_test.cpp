// Chain files and camera files that are wrong, through the command.
#include <sstream>

#include "tests/command/fixture.h"

namespace postchain::test {
namespace {

namespace fs = std::filesystem;
using ChainTest = CommandTest;

// NaN is in no range, whichever verb's option it is.
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
    // All at once.
    write_text(at("bad.yaml"), "postchain: 1\npasses:\n  - fxaa: {a: 1, b: 2}\n  - nothing\n");
    const auto outcome = filter("bad");
    for (const char* place : {":3:12: error", ":3:18: error", ":4:5: error"})
        EXPECT_TRUE(contains(outcome.err, place)) << outcome.err;
    // Each a line of its own in the documented form, with nothing in front.
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
    const auto verb = run({"rnu", "paper"});
    EXPECT_EQ(verb.code, 2);
    EXPECT_TRUE(verb.err.starts_with("postchain: error: unknown verb 'rnu' (did you mean 'run'?)"))
        << verb.err;
    EXPECT_TRUE(run({"run"}).err.starts_with("postchain: error: CHAIN is required"));
    for (const Arguments& form : {Arguments{"--log-format", "json"}, {"--log-format=json"}}) {
        Arguments arguments = {"run", "paper"};
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
    // A misspelt key is said, another program's key does not matter.
    write_text(at("camera.json"), "{\"f_stp\": 2, \"lens_maker\": \"us\"}");
    const auto outcome = filter("fxaa", {"--camera", at("camera.json")});
    EXPECT_EQ(outcome.code, 0) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, "f_stp")) << outcome.err;
    EXPECT_FALSE(contains(outcome.err, "lens_maker")) << outcome.err;
}

// A lens that nothing states is named, with the ways to state it.
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
}  // namespace postchain::test
