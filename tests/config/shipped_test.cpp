// The shipped chains with the real passes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "chain/guest/presets.h"
#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/chain_find.h"
#include "config/profile.h"
#include "fake_passes.h"
#include "passes/registry.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"

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
    for (const auto& [key, expected] : {std::pair("mode", "guertin"),
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

TEST(Shipped, FxaaLeavesSharpPixels) {
    for (const char* name : {"fast", "balanced"})
        EXPECT_EQ(value(load(name).chain, 1, "where"), "blurred") << name;
}

TEST(Shipped, DofFirstIsPaperInAnotherOrder) {
    const Chain paper = load("paper").chain, other = load("dof_first").chain;
    EXPECT_THAT(order(other), ElementsAre("depth_of_field", "motion_blur", "fxaa"));
    EXPECT_EQ(other.links[1].text(), paper.links[0].text());
    EXPECT_EQ(other.links[2].text(), paper.links[1].text());
    EXPECT_EQ(other.links[0].text(), paper.links[2].text());
}

// The only fenced block of a language in a document.
std::string block_of(const std::string& document, const std::string& language) {
    const std::string text =
        test::read_text(std::string(POSTCHAIN_SOURCE_DIR) + "/docs/" + document);
    const std::string fence = "\n```" + language + "\n";
    const size_t begin = text.find(fence);
    EXPECT_NE(begin, std::string::npos) << document;
    EXPECT_EQ(text.find(fence, begin + 1), std::string::npos) << document;
    return text.substr(begin + fence.size(), text.find("\n```", begin + 1) - begin - fence.size());
}

TEST(Documents, ExamplesAreValid) {
    const std::string chain = block_of("chain_file.md", "yaml"),
                      camera = block_of("chain_file.md", "json"),
                      profile = block_of("profiles.md", "yaml");
    EXPECT_THAT(texts(parse_chain(chain, "doc", builtin_passes()).diagnostics), IsEmpty());
    EXPECT_THAT(texts(parse_camera(camera, "doc").diagnostics), IsEmpty());
    EXPECT_THAT(texts(parse_profile(profile, "doc").diagnostics), IsEmpty());
}

// Tiers of the C interface are the shipped chains of their names, with the neighbors that are
// given, on frames that may have one sample a pixel.
TEST(Shipped, TiersAreTheseChains) {
    std::set<std::string> shipped;
    for (const guest::Tier& tier : guest::tiers()) {
        const auto made = must(guest::make_tier(tier.name, builtin_passes()));
        const auto text = embedded_chain(tier.name);
        if (!text) continue;
        shipped.insert(tier.name);
        std::vector<std::string> changes;
        const bool joint = made.links[0].type->name == std::string("joint_blur");
        if (joint) changes.push_back("joint_blur.neighbors=both");
        if (joint && made.links.size() > 1) changes.push_back("fxaa.where=everywhere");
        ChainFile file = parse_chain(*text, builtin_passes(), changes);
        ASSERT_TRUE(file.status().ok()) << file.status().message();
        EXPECT_EQ(made.text(), file.chain.text());
    }
    EXPECT_EQ(shipped, (std::set<std::string>{"paper", "fast", "balanced", "best"}));
}

}  // namespace
}  // namespace postchain
