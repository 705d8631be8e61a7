// Every order of up to four of the passes, and repeats: run on the GPU and against the chain of
// references.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {
namespace {

// Six passes have 1440 orders of five and of six, which take minutes.
constexpr size_t kMostPasses = 4;

std::vector<std::vector<std::string>> all_sequences() {
    std::vector<std::string> names;
    for (const auto& type : test::every_pass().types()) names.push_back(type.name);
    std::sort(names.begin(), names.end());
    std::vector<std::vector<std::string>> sequences;
    for (unsigned subset = 0; subset < 1u << names.size(); ++subset) {
        std::vector<std::string> chosen;
        for (size_t i = 0; i < names.size(); ++i)
            if (subset & 1u << i) chosen.push_back(names[i]);
        if (chosen.size() > kMostPasses) continue;
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
    const size_t passes = test::every_pass().types().size();
    // k of n passes in any order, n (n - 1) ... (n - k + 1), for k up to kMostPasses; n repeats,
    // and a third.
    size_t expected = 0, orders = 1;
    for (size_t k = 0; k <= std::min(passes, kMostPasses); ++k) {
        expected += orders;
        orders *= passes - k;
    }
    EXPECT_EQ(all_sequences().size(), expected + passes + 1);
}

TEST(Orders, EveryOrderAgreesWithTheReferencesInThatOrder) {
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

}  // namespace
}  // namespace postchain
