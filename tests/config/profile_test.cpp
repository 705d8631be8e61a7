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

using test::file_of;
using test::must;
using test::texts;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Names = std::vector<std::string>;
using Vector = std::array<double, 2>;

Result<ProfileMatch> detect(const FileChannels& file, const std::string& layer = "",
                            const std::string& view = "") {
    return detect_profile(builtin_profiles(), file, layer, view);
}

std::string channels(const ProfileMatch& match, Role role) {
    const auto found = match.roles.find(role);
    if (found == match.roles.end()) return "none";
    std::string text = std::to_string(found->second.part);
    for (const auto& channel : found->second.channels) text += " " + channel;
    return text;
}

// "nuke, layer fg, view left: color 0 R G B, motion 1 u v": the number before the channels is the
// part's.
std::string told(const ProfileMatch& match) {
    std::string text = match.profile;
    if (!match.view_layer.empty()) text += ", layer " + match.view_layer;
    if (!match.view.empty()) text += ", view " + match.view;
    const char* before = ": ";
    for (const auto& [role, from] : match.roles) {
        text += concat(before, name_of(role), " ", channels(match, role));
        before = ", ";
    }
    return text;
}

// (x, y) by the convention: scale * (stored - bias).
Vector converted(const MotionConvention& m, double x, double y) {
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
    EXPECT_THAT(names, ElementsAre("cycles", "nuke", "arnold", "redshift", "renderman", "unreal",
                                   "vray", "generic"));
}

// Around 0.5, as fractions of the screen, y up; from the previous frame.
TEST(Profiles, UnrealHasOneDirection) {
    const std::string vectors =
        "FinalImageMovieRenderQueue_MotionVectors.R FinalImageMovieRenderQueue_MotionVectors.G";
    const auto match =
        must(detect(file_of("R G B A FinalImageMovieRenderQueue_WorldDepth.R " + vectors)));
    EXPECT_EQ(match.profile, "unreal");
    for (const Role role : {Role::motion, Role::motion_back})
        EXPECT_EQ(channels(match, role), "0 " + vectors);
    for (const auto& motion : {match.options.motion, match.options.motion_back}) {
        EXPECT_EQ(motion.unit, MotionUnit::fraction);
        EXPECT_EQ(converted(motion, 0.75, 0.25), (Vector{0.25, 0.25}));
    }
}

// Channels that may be motion vectors, and that no profile names.
TEST(Profiles, UnassignedPairsAreCandidatesForMotion) {
    const auto looked_for = [](const std::string& names) {
        return must(detect(file_of(names))).missing.at(Role::motion);
    };
    EXPECT_THAT(looked_for("R G B A Z motionVectors.R motionVectors.G"),
                ::testing::HasSubstr(" (motionVectors.R, motionVectors.G may be motion vectors; "
                                     "name them in a profile of your own)"));
    EXPECT_THAT(looked_for("R G B A Z screenMotion.B screenMotion.G screenMotion.R"),
                ::testing::HasSubstr("(screenMotion.B, screenMotion.G, screenMotion.R may be"));
    EXPECT_THAT(looked_for("R G B A Z a.x a.y b.x b.y c.x c.y d.x d.y"),
                ::testing::HasSubstr("(a.x, a.y, b.x, b.y, c.x, c.y may be"));
    // Color of another part has the same names.
    EXPECT_THAT(looked_for("rgba: R G B A|screenMotion: R G"),
                ::testing::HasSubstr("(R, G may be"));
    for (const char* none : {"R G B A Z N.X N.Y N.Z", "R G B A Z u v"})
        EXPECT_THAT(looked_for(none), ::testing::Not(::testing::HasSubstr("may be"))) << none;
}

// A surface moves 3 px right and 5 px down in each frame. Converted from each writer's form, its
// motion to the next frame and from the previous one is (3, 5).
struct Written {
    const char* profile;
    const char* color;
    const char* depth;
    const char* motion;
    double x, y;
    const char* motion_back = "";
};

TEST(Profiles, NamesAndConventionsOfEachWriter) {
    const Written all[] = {
        {"cycles", "Image.R Image.G Image.B Image.A", "Depth.V", "Vector.Z Vector.W", -3, 5,
         "Vector.X Vector.Y"},
        {"nuke", "R G B A", "depth.Z", "forward.u forward.v", 3, -5, "backward.u backward.v"},
        {"arnold", "R G B A", "Z", "motionvector.R motionvector.G", 3, -5},
        {"arnold", "R G B A", "Z", "motionvector.X motionvector.Y", 3, -5},
        {"arnold", "R G B A", "Z", "motion_vector.R motion_vector.G", 3, -5},
        {"vray", "R G B A", "Z", "velocity.R velocity.G", 3, -5},
        {"vray", "R G B", "VRayZDepth.R", "Velocity.R Velocity.G", 3, -5},
        {"vray", "R G B", "VRayZDepth.R", "VRayVelocity.R VRayVelocity.G", 3, -5},
        {"redshift", "R G B A", "Z", "MotionVectors.R MotionVectors.G", 3, -5},
        {"renderman", "r g b a", "z", "forward.x forward.y", 3, 5},
        {"generic", "R G B A", "Z", "motion.x motion.y", 3, 5}};
    for (const Written& one : all) {
        const auto match = must(detect(
            file_of(concat(one.color, " ", one.depth, " ", one.motion, " ", one.motion_back))));
        EXPECT_EQ(match.profile, one.profile) << one.motion;
        EXPECT_EQ(channels(match, Role::color), concat("0 ", one.color));
        EXPECT_EQ(channels(match, Role::inverse_depth), concat("0 ", one.depth));
        EXPECT_EQ(channels(match, Role::motion), concat("0 ", one.motion));
        EXPECT_EQ(converted(match.options.motion, one.x, one.y), (Vector{3, 5})) << one.motion;
        if (*one.motion_back == 0) continue;
        // Both point to the previous position: 3 px left and, y up, 5 px up.
        EXPECT_EQ(channels(match, Role::motion_back), concat("0 ", one.motion_back));
        EXPECT_EQ(converted(match.options.motion_back, -3, 5), (Vector{3, 5}));
    }
}

TEST(Profiles, CyclesSaysWhatNoMotionIs) {
    const auto match = must(detect(file_of(
        "L.Combined.R L.Combined.G L.Combined.B L.Vector.X L.Vector.Y L.Vector.Z L.Vector.W")));
    EXPECT_TRUE(match.detected);
    EXPECT_EQ(match.why, "channels L.Combined.R, L.Combined.G, L.Combined.B");
    EXPECT_EQ(match.options.depth, DepthEncoding::linear);
    EXPECT_EQ(match.options.motion.sentinel, 9999);
    EXPECT_EQ(match.options.motion_back.sentinel, 9999);
    EXPECT_EQ(match.options.motion.unit, MotionUnit::pixels);
    EXPECT_FALSE(match.options.unpremultiplied);
}

TEST(Profiles, NukeDepthIsTheInverseAndGenericReadsItAsADistance) {
    const FileChannels file = file_of("R G B A depth.Z forward.u forward.v");
    const auto nuke = must(detect(file));
    EXPECT_EQ(nuke.options.depth, DepthEncoding::inverse);
    EXPECT_THAT(nuke.notes, ElementsAre(HasSubstr("1/distance")));
    const auto generic = must(match_profile(*find_profile("generic"), file));
    EXPECT_EQ(generic.options.depth, DepthEncoding::linear);
    EXPECT_EQ(channels(generic, Role::motion), "0 forward.u forward.v");
    EXPECT_EQ(converted(generic.options.motion, 3, -5), (Vector{3, 5}));
}

TEST(Profiles, PlainFilesAreGeneric) {
    const auto match = must(detect(file_of("R G B Z")));
    EXPECT_EQ(match.profile, "generic");
    EXPECT_THAT(match.text(), HasSubstr("motion: none; looked for motion.x, motion.y"));
    EXPECT_THAT(match.text(), HasSubstr("alpha 1"));
    EXPECT_THAT(match.text(), testing::Not(HasSubstr("view")));
    // Planes may be all there is.
    const auto depth = must(detect(file_of("Z")));
    EXPECT_EQ(depth.profile, "generic");
    EXPECT_TRUE(depth.missing.contains(Role::color));
    EXPECT_EQ(must(detect(file_of("forward.u forward.v"))).profile, "nuke");
}

FileChannels with_layers(const Names& layers, bool vectors_in_all) {
    std::string names;
    for (const std::string& layer : layers) {
        for (const char* c : {"Combined.R", "Combined.G", "Combined.B", "Combined.A"})
            names += concat(layer, ".", c, " ");
        if (layer != layers.front() && !vectors_in_all) continue;
        for (const char* c : {"Depth.Z", "Vector.X", "Vector.Y", "Vector.Z", "Vector.W"})
            names += concat(layer, ".", c, " ");
    }
    return file_of(names);
}

const FileChannels kViewsByName = file_of("R G B right.R right.G right.B Z", {"left", "right"});
const FileChannels kViewsInLayer = file_of(
    "V.Combined.left.R V.Combined.left.G V.Combined.left.B V.Depth.left.Z "
    "V.Combined.right.R V.Combined.right.G V.Combined.right.B V.Depth.right.Z",
    {"left", "right"});

struct Found {
    FileChannels file;
    const char* layer;  // asked for
    const char* view;
    const char* told;
};

TEST(Profiles, FindsLayersViewsAndParts) {
    const FileChannels layers = with_layers({"fg", "bg.sky", "mid"}, true);
    const FileChannels unnamed =
        file_of("R G B A diffuse.R diffuse.G diffuse.B Z motion.x motion.y");
    const FileChannels parts_of_views = file_of(
        "V.Combined.left@left: R G B A|V.Combined.right@right: R G B A|V.Depth.left@left: Z|"
        "V.Depth.right@right: Z");
    const Found all[] = {
        {layers, "bg.sky", "",
         "cycles, layer bg.sky: color 0 bg.sky.Combined.R bg.sky.Combined.G bg.sky.Combined.B "
         "bg.sky.Combined.A, inverse_depth 0 bg.sky.Depth.Z, motion 0 bg.sky.Vector.Z "
         "bg.sky.Vector.W, motion_back 0 bg.sky.Vector.X bg.sky.Vector.Y"},
        // The unnamed layer first.
        {unnamed, "", "",
         "generic: color 0 R G B A, inverse_depth 0 Z, motion 0 motion.x motion.y"},
        {unnamed, "diffuse", "",
         "generic, layer diffuse: color 0 diffuse.R diffuse.G diffuse.B, inverse_depth 0 Z, "
         "motion 0 motion.x motion.y"},
        // A part's name is a layer too: its channels alone make an unnamed one, which lacks the
        // other parts.
        {file_of("V.Combined: R G B A|V.Depth: Z|V.Vector: X Y Z W"), "", "",
         "cycles, layer V: color 0 R G B A, inverse_depth 1 Z, motion 2 Z W, motion_back 2 X Y"},
        // Files of a sequence may have the views in different orders.
        {file_of("l@left: R G B|r@right: R G B"), "", kAllViews,
         "generic, view left: color 0 R G B"},
        {file_of("r@right: R G B|l@left: R G B"), "", kAllViews,
         "generic, view left: color 1 R G B"},
        {kViewsInLayer, "", "right",
         "cycles, layer V, view right: color 0 V.Combined.right.R V.Combined.right.G "
         "V.Combined.right.B, inverse_depth 0 V.Depth.right.Z"},
        {kViewsByName, "", "left", "generic, view left: color 0 R G B, inverse_depth 0 Z"},
        // A view may have the word for all views as its name.
        {file_of("l@all: R G B|r@right: R G B"), "", kAllViews, "generic, view all: color 0 R G B"},
        {kViewsByName, "", "right", "generic, view right: color 0 right.R right.G right.B"},
        // A renderer may write each view to a file of its own.
        {file_of("R G B", {"left", "right"}), "", "", "generic, view left: color 0 R G B"},
        {file_of("rgba: R G B A|depth: Z|forward: u v"), "", "",
         "nuke: color 0 R G B A, inverse_depth 1 Z, motion 2 u v"},
        // Other versions write the whole name in the part; the beauty is not the first part.
        {file_of("albedo: R G B|rgba: R G B A|forward: forward.u forward.v"), "", "",
         "nuke: color 1 R G B A, motion 2 forward.u forward.v"},
        {parts_of_views, "", "left", "cycles, view left: color 0 R G B A, inverse_depth 2 Z"},
        {parts_of_views, "", "right", "cycles, view right: color 1 R G B A, inverse_depth 3 Z"},
        {parts_of_views, "", kAllViews, "cycles, view left: color 0 R G B A, inverse_depth 2 Z"},
        // A dot before everything is no view.
        {file_of("R G B .right", {"left", "right"}), "", "", "generic, view left: color 0 R G B"},
        // A layer without color beside one with it.
        {file_of("fg.R fg.G fg.B bg.Z"), "", "", "generic, layer fg: color 0 fg.R fg.G fg.B"},
        // No role is put together from two parts.
        {file_of("a: R G|b: B Z"), "", "", "generic: inverse_depth 1 Z"}};
    for (const Found& one : all)
        EXPECT_EQ(told(must(detect(one.file, one.layer, one.view))), one.told);
    // Each of its parts names the view again.
    EXPECT_THAT(must(detect(parts_of_views, "", kAllViews)).other_views, ElementsAre("right"));
    EXPECT_THAT(must(detect(parts_of_views, "", "left")).text(),
                HasSubstr("view left of left, right"));
    // Blender's compositor adds a layer "Composite" that has only color.
    const auto with_vectors = must(detect(with_layers({"ViewLayer", "Composite"}, false)));
    EXPECT_EQ(with_vectors.view_layer, "ViewLayer");
    EXPECT_THAT(with_vectors.text(), HasSubstr("\nview layer ViewLayer of Composite, ViewLayer\n"));
    EXPECT_THAT(with_vectors.notes,
                ElementsAre(HasSubstr("layer ViewLayer of Composite, ViewLayer")));
    EXPECT_THAT(must(detect(kViewsInLayer, "", "right")).text(),
                HasSubstr("view right of left, right"));
}

TEST(Profiles, SaysWhatIsThereInstead) {
    const FileChannels layers = with_layers({"fg", "bg.sky", "mid"}, true);
    struct Refused {
        FileChannels file;
        const char* layer;
        const char* view;
        StatusCode code;
        std::string message;
    };
    const Refused all[] = {
        {file_of("albedo uv.s uv.t"), "", "", StatusCode::input, "found: albedo, uv.s, uv.t"},
        {file_of("albedo"), "", "", StatusCode::input, "color: rgba.R"},
        {file_of(""), "", "", StatusCode::input, ""},
        {FileChannels(), "", "", StatusCode::input, ""},
        {file_of("", {"left", "right"}), "", kAllViews, StatusCode::input, "found: no channels"},
        {layers, "", "", StatusCode::input,
         "several view layers: bg.sky, fg, mid; choose one with {view_layer}"_keyed},
        {with_layers({"fg", "bg.fg"}, true), "", "", StatusCode::input,
         "several view layers: bg.fg, fg; choose one with {view_layer}"_keyed},
        {layers, "bg", "", StatusCode::usage,
         "view layer 'bg' is not in the file; found are bg.sky, fg, mid"},
        {kViewsByName, "", "", StatusCode::usage,
         "several views: left, right; choose one with {view}"_keyed},
        {kViewsByName, "", "center", StatusCode::usage,
         "view 'center' is not in the file; found are left, right"},
        {file_of("R G B"), "", "left", StatusCode::usage, "it has no views"}};
    for (const auto& [file, layer, view, code, message] : all) {
        const Status status = detect(file, layer, view).status();
        EXPECT_EQ(status.code(), code) << message;
        EXPECT_THAT(status.message(), HasSubstr(message));
    }
    // At most 40 channels.
    const auto found = [](int channels) {
        std::string names;
        for (int i = 1; i <= channels; ++i) names += concat("c", i, " ");
        const std::string text = detect(file_of(names)).status().message();
        const size_t from = text.find(", c39, ");
        return text.substr(from, text.find(';', from) - from);
    };
    EXPECT_EQ(found(40), ", c39, c40");
    EXPECT_EQ(found(42), ", c39, c40 and 2 more");
    EXPECT_THAT(match_profile(*find_profile("cycles"), file_of("Y")).status().message(),
                HasSubstr("profile cycles matches no channels"));
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
    const auto match =
        must(match_profile(must(find_profile(path)), file_of("r g b a zbuf mv.x mv.y")));
    EXPECT_EQ(match.why, "named");
    EXPECT_TRUE(match.options.unpremultiplied);
    EXPECT_EQ(match.options.depth, DepthEncoding::reverse_infinite);
    EXPECT_EQ(match.options.motion.unit, MotionUnit::fraction);
    EXPECT_EQ(match.options.motion.sentinel, 2);
    EXPECT_EQ(converted(match.options.motion, 1, 1), (Vector{0.25, -0.25}));
    EXPECT_THAT(match.text(),
                HasSubstr("color: r, g, b, a, not premultiplied\n"
                          "inverse_depth: zbuf, stored as reverse_infinite\n"
                          "motion: mv.x, mv.y times (0.5, -0.5) of the image's size, bias 0.5\n"));
    test::write_text(path, "profile: 1\nname: x\nmotion: [{channels: [[a]]}]\n");
    EXPECT_THAT(find_profile(path).status().message(),
                HasSubstr(":3:22: error: motion[0].channels[0]: a list of 2 channel names"));
    std::filesystem::remove(path);
    EXPECT_EQ(find_profile(path).status().code(), StatusCode::usage);
    EXPECT_THAT(find_profile("cycels").status().message(), HasSubstr("did you mean 'cycles'?"));
}

TEST(OwnProfile, NamesEveryMistake) {
    const std::string head = "profile: 1\nname: x\n", color = "\ncolor: [{channels: [[R, G, B]]}]";
    const std::pair<std::string, const char*> wrong[] = {
        {"profile: 1" + color, "name: missing"},
        {"name: x" + color, "profile: missing"},
        {"profile: 2\nname: x" + color, "reads version 1"},
        {head, "missing roles"},
        {head + "colr: []", "did you mean 'color'?"},
        {head + "color: [{channels: [[R, G]]}]", "a list of 3 to 4 channel names"},
        {head + "color: [{channel: [[R, G, B]]}]", "did you mean 'channels'?"},
        {head + "color: [{}]", "channels are missing"},
        {head + "color: [{channels: []}]", "a list of lists"},
        {head + "color: R", "a list of sources"},
        {head + "color: []", "a list of sources"},
        {head + "color: [R]", "a map with channels"},
        {head + "color: [{channels: [[R, G, a.<layer>.B]]}]", "without a leading <layer>"},
        {head + "color: [{channels: [[R, G, <layer>.B]]}]", "in every name of a pattern"},
        {head + "color: [{channels: [[R, G, B]], unpremultiplied: 1}]", "true or false"},
        {head + "color: [{channels: [[R, G, B]], unpremultiplied: 01}]", "true or false"},
        {head + "depth: [{channels: [[Z]], encoding: log}]", "one of linear, inverse"},
        {head + "depth: [{channels: [[Z]], scale: [1, 1]}]", "unknown key 'scale'"},
        {head + "motion: [{channels: [[x, y]], unit: uv}]", "one of pixels, fraction"},
        {head + "motion: [{channels: [[x, y]], scale: 1}]", "a list of two numbers"},
        {head + "motion: [{channels: [[x, y]], scale: [0, 1]}]", "would remove all motion"},
        {head + "motion: [{channels: [[x, y]], scale: [a, 1]}]", "a number"},
        {head + "motion: [{channels: [[x, y]], bias: .nan}]", "'.nan' is not a number"},
        {head + "motion: [{channels: [[x, y]], sentinel: 0}]", ": '0' is not a number > 0"},
        {head + "priority: high" + color, "not an integer in 0..1000"},
        {head + "priority: -1" + color, "not an integer in 0..1000"},
        {head + "detect: [[]]" + color, "channel names"},
        {"[1]", "a profile is a map"}};
    for (const auto& [text, message] : wrong) {
        const ProfileFile file = parse_profile(text, "p.yaml");
        EXPECT_EQ(file.status().code(), StatusCode::usage) << text;
        EXPECT_THAT(file.status().message(), HasSubstr(message)) << text;
    }
}

}  // namespace
}  // namespace postchain
