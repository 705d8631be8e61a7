// --set: paths, precedence, errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "chain/base/printable.h"
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
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kChain =
    "postchain: 1\ncamera: {f_stop: 4}\npasses:\n  - smear: {samples: 31}\n  - tint\n";
constexpr const char* kTwice =
    "postchain: 1\npasses:\n  - smear: {shutter_frames: 0.5}\n  - tint\n  - smear\n";

ChainFile parse(const std::string& text, const std::vector<std::string>& overrides) {
    return parse_chain(text, "c.yaml", fake_passes(), overrides);
}

const test::Smear& first_smear(const ChainFile& file) {
    return smear(*file.chain.links[0].pass);
}

std::vector<std::string> said(const std::string& text, const std::vector<std::string>& overrides) {
    return texts(parse(text, overrides).diagnostics);
}

TEST(Override, SetsByIndexByNameAndTheCamera) {
    const ChainFile file = parse(
        kChain, {"passes[0].samples=51", "tint.gain=0.25", "camera.f_stop=2", "smear.mode=narrow"});
    ASSERT_THAT(texts(file.diagnostics), IsEmpty());
    EXPECT_EQ(first_smear(file).samples, 51);
    EXPECT_EQ(file.chain.origins.at("passes[0].samples").where, "{set} passes[0].samples=51"_keyed);
    EXPECT_EQ(first_smear(file).mode, test::SmearMode::narrow);
    EXPECT_EQ(tint(*file.chain.links[1].pass).gain, 0.25);
    EXPECT_EQ(file.chain.camera.f_stop, 2.0);
    // The later wins, and null unsets.
    EXPECT_EQ(first_smear(parse(kChain, {"smear.samples=51", "passes[0].samples=53"})).samples, 53);
    const ChainFile unset = parse(kChain, {"tint.limit=null", "camera.f_stop=null"});
    EXPECT_THAT(texts(unset.diagnostics), IsEmpty());
    EXPECT_EQ(tint(*unset.chain.links[1].pass).limit, std::nullopt);
    EXPECT_EQ(unset.chain.camera.f_stop, std::nullopt);
    // It is the chain of the same value in the file.
    std::string text = kChain;
    text.replace(text.find("31"), 2, "33");
    EXPECT_EQ(parse(kChain, {"passes[0].samples=33"}).chain.hash(), parse(text, {}).chain.hash());
}

TEST(Override, WarnsOfWhatHasNoEffect) {
    EXPECT_THAT(
        said(kChain, {"smear.mode=narrow", "smear.factor=2"}),
        ElementsAre(HasSubstr("{set} smear.factor=2: warning: passes[0].factor: has no"_keyed)));
    EXPECT_THAT(said(kChain, {"smear.mode=wide", "smear.factor=2"}), IsEmpty());
    // A value of the chain file that another mode does not read.
    const char* with_factor = "postchain: 1\npasses:\n  - smear: {factor: 2}\n";
    EXPECT_THAT(
        said(with_factor, {"smear.mode=narrow"}),
        ElementsAre("{set} smear.mode=narrow: warning: passes[0].factor: has no effect "
                    "with mode: narrow; remove it, or set mode: wide (given in c.yaml:3)"_keyed));
    // The file is judged as it is: --set does not mend it, and adds no second message.
    EXPECT_THAT(
        said("postchain: 1\npasses:\n  - smear: {mode: narrow, factor: 2}\n", {"smear.samples=51"}),
        ElementsAre(HasSubstr("c.yaml:3:27: error: passes[0].factor")));
}

TEST(Override, SetsAPoint) {
    const auto middle = [](const std::string& text) {
        const ChainFile file = parse(kChain, {text});
        EXPECT_THAT(texts(file.diagnostics), IsEmpty());
        return first_smear(file).middle;
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
    EXPECT_EQ(parse_chain(write_chain(good.chain), "c.yaml", builtin_passes(), {}).chain.text(),
              good.chain.text());
    EXPECT_EQ(write_chain(parsed("fxaa: {matte: hero}", {}).chain).find("matte_effect"),
              std::string::npos);
    EXPECT_THAT(texts(parsed("fxaa: {matte: a, matte_effect: unmoved}",
                             {"fxaa.matte_effect=null", "fxaa.matte=null"})
                          .diagnostics),
                IsEmpty());
    const auto refusal = [&](const std::string& pass, const std::vector<std::string>& overrides) {
        const Status status = parsed(pass, overrides).status();
        return concat(int(status.code()), " ", status.message());
    };
    const std::string of_file = std::to_string(int(StatusCode::chain)),
                      of_set = std::to_string(int(StatusCode::usage));
    EXPECT_THAT(refusal("joint_blur: {matte_effect: unmoved}", {}),
                StartsWith(of_file + " c.yaml"));
    EXPECT_THAT(refusal("joint_blur", {"joint_blur.matte_effect=unmoved"}),
                AllOf(StartsWith(of_set + " {set}"_keyed), HasSubstr("none is named")));
    EXPECT_THAT(refusal("depth_of_field: {matte: hero}", {"depth_of_field.matte_effect=unmoved"}),
                AllOf(StartsWith(of_set + " {set}"_keyed), HasSubstr("moves nothing")));
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
        {"smear.amount=inf", "amount is a number in 0..10"},
        {"smear.amount=0x3", "amount is a number in 0..10"},
        {"smear.samples=null", "no value; samples is"},
        {"", "PASS.KEY=VALUE"},
        {"camera.aperture_image=a\xff.png", "UTF-8"},
        {"camera.aperture_image=a\x01.png", "control character"},
    };
    for (const auto& [text, message] : wrong) {
        const ChainFile file = parse(kChain, {text});
        EXPECT_EQ(file.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(file.status().message(),
                    HasSubstr(printable("{set} "_keyed + text + ": error: ")));
        EXPECT_THAT(file.status().message(), HasSubstr(message));
    }
    const Status twice = parse(kTwice, {"smear.samples=51"}).status();
    EXPECT_EQ(twice.code(), StatusCode::usage);
    EXPECT_THAT(twice.message(), HasSubstr("use one of passes[0], passes[2]"));
}

TEST(Override, AnInvalidFileStaysAnInvalidFile) {
    const ChainFile file = parse("postchain: 1\npasses:\n  - blur\n  - tint: {gain: 0}\n",
                                 {"passes[1].gain=1", "blur.x=1"});
    EXPECT_EQ(file.status().code(), StatusCode::chain);
    EXPECT_EQ(file.diagnostics.size(), 2u) << text_of(file.diagnostics);
    // Passes are counted as in the file.
    EXPECT_THAT(said("postchain: 1\npasses: [blur, tint]\n", {"tint.gain=0"}),
                testing::Contains(HasSubstr("error: passes[1].gain: ")));
}

TEST(Override, MakesExcludedValuesOfTheFileGiveWay) {
    const ChainFile file = parse(kTwice, {"passes[0].shutter_angle_deg=90"});
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre("{set} passes[0].shutter_angle_deg=90: note: passes[0].shutter_frames: "
                            "0.5 of the chain file is dropped"_keyed));
    EXPECT_EQ(first_smear(file).shutter_frames, std::nullopt);
    EXPECT_EQ(first_smear(file).shutter_angle_deg, 90.0);
    const Status both =
        parse(kTwice, {"passes[2].shutter_angle_deg=90", "passes[2].shutter_frames=0.25"}).status();
    EXPECT_EQ(both.code(), StatusCode::usage);
    EXPECT_THAT(both.message(), HasSubstr("both given"));
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
    EXPECT_EQ(first_smear(parse(kTwice, {})).shutter_frames, 0.5);
    const ChainFile file = parse(kTwice, {"camera.shutter_frames=0.25"});
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre(HasSubstr("note: passes[0].shutter_frames: 0.5 of the chain file")));
    EXPECT_EQ(first_smear(file).shutter_frames, std::nullopt);
    EXPECT_EQ(file.chain.camera.shutter_frames, 0.25);
    // The same value as an angle; and the pass's own override takes precedence.
    const char* angle = "postchain: 1\npasses:\n  - smear: {shutter_angle_deg: 90}\n";
    EXPECT_EQ(first_smear(parse(angle, {"camera.shutter_frames=0.25"})).shutter_angle_deg,
              std::nullopt);
    const ChainFile own =
        parse(kTwice, {"passes[0].shutter_frames=2", "camera.shutter_frames=0.25"});
    EXPECT_EQ(first_smear(own).shutter_frames, 2.0);
}

// A null says that another's value counts; a value that is dropped is no longer stated.
TEST(Precedence, OnlyValuesAreStated) {
    EXPECT_EQ(parse("postchain: 1\ncamera: {f_stop: null, near_clip: 1}\n"
                    "passes: [smear: {shutter_frames: null}]\n",
                    {})
                  .chain.origins,
              (Origins{{"camera.near_clip", {kFromChain, "c.yaml:2"}}}));
    EXPECT_THAT(parse(kChain, {"camera.f_stop=null", "smear.samples=33"}).chain.origins,
                (Origins{{"passes[0].samples", {kFromOption, "{set} smear.samples=33"_keyed}}}));
    EXPECT_EQ(parse(kTwice, {"camera.shutter_frames=0.25"}).chain.origins,
              (Origins{{"camera.shutter_frames",
                        {kFromOption, "{set} camera.shutter_frames=0.25"_keyed}}}));
    // A null drops no value of a pass.
    EXPECT_EQ(first_smear(parse(kTwice, {"camera.shutter_frames=null"})).shutter_frames, 0.5);
}

// The aperture has one shape: an image, or blades with a curvature.
TEST(Override, OfTheApertureTakesTheWholeShapesPlace) {
    const std::string folder = std::filesystem::current_path().string();
    const std::string blades = "postchain: 1\ncamera: {aperture_blades: 5}\npasses: []\n";
    const ChainFile picture = parse(blades, {"camera.aperture_image=a.png"});
    EXPECT_THAT(
        texts(picture.diagnostics),
        ElementsAre(HasSubstr("note: camera.aperture_blades: 5 of the chain file is dropped")));
    EXPECT_EQ(picture.chain.camera.aperture_blades, std::nullopt);
    EXPECT_EQ(picture.chain.camera.aperture_image, BokehKernel(folder + "/a.png"));
    const ChainFile back = parse("postchain: 1\ncamera: {aperture_image: a.png}\npasses: []\n",
                                 {"camera.aperture_blades=6"});
    EXPECT_THAT(texts(back.diagnostics),
                ElementsAre(HasSubstr("a.png of the chain file is dropped")));
    EXPECT_FALSE(back.chain.camera.aperture_image);
    EXPECT_THAT(said(blades, {"camera.aperture_blades=6", "camera.aperture_image=a.png"}),
                ElementsAre(HasSubstr("error: camera: aperture_blades and aperture_image")));
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
