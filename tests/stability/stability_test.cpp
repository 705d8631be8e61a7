// Error and temporal error of the shipped chains on exact shots (docs/stability.md). The limits are
// what they reach.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/stability/shots.h"

namespace postchain::test::stability {
namespace {

struct Limit {
    std::string shot, chain;
    double error, temporal_error;
};
void PrintTo(const Limit& limit, std::ostream* out) {
    *out << limit.shot << ", " << limit.chain;
}

const std::vector<Limit>& limits() {
    static const std::vector<Limit> all = {
        {"slow_pan", "paper", 0.0154, 0.264},
        {"slow_pan", "fast", 0.0027, 0.047},
        {"slow_pan", "balanced", 0.0027, 0.046},
        {"slow_pan", "best", 0.0027, 0.046},
        {"acceleration", "paper", 0.0144, 0.395},
        {"acceleration", "fast", 0.0093, 0.356},
        {"acceleration", "balanced", 0.0055, 0.166},
        {"acceleration", "best", 0.0047, 0.173},
        {"stop", "paper", 0.0231, 0.356},
        {"stop", "fast", 0.0161, 0.312},
        {"stop", "balanced", 0.0066, 0.118},
        {"stop", "best", 0.0063, 0.115},
        {"wires", "paper", 0.0405, 0.666},
        {"wires", "fast", 0.0083, 0.167},
        {"wires", "balanced", 0.0083, 0.167},
        {"wires", "best", 0.0083, 0.167},
        {"still_texture", "paper", 0.0126, 0.239},
        {"still_texture", "fast", 0.0065, 0.127},
        {"still_texture", "balanced", 0.0045, 0.088},
        {"still_texture", "best", 0.0044, 0.086},
        {"rack_focus", "paper", 0.0297, 0.857},
        {"rack_focus", "fast", 0.0072, 0.772},
        {"rack_focus", "balanced", 0.0073, 0.772},
        {"rack_focus", "best", 0.0072, 0.810},
        {"lamp", "paper", 0.0486, 1.028},
        {"lamp", "fast", 0.0142, 0.842},
        {"lamp", "balanced", 0.0135, 0.738},
        {"lamp", "best", 0.0123, 0.720},
        {"fan", "paper", 0.0216, 0.268},
        {"fan", "fast", 0.0134, 0.166},
        {"fan", "balanced", 0.0080, 0.093},
        {"fan", "best", 0.0074, 0.088},
        {"bounce", "paper", 0.0127, 0.563},
        {"bounce", "fast", 0.0080, 0.493},
        {"bounce", "balanced", 0.0029, 0.149},
        {"bounce", "best", 0.0023, 0.119},
        {"bounce_spin_lens", "paper", 0.0317, 0.837},
        {"bounce_spin_lens", "fast", 0.0094, 0.535},
        {"bounce_spin_lens", "balanced", 0.0062, 0.255},
        {"bounce_spin_lens", "best", 0.0052, 0.181},
        {"pendulum", "paper", 0.0137, 0.525},
        {"pendulum", "fast", 0.0043, 0.174},
        {"pendulum", "balanced", 0.0030, 0.126},
        {"pendulum", "best", 0.0025, 0.109},
        {"pendulum_spin_lens", "paper", 0.0311, 0.875},
        {"pendulum_spin_lens", "fast", 0.0070, 0.292},
        {"pendulum_spin_lens", "balanced", 0.0060, 0.250},
        {"pendulum_spin_lens", "best", 0.0052, 0.186},
        {"ends", "paper", 0.0142, 0.212},
        {"ends", "fast", 0.0088, 0.133},
        {"ends", "balanced", 0.0078, 0.116},
        {"ends", "best", 0.0078, 0.117},
        {"cut", "paper", 0.0204, 0.201},
        {"cut", "fast", 0.0110, 0.115},
        {"cut", "balanced", 0.0100, 0.104},
        {"cut", "best", 0.0100, 0.104},
    };
    return all;
}

class Stability : public testing::TestWithParam<Limit> {};

TEST_P(Stability, IsAsReached) {
    static std::map<std::string, std::vector<ShotFrame>> rendered;  // of one shot
    const auto& [name, chain, error, temporal_error] = GetParam();
    if (!rendered.contains(name)) {
        rendered.clear();
        for (const Shot& shot : shots())
            if (shot.name == name) rendered[name] = render(shot);
    }
    const Measured measured = measure(rendered.at(name), shipped_chain(chain));
    EXPECT_LE(measured.mean("error"), error);
    EXPECT_LE(measured.mean("temporal_error"), temporal_error);
}

INSTANTIATE_TEST_SUITE_P(Of, Stability, testing::ValuesIn(limits()),
                         [](const auto& one) { return one.param.shot + "_" + one.param.chain; });

// Every shot has limits for every chain that the table shows.
TEST(StabilityLimits, AreThereForEveryShot) {
    std::map<std::string, std::set<std::string>> chains;
    for (const Limit& limit : limits()) chains[limit.shot].insert(limit.chain);
    for (const Shot& shot : shots())
        EXPECT_EQ(chains[shot.name], (std::set<std::string>{"paper", "fast", "balanced", "best"}))
            << shot.name;
}

}  // namespace
}  // namespace postchain::test::stability
