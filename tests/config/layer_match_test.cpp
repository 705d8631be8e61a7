// The color layers of a file, and their choice by a list of names.
#include "config/layer_match.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>

#include "tests/support/status.h"

namespace postchain {
namespace {

using test::must;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> words(const std::string& text) {
    std::istringstream in(text);
    return {std::istream_iterator<std::string>(in), {}};
}

const std::vector<std::string> kBlender = words(
    "ViewLayer.Combined.R ViewLayer.Combined.G ViewLayer.Combined.B ViewLayer.Combined.A "
    "ViewLayer.Combined_key.R ViewLayer.Combined_key.G ViewLayer.Combined_key.B "
    "ViewLayer.DiffDir.R ViewLayer.DiffDir.G ViewLayer.DiffDir.B "
    "ViewLayer.Normal.X ViewLayer.Normal.Y ViewLayer.Normal.Z ViewLayer.Depth.Z "
    "ViewLayer.Vector.X ViewLayer.Vector.Y ViewLayer.Vector.Z ViewLayer.Vector.W "
    "ViewLayer.Crypto00.r ViewLayer.Crypto00.g ViewLayer.Crypto00.b ViewLayer.Crypto00.a");

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
        for (size_t i : must(choose_layers(all, choice, match.layer))) names.push_back(all[i].name);
        return names;
    }
    std::string error(const std::string& choice) const {
        const auto indices = choose_layers(all, choice, match.layer);
        EXPECT_FALSE(indices.ok());
        EXPECT_EQ(indices.status().code(), StatusCode::usage);
        return indices.status().message();
    }
};

Layers layers_of(const FileChannels& file, const std::string& view = "") {
    const auto match = must(detect_profile(builtin_profiles(), file, "", view));
    return {match, find_layers(file, match, data_names(*find_profile(match.profile)))};
}

Layers layers_of(const std::vector<std::string>& channels) {
    return layers_of(FileChannels{{{"", "", channels}}, {}});
}

Layers with_layer(const std::string& name) {
    return layers_of(words(concat("R G B A ", name, ".R ", name, ".G ", name, ".B")));
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
    EXPECT_THAT(layers.chosen("DiffDir, Combined_key"),
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
    const Layers layers =
        layers_of({"R", "G", "B", "motion.R", "motion.G", "motion.B", "Z", "mask"});
    EXPECT_EQ(layers.data("motion"), "is not R, G, B");
    EXPECT_EQ(layers.data("mask"), "is not R, G, B");
    EXPECT_EQ(layers.data("Z"), "not there");
}

TEST(Layers, OfParts) {
    const Layers layers = layers_of(FileChannels{{{"beauty", "", {"R", "G", "B", "A"}},
                                                  {"diffuse", "", {"R", "G", "B"}},
                                                  {"light", "", {"r", "g", "b", "a"}}},
                                                 {}});
    EXPECT_THAT(layers.chosen("all"), ElementsAre("diffuse", "light"));
    EXPECT_EQ(layers.find("diffuse")->channels, (RoleChannels{1, {"R", "G", "B"}}));
    EXPECT_EQ(layers.find("light")->channels, (RoleChannels{2, {"r", "g", "b", "a"}}));
}

TEST(Layers, TwoOfOneName) {
    const Layers layers =
        layers_of(FileChannels{{{"beauty", "", {"R", "G", "B"}},
                                {"a", "", words("diffuse.R diffuse.G diffuse.B")},
                                {"b", "", words("diffuse.R diffuse.G diffuse.B")}},
                               {}});
    EXPECT_EQ(layers.error("diffuse"),
              "several layers are named 'diffuse': \"a.diffuse\" of part 1 (diffuse.R, diffuse.G, "
              "diffuse.B) and \"b.diffuse\" of part 2 (diffuse.R, diffuse.G, diffuse.B); give the "
              "whole name, or rename one");
    EXPECT_THAT(layers.chosen("b.diffuse"), ElementsAre("b.diffuse"));
    EXPECT_THAT(layers_of(words("R G B key.R key.G key.B key.r key.g key.b")).error("key"),
                HasSubstr("several layers are named 'key'"));
}

TEST(Layers, OfTheViewThatIsFiltered) {
    const FileChannels file{{{"", "",
                              words("R G B right.R right.G right.B key.left.R key.left.G "
                                    "key.left.B key.right.R key.right.G key.right.B")}},
                            {"left", "right"}};
    const Layers layers = layers_of(file, "right");
    EXPECT_THAT(layers.chosen("all"), ElementsAre("key"));
    EXPECT_EQ(layers.find("key")->channels.channels, words("key.right.R key.right.G key.right.B"));
}

// Parts whose names say nothing of their channels'.
TEST(Layers, AllOfPartsWithNamesOfTheirOwn) {
    const std::vector<std::string> beauty(kBlender.begin(), kBlender.begin() + 4),
        key(kBlender.begin() + 4, kBlender.begin() + 7),
        data(kBlender.begin() + 13, kBlender.begin() + 18);
    const Layers layers = layers_of(
        FileChannels{{{"beauty", "", beauty}, {"data", "", data}, {"light", "", key}}, {}});
    EXPECT_EQ(layers.match.layer, "ViewLayer");
    EXPECT_THAT(layers.chosen("all"), ElementsAre("light.ViewLayer.Combined_key"));
}

TEST(Layers, AllOfAViewsPartWithWholeNames) {
    const FileChannels file{{{"L", "left", kBlender}, {"R", "right", kBlender}}, {}};
    const Layers layers = layers_of(file, "right");
    EXPECT_EQ(layers.match.layer, "ViewLayer");
    EXPECT_THAT(layers.chosen("all"),
                ElementsAre("R.ViewLayer.Combined_key", "R.ViewLayer.DiffDir"));
}

// Each has two names, and none is more likely meant.
TEST(Layers, OfSeveralInANamedPartNoneIsChosen) {
    std::string channels;
    for (const char* layer : {"A", "B", "C"})
        for (const char* word : {"R", "G", "B", "A"})
            channels += concat(layer, ".Combined.", word, " ");
    const auto match = detect_profile(builtin_profiles(),
                                      FileChannels{{{"part", "", words(channels)}}, {}}, "", "");
    EXPECT_THAT(match.status().message(),
                AllOf(HasSubstr("several layers: A, B, C"), HasSubstr("choose one with --layer")));
}

// Another view layer has its own depth and vectors.
TEST(Layers, AllIsOfOneViewLayer) {
    std::vector<std::string> channels = kBlender;
    for (const char* word : {"R", "G", "B", "A"})
        channels.push_back(std::string("Sky.Combined.") + word);
    const Layers layers = layers_of(channels);
    EXPECT_THAT(layers.chosen("all"), ElementsAre("ViewLayer.Combined_key", "ViewLayer.DiffDir"));
    EXPECT_THAT(layers.chosen("Sky.Combined"), ElementsAre("Sky.Combined"));
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
