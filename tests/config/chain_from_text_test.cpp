// A guest's chain from the text of a chain file, through the C interface.
#include "config/chain_from_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <postchain/postchain.hpp>
#include <string>

namespace {

using ::testing::HasSubstr;

pc_parameter row(pc_chain* chain, uint32_t pass, const std::string& key) {
    for (const auto& row : pc::parameters(chain))
        if (row.pass == pass && row.key == key) return row;
    ADD_FAILURE() << key << " is not there";
    return {};
}

TEST(ChainFromText, YamlAndJson) {
    for (const char* text : {"postchain: 1\ncamera: {f_stop: 2.5}\npasses:\n  - fxaa\n  - "
                             "motion_blur: {samples: 51}\n",
                             R"({"postchain": 1, "camera": {"f_stop": 2.5},
              "passes": ["fxaa", {"motion_blur": {"samples": 51}}]})"}) {
        pc_chain* made = nullptr;
        ASSERT_EQ(pc_chain_from_text(text, "here", &made), PC_OK) << pc_create_error();
        const pc::Chain chain(made);
        EXPECT_EQ(row(made, 1, "samples").value, 51);
        EXPECT_STREQ(row(made, 1, "samples").pass_name, "motion_blur");
        EXPECT_EQ(row(made, PC_CAMERA, "f_stop").value, 2.5);
    }
}

TEST(ChainFromText, FaultsAreNamedWithTheirPlace) {
    pc_chain* made = nullptr;
    for (const auto& [text, fault] :
         {std::pair("postchain: 1\npasses:\n  - motion_blur: {samples: 24}\n", "my.yaml:3:"),
          {"passes: [", "my.yaml:"},
          {"postchain: 1\ncamera: {aperture_image: star.png}\npasses: [fxaa]\n",
           "pc_chain_set_aperture()"},
          // A host hands in one matte, its mask.
          {"postchain: 1\npasses: [{fxaa: {matte: hero}}]",
           "fxaa.matte: \"hero\": a host hands in one matte"}}) {
        EXPECT_EQ(pc_chain_from_text(text, "my.yaml", &made), PC_ERROR_CHAIN) << text;
        EXPECT_EQ(made, nullptr);
        EXPECT_THAT(pc_create_error(), HasSubstr(fault));
    }
    const char* good = "postchain: 1\npasses: [{fxaa: {matte: mask}}]";
    EXPECT_EQ(pc_chain_from_text(nullptr, nullptr, &made), PC_ERROR_ARGUMENT);
    EXPECT_EQ(pc_chain_from_text(good, nullptr, nullptr), PC_ERROR_ARGUMENT);
    EXPECT_EQ(pc_chain_from_text(good, nullptr, &made), PC_OK) << pc_create_error();
    pc_chain_destroy(made);
}

TEST(ChainFromText, Shipped) {
    pc_chain* made = nullptr;
    ASSERT_EQ(pc_chain_shipped("paper", &made), PC_OK) << pc_create_error();
    const pc::Chain chain(made);
    EXPECT_STREQ(row(made, 0, "mode").text, "guertin");
    EXPECT_STREQ(row(made, 2, "method").text, "gilham");
    EXPECT_EQ(pc_chain_shipped("papers", &made), PC_ERROR_CHAIN);
    EXPECT_THAT(pc_create_error(), HasSubstr("balanced, best, dof_first, fast, paper"));
    EXPECT_EQ(pc_chain_shipped(nullptr, &made), PC_ERROR_CHAIN);
    EXPECT_EQ(pc_chain_shipped("paper", nullptr), PC_ERROR_ARGUMENT);
}

}  // namespace
