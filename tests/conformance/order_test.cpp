// Passes in any order, and repeats: run on the GPU and against the chain of references. All pairs,
// and a sample of longer orders.
#include <gtest/gtest.h>

#include <random>

#include "chain/base/text.h"
#include "tests/support/gpu.h"
#include "tests/support/images.h"

namespace postchain {
namespace {

using Sequence = std::vector<std::string>;

// Everything moves, and the square is far out of focus.
test::TestFrame busy_frame() {
    auto frame = test::layered_frame(45, 37, {17.0f, 9.0f}, {-4.0f, 0.0f}, 11);
    frame.description.camera.f_stop = 0.2;
    return frame;
}

Chain chain_of(const Sequence& sequence) {
    Chain chain;
    for (const auto& name : sequence) test::append(chain, name);
    return chain;
}

// Passes whose defaults do something on this frame.
Sequence acting_passes(const PassRegistry& registry, const FrameDescription& frame) {
    Sequence names;
    for (const auto& type : registry.types()) {
        const auto plan = make_plan(chain_of({type.name}), frame);
        EXPECT_TRUE(plan.ok()) << plan.status().message();
        if (plan.ok() && !plan->passes[0].elided) names.push_back(type.name);
    }
    return names;
}

// Orders of three and of four different passes, as many of each; the same ones every time.
std::vector<Sequence> sampled_orders(Sequence names, int of_each) {
    std::mt19937 random(1);
    std::vector<Sequence> orders;
    for (size_t length = 3; length <= std::min<size_t>(names.size(), 4); ++length)
        for (int i = 0; i < of_each; ++i) {
            for (size_t k = 0; k < length; ++k)
                std::swap(names[k], names[k + random() % (names.size() - k)]);
            orders.emplace_back(names.begin(), names.begin() + std::ptrdiff_t(length));
        }
    return orders;
}

TEST(Orders, EveryOrderAgreesWithTheReferencesInThatOrder) {
    const auto frame = busy_frame();
    const Sequence names = acting_passes(test::every_pass(), frame.description);
    std::vector<Sequence> sequences = sampled_orders(names, 6);
    for (const auto& first : names)
        for (const auto& second : names) sequences.push_back({first, second});
    sequences.push_back({});
    sequences.push_back({names[0], names[1], names[0]});
    for (const auto& sequence : sequences) {
        SCOPED_TRACE(joined(sequence, " -> "));
        const Chain chain = chain_of(sequence);
        const auto out = test::filter(chain, frame.description, frame.planes);
        const auto expected = test::reference(chain, frame.description, frame.planes);
        const auto difference =
            test::compare(out.at(Role::color), expected.planes.at(Role::color), 1e-3);
        // Taps and search steps that round the other way; a later pass spreads them.
        EXPECT_LE(difference.fraction, 0.02) << difference.text;
    }
}

}  // namespace
}  // namespace postchain
