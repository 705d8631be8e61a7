// The color layers of a file, and their choice by a list of names.
#include "config/layer_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_passes.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

using test::file_of;
using test::must;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kBlender =
    "ViewLayer.Combined.R ViewLayer.Combined.G ViewLayer.Combined.B ViewLayer.Combined.A "
    "ViewLayer.Combined_key.R ViewLayer.Combined_key.G ViewLayer.Combined_key.B "
    "ViewLayer.DiffDir.R ViewLayer.DiffDir.G ViewLayer.DiffDir.B "
    "ViewLayer.Normal.X ViewLayer.Normal.Y ViewLayer.Normal.Z ViewLayer.Depth.Z "
    "ViewLayer.Vector.X ViewLayer.Vector.Y ViewLayer.Vector.Z ViewLayer.Vector.W "
    "ViewLayer.Crypto00.r ViewLayer.Crypto00.g ViewLayer.Crypto00.b ViewLayer.Crypto00.a";

struct Layers {
    ProfileMatch match;
    std::vector<FileLayer> all;

    const FileLayer* find(const std::string& name) const {
        for (const FileLayer& layer : all)
            if (layer.name == name) return &layer;
        return nullptr;
    }
    std::string data(const std::string& name) const {
        const FileLayer* layer = find(name);
        return layer ? layer->data : "not there";
    }
    std::vector<std::string> chosen(const std::string& choice) const {
        std::vector<std::string> names;
        for (size_t i : must(choose_layers(all, choice, match.view_layer)))
            names.push_back(all[i].name);
        return names;
    }
    std::string error(const std::string& choice) const {
        const auto indices = choose_layers(all, choice, match.view_layer);
        EXPECT_FALSE(indices.ok());
        EXPECT_EQ(indices.status().code(), StatusCode::usage);
        return indices.status().message();
    }
};

Layers layers_of(const FileChannels& file, const std::string& view = "") {
    const auto match = must(detect_profile(builtin_profiles(), file, "", view));
    return {match, find_layers(file, match, data_names(*find_profile(match.profile)))};
}
Layers layers_of(const std::string& file) {
    return layers_of(file_of(file));
}

Layers with_layer(const std::string& name) {
    return layers_of(concat("R G B A ", name, ".R ", name, ".G ", name, ".B"));
}

TEST(Layers, OfBlender) {
    const Layers layers = layers_of(kBlender);
    ASSERT_NE(layers.find("ViewLayer.Combined_key"), nullptr);
    EXPECT_EQ(layers.data("ViewLayer.Combined_key"), "");
    EXPECT_THAT(layers.find("ViewLayer.Combined_key")->channels.channels,
                ElementsAre("ViewLayer.Combined_key.R", "ViewLayer.Combined_key.G",
                            "ViewLayer.Combined_key.B"));
    EXPECT_EQ(layers.data("ViewLayer.Normal"), "is not R, G, B");
    EXPECT_EQ(layers.data("ViewLayer.Crypto00"), "is named as data (*crypto*)");
    // Color, depth and motion vectors belong to the frame's roles.
    for (const char* role : {"ViewLayer.Combined", "ViewLayer.Depth"})
        EXPECT_EQ(layers.data(role), "not there");
    EXPECT_THAT(layers.chosen("all"), ElementsAre("ViewLayer.Combined_key", "ViewLayer.DiffDir"));
    EXPECT_THAT(layers.chosen("none"), IsEmpty());
    EXPECT_THAT(layers.chosen("DiffDir , Combined_key "),
                ElementsAre("ViewLayer.Combined_key", "ViewLayer.DiffDir"));
    EXPECT_THAT(layers.chosen("ViewLayer.DiffDir"), ElementsAre("ViewLayer.DiffDir"));
    EXPECT_THAT(layers.chosen("Combined_*"), ElementsAre("ViewLayer.Combined_key"));
}

TEST(Layers, ErrorsNameWhatIsNear) {
    const Layers layers = layers_of(kBlender);
    for (const auto& [choice, message] :
         {std::pair("Combined_kez", "no layer 'Combined_kez' (did you mean 'Combined_key'?)"),
          {"xyz", "no layer 'xyz'; color layers are Combined_key, DiffDir"},
          {"x*", "no color layer matches 'x*'"},
          {"none, Combined_key", "'none' contradicts"},
          {"Crypto00", "is named as data (*crypto*), and data is never"},
          {"Normal", "is not R, G, B"}})
        EXPECT_THAT(layers.error(choice), HasSubstr(message));
}

// The names of Arnold, V-Ray and RenderMan.
TEST(Layers, DataByName) {
    for (const char* name :
         {"N", "P", "Pref", "normals", "bumpNormals", "Z", "zDepth", "velocity", "motionvector",
          "crypto_asset00", "uv", "objectID", "mat_id", "worldPosition"})
        EXPECT_THAT(with_layer(name).chosen("all"), IsEmpty()) << name;
    for (const char* name : {"diffuse", "RGBA_key", "specular_indirect", "Paint", "Nebula", "fluid",
                             "solid", "albedo", "emission", "shadow_matte", "best", "forwardlight"})
        EXPECT_THAT(with_layer(name).chosen("all"), ElementsAre(name));
}

TEST(Layers, WhatVectorsLeaveIsNoColor) {
    const Layers layers = layers_of("R G B motion.R motion.G motion.B Z mask");
    EXPECT_EQ(layers.data("motion"), "is not R, G, B");
    EXPECT_EQ(layers.data("mask"), "is not R, G, B");
    EXPECT_EQ(layers.data("Z"), "not there");
}

TEST(Layers, OfPartsAndViews) {
    const Layers parts = layers_of("beauty: R G B A|diffuse: R G B|light: r g b a");
    EXPECT_THAT(parts.chosen("all"), ElementsAre("diffuse", "light"));
    EXPECT_EQ(parts.find("diffuse")->channels, (RoleChannels{1, {"R", "G", "B"}}));
    EXPECT_EQ(parts.find("light")->channels, (RoleChannels{2, {"r", "g", "b", "a"}}));
    // Parts whose names say nothing of their channels'.
    const Layers named = layers_of(
        "beauty: V.Combined.R V.Combined.G V.Combined.B V.Combined.A|data: V.Depth.Z V.Vector.X "
        "V.Vector.Y V.Vector.Z V.Vector.W|light: V.key.R V.key.G V.key.B");
    EXPECT_EQ(named.match.view_layer, "V");
    EXPECT_THAT(named.chosen("all"), ElementsAre("light.V.key"));
    // The layers belong to the view that is filtered.
    const Layers view = layers_of(
        file_of("R G B right.R right.G right.B key.left.R key.left.G key.left.B key.right.R "
                "key.right.G key.right.B",
                {"left", "right"}),
        "right");
    EXPECT_THAT(view.chosen("all"), ElementsAre("key"));
    EXPECT_THAT(view.find("key")->channels.channels,
                ElementsAre("key.right.R", "key.right.G", "key.right.B"));
    const Layers part_of_view =
        layers_of(file_of(concat("L@left: ", kBlender, "|R@right: ", kBlender)), "right");
    EXPECT_EQ(part_of_view.match.view_layer, "ViewLayer");
    EXPECT_THAT(part_of_view.chosen("all"),
                ElementsAre("R.ViewLayer.Combined_key", "R.ViewLayer.DiffDir"));
    // Another view layer has its own depth and vectors.
    const Layers sky =
        layers_of(kBlender + " Sky.Combined.R Sky.Combined.G Sky.Combined.B Sky.Combined.A");
    EXPECT_THAT(sky.chosen("all"), ElementsAre("ViewLayer.Combined_key", "ViewLayer.DiffDir"));
    EXPECT_THAT(sky.chosen("Sky.Combined"), ElementsAre("Sky.Combined"));
}

TEST(Layers, ChannelsWithoutALayerAreOne) {
    const FileChannels file = file_of("R G B A key.R key.G key.B");
    const auto of_key = must(detect_profile(builtin_profiles(), file, "key", ""));
    const auto layers = find_layers(file, of_key, {});
    ASSERT_EQ(layers.size(), 1u);
    EXPECT_EQ(layers[0].name, "");
    EXPECT_EQ(layers[0].channels, (RoleChannels{0, {"R", "G", "B", "A"}}));
}

TEST(Layers, TwoOfOneName) {
    const Layers layers = layers_of(
        "beauty: R G B|a: diffuse.R diffuse.G diffuse.B|b: diffuse.R diffuse.G diffuse.B");
    EXPECT_EQ(layers.error("diffuse"),
              "several layers are named 'diffuse': \"a.diffuse\" of part 1 (diffuse.R, diffuse.G, "
              "diffuse.B) and \"b.diffuse\" of part 2 (diffuse.R, diffuse.G, diffuse.B); give the "
              "whole name, or rename one");
    EXPECT_THAT(layers.chosen("b.diffuse"), ElementsAre("b.diffuse"));
    EXPECT_THAT(layers_of("R G B key.R key.G key.B key.r key.g key.b").error("key"),
                HasSubstr("several layers are named 'key'"));
    EXPECT_THAT(layers_of("R G B key.R key.G key.B key.Z").chosen("key"), ElementsAre("key"));
    // A part may have the name of another one's layer.
    const Layers nested = layers_of("beauty: R G B|a: b.R b.G b.B|a.b: R G B");
    EXPECT_THAT(nested.chosen("all"), ElementsAre("a.b", "a.b"));
    EXPECT_EQ(nested.all.at(0).channels, (RoleChannels{1, {"b.R", "b.G", "b.B"}}));
    EXPECT_EQ(nested.all.at(1).channels, (RoleChannels{2, {"R", "G", "B"}}));
    // Each has two names, and none is more likely meant.
    std::string channels = "part:";
    for (const char* layer : {"A", "B", "C"})
        for (const char* word : {"R", "G", "B", "A"})
            channels += concat(" ", layer, ".Combined.", word);
    EXPECT_THAT(detect_profile(builtin_profiles(), file_of(channels), "", "").status().message(),
                AllOf(HasSubstr("several view layers: A, B, C"),
                      HasSubstr("choose one with {view_layer}"_keyed)));
}

TEST(Layers, AProfilesOwnListCounts) {
    const ProfileFile file = parse_profile(
        "profile: 1\nname: own\ncolor:\n  - channels: [[R, G, B]]\ndata: [ramp]\n", "own.yaml");
    ASSERT_TRUE(file.status().ok()) << file.status().message();
    EXPECT_THAT(data_names(file.profile), ElementsAre("ramp"));
    EXPECT_THAT(data_names(*find_profile("cycles")), testing::Contains("N"));
    const ProfileFile wrong = parse_profile("profile: 1\nname: own\ndata: ramp\n", "own.yaml");
    EXPECT_THAT(wrong.status().message(), HasSubstr("data is a list of strings"));
}

}  // namespace
}  // namespace postchain
