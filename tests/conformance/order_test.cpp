// Every order and subset of the passes, and repeats: run on the GPU and against the chain of
// references.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {
namespace {

std::vector<std::vector<std::string>> all_sequences() {
    std::vector<std::string> names;
    for (const auto& type : builtin_passes().types()) names.push_back(type.name);
    std::sort(names.begin(), names.end());
    std::vector<std::vector<std::string>> sequences;
    for (unsigned subset = 0; subset < 1u << names.size(); ++subset) {
        std::vector<std::string> chosen;
        for (size_t i = 0; i < names.size(); ++i)
            if (subset & 1u << i) chosen.push_back(names[i]);
        do sequences.push_back(chosen);
        while (std::next_permutation(chosen.begin(), chosen.end()));
    }
    for (const auto& name : names) sequences.push_back({name, name});  // repeats
    sequences.push_back({names[0], names[1], names[0]});
    return sequences;
}

std::string text_of_sequence(const std::vector<std::string>& sequence) {
    std::string text;
    for (const auto& name : sequence) text += (text.empty() ? "" : " -> ") + name;
    return text.empty() ? "nothing" : text;
}

// Everything moves, and the square is far out of focus.
test::TestFrame busy_frame() {
    auto frame = test::layered_frame(64, 48, {17.0f, 9.0f}, {-4.0f, 0.0f}, 11);
    frame.description.camera.f_stop = 0.2;
    return frame;
}

TEST(Orders, AreAllThere) {
    // 3 passes: 1 + 3 + 6 + 6 sequences without repetition, 4 with.
    EXPECT_EQ(all_sequences().size(), 20u);
}

TEST(Orders, EveryOrderAndSubsetAgreesWithTheReferencesInThatOrder) {
    const auto frame = busy_frame();
    std::map<std::string, ImageF> results;
    for (const auto& sequence : all_sequences()) {
        const std::string name = text_of_sequence(sequence);
        Chain chain;
        for (const auto& pass : sequence) test::append(chain, pass);
        const auto out = test::filter(chain, frame.description, frame.planes);
        const auto expected = test::reference(chain, frame.description, frame.planes);
        ASSERT_TRUE(out.count(Role::color)) << name;
        const auto difference =
            test::compare(out.at(Role::color), expected.planes.at(Role::color), 1e-3);
        // Taps and search steps that round the other way; a later pass spreads them.
        EXPECT_LE(difference.fraction, 0.02) << name << ": " << difference.text;
        for (const auto& [other, image] : results) {
            EXPECT_FALSE(test::equal_bits(image, out.at(Role::color)))
                << name << " gives the same picture as " << other;
        }
        results[name] = out.at(Role::color);
    }
}

// The hint crosses a depth of field that stands between motion blur and FXAA.
TEST(Orders, HintTravelsWithAndWithoutAPassInBetween) {
    const auto frame = busy_frame();
    const auto chain_with = [&](bool between, const char* hint) {
        Chain chain;
        test::append(chain, "motion_blur");
        if (between) test::append(chain, "depth_of_field");
        test::append(chain, "fxaa", {{"hint", std::string(hint)}});
        return chain;
    };
    for (bool between : {false, true}) {
        Plan without, with;
        const auto plain = test::filter(chain_with(between, "none"), frame.description,
                                        frame.planes, {}, &without);
        const auto hinted = test::filter(chain_with(between, "checkerboard"), frame.description,
                                         frame.planes, {}, &with);
        EXPECT_FALSE(test::equal_bits(plain.at(Role::color), hinted.at(Role::color)));
        const auto has_hint = [](const Plan& plan) {
            return std::any_of(plan.textures.begin(), plan.textures.end(), [](const auto& texture) {
                return texture.name.find("hint") != std::string::npos;
            });
        };
        EXPECT_FALSE(has_hint(without)) << "a plane nobody reads was made";
        EXPECT_TRUE(has_hint(with));
    }
}

}  // namespace
}  // namespace postchain
