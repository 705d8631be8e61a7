// The sum proof for each chain that is shipped.
#include "config/chain_find.h"
#include "tests/support/layers.h"

namespace postchain::test {
namespace {

TEST(Layers, LightsSumToTheFilteredColorOfEveryShippedChain) {
    const std::vector<std::string> names = shipped_chains();
    ASSERT_FALSE(names.empty());
    for (const bool traced : {false, true}) {
        TestFrame frame = traced ? traced_frame() : bright_frame(67, 45);
        if (!traced) add_neighbors(frame);
        add_lights(frame, 5);
        for (const std::string& name : names) {
            auto loaded = load_chain(name, every_pass());
            ASSERT_TRUE(loaded.ok()) << loaded.status().message();
            const FramePlanes out = filter(loaded->chain, frame.description, frame.planes);
            EXPECT_GT(relative_difference(out.at(Role::color), frame.planes.at(Role::color)), 1e-3)
                << name;
            EXPECT_LE(
                relative_difference(sum_of_layers(out.at(Role::layers), frame.description.height),
                                    out.at(Role::color)),
                1e-5)
                << name;
        }
    }
}

}  // namespace
}  // namespace postchain::test
