// The shipped chains with the real passes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "chain/guest/tiers.h"
#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/chain_find.h"
#include "config/profile.h"
#include "fake_passes.h"
#include "passes/registry.h"
#include "tests/support/status.h"

namespace postchain {
namespace {

using test::must;
using test::texts;
using testing::ElementsAre;
using testing::IsEmpty;

ChainFile load(const std::string& name) {
    auto file = load_chain(name, builtin_passes());
    EXPECT_TRUE(file.ok()) << file.status().message();
    EXPECT_THAT(texts(file->diagnostics), IsEmpty());
    return std::move(*file);
}

std::vector<std::string> order(const Chain& chain) {
    std::vector<std::string> names;
    for (const auto& link : chain.links) names.push_back(link.type->name);
    return names;
}

std::string value(const Chain& chain, size_t pass, const std::string& key) {
    const ChainLink& link = chain.links[pass];
    return text_of(link.type->parameters->find(key)->get(link.pass->parameters()));
}

TEST(Shipped, AreFive) {
    EXPECT_THAT(shipped_chains(), ElementsAre("balanced", "best", "dof_first", "fast", "paper"));
    for (const auto& name : shipped_chains()) {
        const ChainFile file = load(name);
        // Lens and shutter come from the frames.
        EXPECT_EQ(file.chain.camera, Camera());
        const ChainFile again = parse_chain(write_chain(file.chain), "w", builtin_passes());
        EXPECT_EQ(again.chain.hash(), file.chain.hash());
    }
}

TEST(Shipped, PaperHasTheReportsValues) {
    const Chain chain = load("paper").chain;
    EXPECT_THAT(order(chain), ElementsAre("motion_blur", "fxaa", "depth_of_field"));
    for (const auto& [key, expected] :
         std::vector<std::pair<std::string, std::string>>{{"mode", "guertin"},
                                                          {"samples", "25"},
                                                          {"max_blur_px", "40"},
                                                          {"jitter", "0.95"},
                                                          {"tile_jitter", "true"},
                                                          {"tile_jitter_slope", "1"},
                                                          {"center_weight", "40"},
                                                          {"variance_threshold_px", "1.5"},
                                                          {"depth_softness", "1"},
                                                          {"sample_split", "even"},
                                                          {"shutter_frames", "unset"}})
        EXPECT_EQ(value(chain, 0, key), expected) << key;
    EXPECT_EQ(value(chain, 1, "preset"), "12");
    EXPECT_EQ(value(chain, 1, "hint"), "checkerboard");
    EXPECT_EQ(value(chain, 1, "hint_gate"), "tile");
    EXPECT_EQ(value(chain, 2, "method"), "gilham");
    EXPECT_EQ(value(chain, 2, "coc"), "lens");
}

TEST(Shipped, DofFirstIsPaperInAnotherOrder) {
    const Chain paper = load("paper").chain, other = load("dof_first").chain;
    EXPECT_THAT(order(other), ElementsAre("depth_of_field", "motion_blur", "fxaa"));
    EXPECT_EQ(other.links[1].text(), paper.links[0].text());
    EXPECT_EQ(other.links[2].text(), paper.links[1].text());
    EXPECT_EQ(other.links[0].text(), paper.links[2].text());
}

TEST(Shipped, FastBalancedAndBestTakeMoreAndMoreSamples) {
    const Chain fast = load("fast").chain, balanced = load("balanced").chain;
    EXPECT_EQ(order(fast), order(balanced));
    EXPECT_LT(std::stoi(value(fast, 0, "samples")), std::stoi(value(balanced, 0, "samples")));
    const Chain best = load("best").chain;
    EXPECT_THAT(order(best), ElementsAre("joint_blur"));
    EXPECT_GT(std::stoi(value(best, 0, "samples")), std::stoi(value(balanced, 0, "samples")));
}

// Fenced blocks of one language in a document.
std::vector<std::string> blocks_of(const std::string& document, const std::string& language) {
    std::ifstream in(std::string(POSTCHAIN_SOURCE_DIR) + "/docs/" + document);
    EXPECT_TRUE(in) << document;
    std::vector<std::string> blocks;
    bool inside = false;
    for (std::string line; std::getline(in, line);) {
        if (!inside && line == "```" + language) {
            inside = true;
            blocks.emplace_back();
        } else if (line == "```") {
            inside = false;
        } else if (inside) {
            blocks.back() += line + "\n";
        }
    }
    return blocks;
}

TEST(Documents, ExamplesAreValid) {
    const auto chains = blocks_of("chain_file.md", "yaml");
    ASSERT_EQ(chains.size(), 1u);
    EXPECT_THAT(texts(parse_chain(chains[0], "doc", builtin_passes()).diagnostics), IsEmpty());
    const auto cameras = blocks_of("chain_file.md", "json");
    ASSERT_EQ(cameras.size(), 1u);
    EXPECT_THAT(texts(parse_camera(cameras[0], "doc").diagnostics), IsEmpty());
    const auto profiles = blocks_of("profiles.md", "yaml");
    ASSERT_EQ(profiles.size(), 1u);
    EXPECT_THAT(texts(parse_profile(profiles[0], "doc").diagnostics), IsEmpty());
}

// Tiers of the C interface are the shipped chains of their names, on a frame alone.
TEST(Shipped, TiersAreTheseChains) {
    std::set<std::string> shipped;
    for (const guest::Tier& tier : guest::tiers()) {
        const auto made = must(guest::make_tier(tier.name, builtin_passes()));
        const auto text = embedded_chain(tier.name);
        if (!text) continue;
        shipped.insert(tier.name);
        ChainFile file = parse_chain(*text, builtin_passes(), {"joint_blur.neighbors=none"});
        ASSERT_TRUE(file.status().ok()) << file.status().message();
        EXPECT_EQ(made.text(), file.chain.text());
    }
    EXPECT_EQ(shipped, (std::set<std::string>{"fast", "balanced", "best"}));
}

}  // namespace
}  // namespace postchain
