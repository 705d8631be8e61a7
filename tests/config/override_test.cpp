// --set: paths, precedence, errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "chain/printable.h"
#include "config/camera_file.h"
#include "config/chain_file.h"
#include "fake_passes.h"
#include "passes/registry.h"

namespace postchain::override_test {
namespace {

using test::fake_passes;
using test::smear;
using test::texts;
using test::tint;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kChain =
    "postchain: 1\ncamera: {f_stop: 4}\npasses:\n  - smear: {samples: 31}\n  - tint\n";
constexpr const char* kTwice =
    "postchain: 1\npasses:\n  - smear: {shutter_frames: 0.5}\n  - tint\n  - smear\n";

ChainFile parse(const std::string& text, const std::vector<std::string>& overrides) {
    return parse_chain(text, "c.yaml", fake_passes(), overrides);
}

TEST(Override, SetsByIndexByNameAndTheCamera) {
    const ChainFile file = parse(
        kChain, {"passes[0].samples=51", "tint.gain=0.25", "camera.f_stop=2", "smear.mode=narrow"});
    ASSERT_THAT(texts(file.diagnostics), IsEmpty());
    EXPECT_EQ(smear(*file.chain.links[0].pass).samples, 51);
    EXPECT_EQ(smear(*file.chain.links[0].pass).mode, test::SmearMode::narrow);
    EXPECT_EQ(tint(*file.chain.links[1].pass).gain, 0.25);
    EXPECT_EQ(file.chain.camera.f_stop, 2.0);
}

TEST(Override, FormerNamesAreReadWithAWarning) {
    ChainFile file = parse(kChain, {"smear.taps=51", "smear.mode=slim"});
    EXPECT_TRUE(file.status().ok());
    EXPECT_THAT(
        texts(file.diagnostics),
        ElementsAre(HasSubstr("--set smear.taps=51: warning: passes[0].taps: 'taps' is the former "
                              "name of 'samples'"),
                    HasSubstr("'slim' is the former name of 'narrow'")));
    EXPECT_EQ(smear(*file.chain.links[0].pass).samples, 51);
    EXPECT_EQ(smear(*file.chain.links[0].pass).mode, test::SmearMode::narrow);
    EXPECT_EQ(file.chain.origins.at("passes[0].samples").where, "--set smear.taps=51");
    // A value of the chain file gives way to the former name as it does to the current one.
    file = parse(kTwice, {"passes[0].angle=90"});
    EXPECT_TRUE(file.status().ok());
    EXPECT_EQ(smear(*file.chain.links[0].pass).shutter_frames, std::nullopt);
    EXPECT_EQ(smear(*file.chain.links[0].pass).shutter_angle_deg, 90.0);
}

TEST(Override, WarnsOfWhatHasNoEffect) {
    // A value that --set names itself.
    ChainFile file = parse(kChain, {"smear.mode=narrow", "smear.factor=2"});
    EXPECT_TRUE(file.status().ok());
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre("--set smear.factor=2: warning: passes[0].factor: has no effect with "
                            "mode: narrow; remove it, or set mode: wide"));
    // A value of the chain file that another mode does not read.
    const char* given = "postchain: 1\npasses:\n  - smear: {factor: 2}\n";
    file = parse(given, {"smear.mode=narrow"});
    EXPECT_TRUE(file.status().ok());
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre("--set smear.mode=narrow: warning: passes[0].factor: has no effect "
                            "with mode: narrow; remove it, or set mode: wide (given in c.yaml:3)"));
    EXPECT_THAT(texts(parse(given, {"smear.mode=narrow", "smear.factor=null"}).diagnostics),
                ElementsAre(HasSubstr("error: passes[0].factor: no value")));
    EXPECT_THAT(texts(parse(kChain, {"smear.mode=wide", "smear.factor=2"}).diagnostics), IsEmpty());
    // The file is judged as it is: --set does not mend it, and adds no second message.
    EXPECT_THAT(texts(parse("postchain: 1\npasses:\n  - smear: {mode: narrow, factor: 2}\n",
                            {"smear.samples=51"})
                          .diagnostics),
                ElementsAre(HasSubstr("c.yaml:3:27: error: passes[0].factor")));
}

TEST(Override, SetsAPoint) {
    const auto middle = [](const std::string& text) {
        const ChainFile file = parse(kChain, {text});
        EXPECT_THAT(texts(file.diagnostics), IsEmpty());
        return smear(*file.chain.links[0].pass).middle;
    };
    EXPECT_EQ(middle("smear.middle=[0.5,1]"), (std::array{0.5, 1.0}));
    EXPECT_EQ(middle("smear.middle=[ 0, 0.25 ]"), (std::array{0.0, 0.25}));
    EXPECT_EQ(middle("smear.middle=null"), std::nullopt);
    for (const char* text : {"[0.5]", "[0.5,0.5,0.5]", "[a,b]", "[]", "0.5,0.5", "[0.5,2]", "0.5"})
        EXPECT_EQ(parse(kChain, {concat("smear.middle=", text)}).diagnostics.size(), 1u) << text;
}

TEST(Override, OfMattesIsJudgedByWhatTheChainThenSays) {
    const auto parsed = [](const std::string& pass, const std::vector<std::string>& overrides) {
        return parse_chain("postchain: 1\npasses:\n  - " + pass + "\n", "c.yaml", builtin_passes(),
                           overrides);
    };
    const ChainFile good =
        parsed("motion_blur: {matte_effect: unmoved}", {"motion_blur.matte=hero"});
    ASSERT_THAT(texts(good.diagnostics), IsEmpty());
    EXPECT_EQ(good.chain.links[0].matte_effect, MatteEffect::unmoved);
    // A written chain reads back unchanged, without the unset values.
    const std::string text = write_chain(good.chain);
    EXPECT_EQ(parse_chain(text, "c.yaml", builtin_passes(), {}).chain.text(), good.chain.text());
    EXPECT_EQ(write_chain(parsed("fxaa: {matte: hero}", {}).chain).find("matte_effect"),
              std::string::npos);
    EXPECT_THAT(texts(parsed("joint_blur: {matte_effect: unmoved}", {}).diagnostics),
                ElementsAre(HasSubstr("passes[0].matte_effect: matte_effect says what is done")));
    EXPECT_EQ(parsed("joint_blur: {matte_effect: unmoved}", {}).diagnostics[0].code,
              StatusCode::chain);
    for (const ChainFile& by_set :
         {parsed("depth_of_field: {matte: hero}", {"depth_of_field.matte_effect=unmoved"}),
          parsed("joint_blur", {"joint_blur.matte_effect=unmoved"})}) {
        ASSERT_EQ(by_set.diagnostics.size(), 1u);
        EXPECT_EQ(by_set.diagnostics[0].code, StatusCode::usage);
        EXPECT_EQ(by_set.diagnostics[0].file, "--set");
        EXPECT_THAT(
            by_set.diagnostics[0].text(),
            testing::AnyOf(HasSubstr("depth_of_field moves nothing"), HasSubstr("none is named")));
    }
    EXPECT_THAT(texts(parsed("fxaa: {matte: a, matte_effect: unmoved}",
                             {"fxaa.matte_effect=null", "fxaa.matte=null"})
                          .diagnostics),
                IsEmpty());
}

TEST(Override, EqualsTheSameValueInTheFile) {
    const ChainFile file = parse(kChain, {"passes[0].samples=33"});
    std::string text = kChain;
    text.replace(text.find("31"), 2, "33");
    EXPECT_EQ(file.chain.hash(), parse(text, {}).chain.hash());
    EXPECT_NE(file.chain.hash(), parse(kChain, {}).chain.hash());
}

TEST(Override, TheLaterWinsAndNullUnsets) {
    EXPECT_EQ(
        smear(*parse(kChain, {"smear.samples=51", "passes[0].samples=53"}).chain.links[0].pass)
            .samples,
        53);
    const ChainFile file = parse(kChain, {"tint.limit=null", "camera.f_stop=null"});
    EXPECT_THAT(texts(file.diagnostics), IsEmpty());
    EXPECT_EQ(tint(*file.chain.links[1].pass).limit, std::nullopt);
    EXPECT_EQ(file.chain.camera.f_stop, std::nullopt);
}

TEST(Override, IsAUsageErrorThatNamesTheText) {
    const std::vector<std::pair<std::string, std::string>> wrong = {
        {"passes[0].samples=24", "24 is even; samples is an odd integer in 1..255"},
        {"smear.sampels=3", "did you mean 'samples'?"},
        {"camera.fstop=3", "did you mean 'f_stop'?"},
        {"passes[2].samples=3", "the chain has 2 passes, counted from 0"},
        {"passes[-1].samples=3", "the number of a pass"},
        {"passes[x].samples=3", "the number of a pass"},
        {"blur.samples=3", "neither camera nor a pass of the chain"},
        {"samples=3", "PASS.KEY=VALUE"},
        {"smear.samples", "PASS.KEY=VALUE"},
        {".samples=3", "PASS.KEY=VALUE"},
        {"smear.=3", "PASS.KEY=VALUE"},
        {"smear.samples=", "no value"},
        {"smear.amount=inf", "finite"},
        {"smear.amount=0x3", "decimal"},
        {"smear.samples=null", "no value; samples is"},
        {"", "PASS.KEY=VALUE"},
        {"camera.aperture_image=a\xff.png", "UTF-8"},
        {"camera.aperture_image=a\x01.png", "control character"},
    };
    for (const auto& [text, message] : wrong) {
        const ChainFile file = parse(kChain, {text});
        EXPECT_EQ(file.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(file.status().message(), HasSubstr(printable("--set " + text + ": error: ")));
        EXPECT_THAT(file.status().message(), HasSubstr(message));
    }
}

TEST(Override, OfAPassThatStandsTwiceIsAUsageError) {
    const ChainFile file = parse(kTwice, {"smear.samples=51"});
    EXPECT_EQ(file.status().code(), StatusCode::usage);
    EXPECT_THAT(file.status().message(), HasSubstr("use one of passes[0], passes[2]"));
    EXPECT_TRUE(parse(kTwice, {"passes[2].samples=51"}).status().ok());
}

TEST(Override, AnInvalidFileStaysAnInvalidFile) {
    const ChainFile file = parse("postchain: 1\npasses:\n  - blur\n  - tint: {gain: 0}\n",
                                 {"passes[1].gain=1", "blur.x=1"});
    EXPECT_EQ(file.status().code(), StatusCode::chain);
    EXPECT_EQ(file.diagnostics.size(), 2u) << text_of(file.diagnostics);
}

TEST(Override, StatusTakesTheCodeOfTheFileFirst) {
    const Diagnostic usage{"--set x", 0, 0, Severity::error, "", "u", StatusCode::usage};
    const Diagnostic chain{"c", 1, 1, Severity::error, "", "c", StatusCode::chain};
    const Diagnostic note{"c", 1, 1, Severity::note, "", "n", StatusCode::chain};
    EXPECT_EQ(status_of({usage, chain}).code(), StatusCode::chain);
    EXPECT_EQ(status_of({note, usage}).code(), StatusCode::usage);
    EXPECT_EQ(status_of({note, usage, chain}).message(), "--set x: error: u\nc:1:1: error: c");
    EXPECT_TRUE(status_of({note}).ok());
}

TEST(Override, MakesExcludedValuesOfTheFileGiveWay) {
    const ChainFile file = parse(kTwice, {"passes[0].shutter_angle_deg=90"});
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre("--set passes[0].shutter_angle_deg=90: note: passes[0].shutter_frames: "
                            "0.5 of the chain file is dropped"));
    EXPECT_EQ(smear(*file.chain.links[0].pass).shutter_frames, std::nullopt);
    EXPECT_EQ(smear(*file.chain.links[0].pass).shutter_angle_deg, 90.0);
    const ChainFile both =
        parse(kTwice, {"passes[2].shutter_angle_deg=90", "passes[2].shutter_frames=0.25"});
    EXPECT_EQ(both.status().code(), StatusCode::usage);
    EXPECT_THAT(both.status().message(), HasSubstr("both given"));
}

// defaults < file metadata < --camera < the chain's camera < a pass's own value < --set.
TEST(Precedence, OfCameraValues) {
    Camera metadata;
    metadata.f_stop = 1;
    metadata.focal_length_mm = 10;
    metadata.focus_distance = 100;
    const CameraFile file = parse_camera(R"({"f_stop": 2, "focal_length_mm": 20})", "camera.json");
    ASSERT_THAT(texts(file.diagnostics), IsEmpty());
    const Camera frame = frame_camera(metadata, &file, 1, {1920, 1080, 1});
    EXPECT_EQ(frame.focus_distance, 100.0);    // only metadata
    EXPECT_EQ(frame.focal_length_mm, 20.0);    // --camera over metadata
    EXPECT_EQ(frame.near_clip, std::nullopt);  // not given
    const Camera chain = parse(kChain, {}).chain.camera;
    EXPECT_EQ(frame.overlaid_by(chain).f_stop, 4.0);  // the chain over --camera
    EXPECT_EQ(frame.overlaid_by(parse(kChain, {"camera.f_stop=8"}).chain.camera).f_stop, 8.0);
    EXPECT_EQ(frame_camera(metadata, nullptr, 1, {}).f_stop, 1.0);
}

TEST(Precedence, ASetCameraValueBeatsAPassesOwn) {
    EXPECT_EQ(smear(*parse(kTwice, {}).chain.links[0].pass).shutter_frames, 0.5);
    const ChainFile file = parse(kTwice, {"camera.shutter_frames=0.25"});
    EXPECT_TRUE(file.status().ok());
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre(HasSubstr("note: passes[0].shutter_frames: 0.5 of the chain file")));
    EXPECT_EQ(smear(*file.chain.links[0].pass).shutter_frames, std::nullopt);
    EXPECT_EQ(file.chain.camera.shutter_frames, 0.25);
    // The same value as an angle.
    const ChainFile angle = parse("postchain: 1\npasses:\n  - smear: {shutter_angle_deg: 90}\n",
                                  {"camera.shutter_frames=0.25"});
    EXPECT_EQ(smear(*angle.chain.links[0].pass).shutter_angle_deg, std::nullopt);
    // The pass's own override takes precedence.
    const ChainFile own =
        parse(kTwice, {"passes[0].shutter_frames=2", "camera.shutter_frames=0.25"});
    EXPECT_EQ(smear(*own.chain.links[0].pass).shutter_frames, 2.0);
}

// The aperture has one shape: an image, or blades with a curvature.
TEST(Override, OfTheApertureTakesTheWholeShapesPlace) {
    const std::string folder = std::filesystem::current_path().string();
    const std::string blades = "postchain: 1\ncamera: {aperture_blades: 5}\npasses: []\n";
    const ChainFile picture = parse(blades, {"camera.aperture_image=a.png"});
    EXPECT_THAT(texts(picture.diagnostics),
                ElementsAre("--set camera.aperture_image=a.png: note: camera.aperture_blades: 5 of "
                            "the chain file is dropped"));
    EXPECT_EQ(picture.chain.camera.aperture_blades, std::nullopt);
    EXPECT_EQ(picture.chain.camera.aperture_image, BokehKernel(folder + "/a.png"));
    const ChainFile back = parse("postchain: 1\ncamera: {aperture_image: a.png}\npasses: []\n",
                                 {"camera.aperture_blades=6"});
    EXPECT_THAT(texts(back.diagnostics),
                ElementsAre(HasSubstr("a.png of the chain file is dropped")));
    EXPECT_FALSE(back.chain.camera.aperture_image);
    const ChainFile both =
        parse(blades, {"camera.aperture_blades=6", "camera.aperture_image=a.png"});
    EXPECT_EQ(both.status().code(), StatusCode::usage);
    EXPECT_THAT(both.status().message(), HasSubstr("camera: aperture_blades and aperture_image"));
    EXPECT_FALSE(parse(blades, {"camera.aperture_image=a.png", "camera.aperture_image=null"})
                     .chain.camera.aperture_image);
    // A pass's own blades are dropped too.
    const ChainFile own = parse_chain(
        "postchain: 1\npasses: [depth_of_field: {aperture_blades: 7, aperture_ratio: 2}]\n", "c",
        builtin_passes(), {"camera.aperture_image=a.png"});
    EXPECT_THAT(texts(own.diagnostics),
                ElementsAre(HasSubstr("note: passes[0].aperture_blades: 7 of the chain file")));
    EXPECT_THAT(own.chain.links[0].text(), HasSubstr("aperture_blades=unset"));
    EXPECT_THAT(own.chain.links[0].text(), HasSubstr("aperture_ratio=2"));
}

}  // namespace
}  // namespace postchain::override_test
