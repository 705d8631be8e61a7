#include "config/profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "config/embedded.h"
#include "config/profile_match.h"
#include "fake_passes.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain {
namespace {

using test::must;
using test::texts;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Names = std::vector<std::string>;

FileChannels one_part(const Names& channels) {
    return {{{"", "", channels}}, {}};
}

ProfileMatch detect(const FileChannels& file, const std::string& layer = "",
                    const std::string& view = "") {
    return must(detect_profile(builtin_profiles(), file, layer, view));
}
Status failure(const FileChannels& file, const std::string& layer = "",
               const std::string& view = "") {
    return detect_profile(builtin_profiles(), file, layer, view).status();
}
Names channels(const ProfileMatch& match, Role role) {
    const auto found = match.roles.find(role);
    return found == match.roles.end() ? Names() : found->second.channels;
}

const Names kCycles = {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
                       "ViewLayer.Combined.A", "ViewLayer.Depth.Z",    "ViewLayer.Vector.X",
                       "ViewLayer.Vector.Y",   "ViewLayer.Vector.Z",   "ViewLayer.Vector.W"};

// (x, y) by the convention: scale * (stored - bias).
std::array<double, 2> converted(const MotionConvention& m, double x, double y) {
    return {m.scale_x * (x - m.bias), m.scale_y * (y - m.bias)};
}

TEST(Profiles, AllReadWithoutDiagnostics) {
    Names names;
    for (const auto& file : embedded_config()) {
        if (!file.path.starts_with("profiles/")) continue;
        const ProfileFile profile = parse_profile(file.text, std::string(file.path));
        EXPECT_THAT(texts(profile.diagnostics), IsEmpty());
        EXPECT_EQ("profiles/" + profile.profile.name + ".yaml", file.path);
        EXPECT_NE(profile.profile.verified, "");
    }
    for (const auto& profile : builtin_profiles()) names.push_back(profile.name);
    EXPECT_THAT(names, ElementsAre("cycles", "nuke", "arnold", "vray", "generic"));
}

TEST(Profiles, CyclesIsDetectedAndGivesTheTableOfTheFrame) {
    const ProfileMatch match = detect(one_part(kCycles));
    EXPECT_EQ(match.profile, "cycles");
    EXPECT_TRUE(match.detected);
    EXPECT_EQ(match.why,
              "channels ViewLayer.Combined.R, ViewLayer.Combined.G, ViewLayer.Combined.B");
    EXPECT_EQ(match.layer, "ViewLayer");
    EXPECT_THAT(channels(match, Role::color), testing::ElementsAreArray(kCycles.data(), 4));
    EXPECT_THAT(channels(match, Role::inverse_depth), ElementsAre("ViewLayer.Depth.Z"));
    EXPECT_THAT(channels(match, Role::motion),
                ElementsAre("ViewLayer.Vector.Z", "ViewLayer.Vector.W"));
    EXPECT_THAT(channels(match, Role::motion_back),
                ElementsAre("ViewLayer.Vector.X", "ViewLayer.Vector.Y"));
    EXPECT_THAT(match.missing, IsEmpty());
    EXPECT_EQ(match.options.depth, DepthEncoding::linear);
    // motion = (-Z, +W), motion_back = (-X, +Y), 9999 means no motion.
    EXPECT_EQ(converted(match.options.motion, 3, 5), (std::array<double, 2>{-3, 5}));
    EXPECT_EQ(converted(match.options.motion_back, 3, 5), (std::array<double, 2>{-3, 5}));
    EXPECT_EQ(match.options.motion.sentinel, 9999);
    EXPECT_EQ(match.options.motion_back.sentinel, 9999);
    EXPECT_EQ(match.options.motion.unit, MotionUnit::pixels);
    EXPECT_FALSE(match.options.unpremultiplied);
}

// A surface moves 3 px right and 5 px down in each frame. Converted from each writer's form, its
// motion to the next frame and from the previous one is (3, 5).
struct Written {
    const char* profile;
    Names color;
    std::string depth;
    Names motion;
    std::array<double, 2> stored;
    Names motion_back = {};
    std::array<double, 2> stored_back = {};
};

TEST(Profiles, NamesAndConventionsOfEachWriter) {
    const Names rgba = {"R", "G", "B", "A"}, rgb = {"R", "G", "B"},
                image = {"Image.R", "Image.G", "Image.B", "Image.A"};
    const Written all[] = {
        {"cycles",
         image,
         "Depth.V",
         {"Vector.Z", "Vector.W"},
         {-3, 5},
         {"Vector.X", "Vector.Y"},
         {-3, 5}},
        // backward points to the previous position: 3 px left and, y up, 5 px up.
        {"nuke",
         rgba,
         "depth.Z",
         {"forward.u", "forward.v"},
         {3, -5},
         {"backward.u", "backward.v"},
         {-3, 5}},
        {"arnold", rgba, "Z", {"motionvector.R", "motionvector.G"}, {3, -5}},
        {"arnold", rgba, "Z", {"motionvector.X", "motionvector.Y"}, {3, -5}},
        {"arnold", rgba, "Z", {"motion_vector.R", "motion_vector.G"}, {3, -5}},
        {"vray", rgba, "Z", {"velocity.R", "velocity.G"}, {3, -5}},
        {"vray", rgb, "VRayZDepth.R", {"Velocity.R", "Velocity.G"}, {3, -5}},
        {"vray", rgb, "VRayZDepth.R", {"VRayVelocity.R", "VRayVelocity.G"}, {3, -5}},
        {"generic", rgba, "Z", {"motion.x", "motion.y"}, {3, 5}}};
    for (const Written& one : all) {
        SCOPED_TRACE(one.motion[0]);
        Names names = one.color;
        names.push_back(one.depth);
        names.insert(names.end(), one.motion.begin(), one.motion.end());
        names.insert(names.end(), one.motion_back.begin(), one.motion_back.end());
        const ProfileMatch match = detect(one_part(names));
        EXPECT_EQ(match.profile, one.profile);
        EXPECT_EQ(channels(match, Role::color), one.color);
        EXPECT_THAT(channels(match, Role::inverse_depth), ElementsAre(one.depth));
        EXPECT_EQ(channels(match, Role::motion), one.motion);
        EXPECT_EQ(channels(match, Role::motion_back), one.motion_back);
        const std::array<double, 2> expected = {3, 5};
        EXPECT_EQ(converted(match.options.motion, one.stored[0], one.stored[1]), expected);
        if (!one.motion_back.empty()) {
            EXPECT_EQ(converted(match.options.motion_back, one.stored_back[0], one.stored_back[1]),
                      expected);
        }
    }
}

TEST(Profiles, NukeDepthIsTheInverseAndGenericReadsItAsADistance) {
    const FileChannels file = one_part({"R", "G", "B", "A", "depth.Z", "forward.u", "forward.v"});
    const ProfileMatch nuke = detect(file);
    EXPECT_EQ(nuke.options.depth, DepthEncoding::inverse);
    EXPECT_THAT(nuke.notes, ElementsAre(HasSubstr("1/distance")));
    const auto generic = must(match_profile(*find_profile("generic"), file));
    EXPECT_EQ(generic.options.depth, DepthEncoding::linear);
    EXPECT_THAT(channels(generic, Role::motion), ElementsAre("forward.u", "forward.v"));
    EXPECT_EQ(converted(generic.options.motion, 3, -5), (std::array<double, 2>{3, 5}));
}

TEST(Profiles, PlainFilesAreGeneric) {
    const ProfileMatch match = detect(one_part({"R", "G", "B", "A", "Z"}));
    EXPECT_EQ(match.profile, "generic");
    EXPECT_THAT(channels(match, Role::inverse_depth), ElementsAre("Z"));
    EXPECT_THAT(match.missing.at(Role::motion), HasSubstr("motion.x, motion.y or "));
    EXPECT_THAT(match.text(), HasSubstr("motion: none; looked for motion.x, motion.y"));
    const ProfileMatch rgb = detect(one_part({"R", "G", "B"}));
    EXPECT_THAT(channels(rgb, Role::color), ElementsAre("R", "G", "B"));
    EXPECT_THAT(rgb.text(), HasSubstr("alpha 1"));
}

TEST(Profiles, PlanesMayBeAllThereIs) {
    const ProfileMatch depth = detect(one_part({"Z"}));
    EXPECT_EQ(depth.profile, "generic");
    EXPECT_THAT(channels(depth, Role::inverse_depth), ElementsAre("Z"));
    EXPECT_TRUE(depth.missing.contains(Role::color));
    EXPECT_EQ(detect(one_part({"forward.u", "forward.v"})).profile, "nuke");
}

TEST(Profiles, NamesWhatWasFoundWhenNothingFits) {
    const Status status = failure(one_part({"albedo", "uv.s", "uv.t"}));
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_THAT(status.message(), HasSubstr("found: albedo, uv.s, uv.t"));
    EXPECT_THAT(status.message(), HasSubstr("color: rgba.R"));
    EXPECT_EQ(failure(one_part({})).code(), StatusCode::input);
    EXPECT_EQ(failure({}).code(), StatusCode::input);
    const auto wrong = match_profile(*find_profile("cycles"), one_part({"Y"}));
    EXPECT_THAT(wrong.status().message(), HasSubstr("profile cycles matches no channels"));
}

FileChannels with_layers(const Names& layers, bool vectors_in_all) {
    Names names;
    for (size_t i = 0; i < layers.size(); ++i) {
        for (const char* c : {".Combined.R", ".Combined.G", ".Combined.B", ".Combined.A"})
            names.push_back(layers[i] + c);
        if (i > 0 && !vectors_in_all) continue;
        for (const char* c : {".Depth.Z", ".Vector.X", ".Vector.Y", ".Vector.Z", ".Vector.W"})
            names.push_back(layers[i] + c);
    }
    return one_part(names);
}

TEST(Layers, SeveralNeedAChoice) {
    const FileChannels file = with_layers({"fg", "bg.sky", "mid"}, true);
    const Status status = failure(file);
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_EQ(status.message(), "several layers: bg.sky, fg, mid; choose one with --layer");
    const ProfileMatch sky = detect(file, "bg.sky");
    EXPECT_EQ(sky.layer, "bg.sky");
    EXPECT_THAT(channels(sky, Role::inverse_depth), ElementsAre("bg.sky.Depth.Z"));
    EXPECT_THAT(sky.layers, ElementsAre("bg.sky", "fg", "mid"));
    const Status wrong = failure(file, "bg");
    EXPECT_EQ(wrong.code(), StatusCode::usage);
    EXPECT_EQ(wrong.message(), "layer 'bg' is not in the file; found are bg.sky, fg, mid");
}

TEST(Layers, TheOneWithVectorsIsTaken) {
    // Blender's compositor adds a layer "Composite" that has only color.
    const ProfileMatch match = detect(with_layers({"ViewLayer", "Composite"}, false));
    EXPECT_EQ(match.layer, "ViewLayer");
    EXPECT_THAT(match.notes, ElementsAre(HasSubstr("layer ViewLayer of Composite, ViewLayer")));
}

TEST(Layers, TheUnnamedOneComesFirst) {
    const FileChannels file = one_part({"R", "G", "B", "A", "diffuse.R", "diffuse.G", "diffuse.B",
                                        "depth.Z", "forward.u", "forward.v"});
    const ProfileMatch match = detect(file);
    EXPECT_EQ(match.layer, "");
    EXPECT_THAT(channels(match, Role::color), ElementsAre("R", "G", "B", "A"));
    const ProfileMatch diffuse = detect(file, "diffuse");
    EXPECT_THAT(channels(diffuse, Role::color), ElementsAre("diffuse.R", "diffuse.G", "diffuse.B"));
    EXPECT_THAT(channels(diffuse, Role::motion), ElementsAre("forward.u", "forward.v"));
}

// One part per layer, with short channel names: its channels alone make an unnamed layer too, which
// lacks the other parts.
TEST(Layers, APartsNameIsALayerToo) {
    const FileChannels file = {{{"ViewLayer.Combined", "", {"R", "G", "B", "A"}},
                                {"ViewLayer.Depth", "", {"Z"}},
                                {"ViewLayer.Vector", "", {"X", "Y", "Z", "W"}}},
                               {}};
    const ProfileMatch match = detect(file);
    EXPECT_EQ(match.layer, "ViewLayer");
    EXPECT_EQ(match.roles.at(Role::motion), (RoleChannels{2, {"Z", "W"}}));
    EXPECT_EQ(match.roles.at(Role::inverse_depth), (RoleChannels{1, {"Z"}}));
}

// Files of a sequence may have the views in different orders.
TEST(Views, TheFirstOfAllIsTheSameInEveryFile) {
    const PartChannels left = {"l", "left", {"R", "G", "B"}},
                       right = {"r", "right", {"R", "G", "B"}};
    for (const FileChannels& file :
         {FileChannels{{left, right}, {}}, FileChannels{{right, left}, {}}}) {
        const ProfileMatch match = detect(file, "", kAllViews);
        EXPECT_EQ(match.view, "left");
        EXPECT_THAT(match.other_views, ElementsAre("right"));
    }
}

TEST(Views, OfMultiViewChannelNames) {
    FileChannels file = one_part({});
    file.views = {"left", "right"};
    for (const auto& name : kCycles) {
        const size_t dot = name.rfind('.');
        for (const char* view : {".left", ".right"})
            file.parts[0].channels.push_back(name.substr(0, dot) + view + name.substr(dot));
    }
    const ProfileMatch left = detect(file, "", "left");
    EXPECT_EQ(left.view, "left");
    EXPECT_EQ(left.layer, "ViewLayer");
    EXPECT_THAT(channels(left, Role::inverse_depth), ElementsAre("ViewLayer.Depth.left.Z"));
    const ProfileMatch right = detect(file, "", "right");
    EXPECT_THAT(channels(right, Role::motion),
                ElementsAre("ViewLayer.Vector.right.Z", "ViewLayer.Vector.right.W"));
    EXPECT_THAT(right.text(), HasSubstr("view right of left, right"));
    const Status wrong = failure(file, "", "center");
    EXPECT_EQ(wrong.code(), StatusCode::usage);
    EXPECT_EQ(wrong.message(), "view 'center' is not in the file; found are left, right");
    EXPECT_THAT(failure(one_part(kCycles), "", "left").message(), HasSubstr("it has no views"));
}

TEST(Views, MustBeChosenIfThereAreSeveral) {
    FileChannels file = one_part({"R", "G", "B", "right.R", "right.G", "right.B"});
    file.views = {"left", "right"};
    const Status several = failure(file);
    EXPECT_EQ(several.code(), StatusCode::usage);
    EXPECT_EQ(several.message(), "several views: left, right; choose one with --view");
    // A file of one view of several: a renderer may write each to a file of its own.
    FileChannels one = one_part({"R", "G", "B"});
    one.views = {"left", "right"};
    EXPECT_EQ(detect(one).view, "left");
}

TEST(Views, TheDefaultViewHasPlainNames) {
    FileChannels file = one_part({"R", "G", "B", "right.R", "right.G", "right.B", "Z"});
    file.views = {"left", "right"};
    EXPECT_THAT(channels(detect(file, "", "left"), Role::color), ElementsAre("R", "G", "B"));
    EXPECT_THAT(channels(detect(file, "", "right"), Role::color),
                ElementsAre("right.R", "right.G", "right.B"));
    EXPECT_FALSE(detect(file, "", "right").roles.contains(Role::inverse_depth));
}

TEST(Parts, OnePerLayerAndView) {
    const FileChannels nuke = {
        {{"rgba", "", {"R", "G", "B", "A"}}, {"depth", "", {"Z"}}, {"forward", "", {"u", "v"}}},
        {}};
    const ProfileMatch match = detect(nuke);
    EXPECT_EQ(match.profile, "nuke");
    EXPECT_EQ(match.roles.at(Role::color), (RoleChannels{0, {"R", "G", "B", "A"}}));
    EXPECT_EQ(match.roles.at(Role::inverse_depth), (RoleChannels{1, {"Z"}}));
    EXPECT_EQ(match.roles.at(Role::motion), (RoleChannels{2, {"u", "v"}}));
    // Other versions write the whole name in the part; the beauty is not the first part.
    const FileChannels full = {{{"albedo", "", {"R", "G", "B"}},
                                {"rgba", "", {"R", "G", "B", "A"}},
                                {"forward", "", {"forward.u", "forward.v"}}},
                               {}};
    EXPECT_EQ(detect(full).roles.at(Role::color).part, 1);
    EXPECT_EQ(detect(full).roles.at(Role::motion), (RoleChannels{2, {"forward.u", "forward.v"}}));
    const FileChannels views = {{{"ViewLayer.Combined.left", "left", {"R", "G", "B", "A"}},
                                 {"ViewLayer.Combined.right", "right", {"R", "G", "B", "A"}},
                                 {"ViewLayer.Depth.left", "left", {"Z"}},
                                 {"ViewLayer.Depth.right", "right", {"Z"}}},
                                {}};
    EXPECT_EQ(detect(views, "", "left").profile, "cycles");
    EXPECT_EQ(detect(views, "", "left").roles.at(Role::inverse_depth).part, 2);
    EXPECT_EQ(detect(views, "", "right").roles.at(Role::color).part, 1);
    EXPECT_EQ(detect(views, "", "right").roles.at(Role::inverse_depth).part, 3);
}

TEST(Parts, ARoleIsNotPutTogetherFromTwo) {
    const FileChannels file = {{{"a", "", {"R", "G"}}, {"b", "", {"B", "Z"}}}, {}};
    EXPECT_TRUE(detect(file).missing.contains(Role::color));
}

constexpr const char* kOwn = R"(profile: 1
name: ours
color: [{channels: [[r, g, b, a]], unpremultiplied: true}]
depth: [{channels: [[zbuf]], encoding: reverse_infinite}]
motion: [{channels: [[mv.x, mv.y]], unit: fraction, scale: [0.5, -0.5], bias: 0.5, sentinel: 2}]
)";

TEST(OwnProfile, IsReadFromAFile) {
    const test::TempFolder folder;
    const std::string path = folder.path("profile.yaml");
    test::write_text(path, kOwn);
    const auto profile = must(find_profile(path));
    const auto match =
        must(match_profile(profile, one_part({"r", "g", "b", "a", "zbuf", "mv.x", "mv.y"})));
    EXPECT_EQ(match.why, "named");
    EXPECT_TRUE(match.options.unpremultiplied);
    EXPECT_EQ(match.options.depth, DepthEncoding::reverse_infinite);
    EXPECT_EQ(match.options.motion.unit, MotionUnit::fraction);
    EXPECT_EQ(match.options.motion.bias, 0.5);
    EXPECT_EQ(match.options.motion.sentinel, 2);
    EXPECT_EQ(converted(match.options.motion, 1, 1), (std::array<double, 2>{0.25, -0.25}));
    test::write_text(path, "profile: 1\nname: x\nmotion: [{channels: [[a]]}]\n");
    EXPECT_THAT(find_profile(path).status().message(),
                HasSubstr(":3:22: error: motion[0].channels[0]: a list of 2 channel names"));
    std::filesystem::remove(path);
    EXPECT_EQ(find_profile(path).status().code(), StatusCode::usage);
    EXPECT_THAT(find_profile("cycels").status().message(), HasSubstr("did you mean 'cycles'?"));
}

TEST(OwnProfile, NamesEveryMistake) {
    const std::string head = "profile: 1\nname: x\n";
    const std::vector<std::pair<std::string, std::string>> wrong = {
        {"profile: 1\ncolor: [{channels: [[R, G, B]]}]", "name: missing"},
        {"name: x\ncolor: [{channels: [[R, G, B]]}]", "profile: missing"},
        {"profile: 2\nname: x\ncolor: [{channels: [[R, G, B]]}]", "reads version 1"},
        {head, "missing roles"},
        {head + "colr: []", "did you mean 'color'?"},
        {head + "color: [{channels: [[R, G]]}]", "a list of 3 to 4 channel names"},
        {head + "color: [{channel: [[R, G, B]]}]", "did you mean 'channels'?"},
        {head + "color: [{}]", "channels are missing"},
        {head + "color: [{channels: []}]", "a list of lists"},
        {head + "color: R", "a list of sources"},
        {head + "color: [R]", "a map with channels"},
        {head + "color: [{channels: [[R, G, a.<layer>.B]]}]", "without a leading <layer>"},
        {head + "color: [{channels: [[R, G, <layer>.B]]}]",
         "in every name of a pattern or in no name"},
        {head + "color: [{channels: [[R, G, B]], unpremultiplied: 1}]", "true or false"},
        {head + "depth: [{channels: [[Z]], encoding: log}]", "one of linear, inverse"},
        {head + "depth: [{channels: [[Z]], scale: [1, 1]}]", "unknown key 'scale'"},
        {head + "motion: [{channels: [[x, y]], unit: uv}]", "one of pixels, fraction"},
        {head + "motion: [{channels: [[x, y]], scale: 1}]", "a list of two numbers"},
        {head + "motion: [{channels: [[x, y]], scale: [0, 1]}]", "would remove all motion"},
        {head + "motion: [{channels: [[x, y]], scale: [a, 1]}]", "a number"},
        {head + "motion: [{channels: [[x, y]], bias: .nan}]", "finite"},
        {head + "motion: [{channels: [[x, y]], sentinel: 0}]", "a number > 0"},
        {head + "priority: high\ncolor: [{channels: [[R, G, B]]}]", "not an integer in 0..1000"},
        {head + "detect: [[]]\ncolor: [{channels: [[R, G, B]]}]", "channel names"},
        {"[1]", "a profile is a map"},
    };
    for (const auto& [text, message] : wrong) {
        const ProfileFile file = parse_profile(text, "p.yaml");
        EXPECT_EQ(file.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(file.status().message(), HasSubstr(message)) << text;
    }
    EXPECT_TRUE(parse_profile(kOwn, "p.yaml").status().ok());
}

}  // namespace
}  // namespace postchain
