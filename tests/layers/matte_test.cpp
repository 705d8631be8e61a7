// Objects held out of a pass: they stay as they are, and leave nothing of themselves in what is
// filtered.
#include <algorithm>

#include "tests/layers/support.h"

namespace postchain::test {
namespace {

TEST(Mattes, OfZeroChangeNoBit) {
    TestFrame without = bright_frame(67, 45);
    add_neighbors(without);
    add_lights(without, 3);
    for (const NamedChain& one : every_mode()) {
        TestFrame with = without;
        add_matte(with, ImageF(67, 45, 1), one.chain.links.size());
        const FramePlanes a = filter(one.chain, without.description, without.planes);
        const FramePlanes b = filter(one.chain, with.description, with.planes);
        EXPECT_TRUE(equal_bits(a.at(Role::color), b.at(Role::color))) << one.name;
        EXPECT_TRUE(equal_bits(a.at(Role::layers), b.at(Role::layers))) << one.name;
    }
}

TEST(Mattes, OfOneLeaveEveryBitAsItIs) {
    for (const bool lights : {false, true}) {
        TestFrame frame = bright_frame(67, 45);
        if (lights) add_lights(frame, 2);
        for (const NamedChain& one : every_mode()) {
            TestFrame held = frame;
            add_matte(held, ImageF(67, 45, 1, 1.0f), one.chain.links.size());
            const FramePlanes out = filter(one.chain, held.description, held.planes);
            EXPECT_TRUE(equal_bits(out.at(Role::color), frame.planes.at(Role::color))) << one.name;
            EXPECT_EQ(out.count(Role::layers), lights ? 1u : 0u);
            if (lights) {
                EXPECT_TRUE(equal_bits(out.at(Role::layers), frame.planes.at(Role::layers)))
                    << one.name;
            }
        }
    }
}

// A sharp green object before a background of one color without green that moves too: the object
// keeps every bit, and the background stays what it is right up to it, whatever blurs.
TEST(Mattes, HeldOutObjectLeavesNothingInTheBackground) {
    TestFrame frame = bright_frame(96, 64);
    const ImageF matte = square_matte(96, 64);
    ImageF& color = frame.planes.at(Role::color);
    const float ground[] = {0.5f, 0.0f, 0.25f, 1.0f};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x)
            for (int c = 0; c < 4; ++c)
                color.at(x, y, c) =
                    matte.at(x, y) == 1 ? (c == 1 ? 3.0f + float((x + y) % 5) : 0.0f) : ground[c];
    frame.description.bounds = {};
    frame.description.camera.focus_distance = 5;  // neither of the two
    for (const NamedChain& one : every_mode()) {
        TestFrame held = frame;
        add_matte(held, matte, one.chain.links.size());
        const FramePlanes plain = filter(one.chain, frame.description, frame.planes);
        const FramePlanes out = filter(one.chain, held.description, held.planes);
        const ImageF& result = out.at(Role::color);
        double leaked = 0, worst = 0;
        bool same = true;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x)
                for (int c = 0; c < 4; ++c) {
                    if (matte.at(x, y) == 1) {
                        same = same && result.at(x, y, c) == color.at(x, y, c);
                        continue;
                    }
                    worst = std::max(worst, std::abs(double(result.at(x, y, c)) - ground[c]));
                    leaked += std::abs(double(plain.at(Role::color).at(x, y, c)) - ground[c]);
                }
        EXPECT_TRUE(same) << one.name;
        EXPECT_LE(worst, 2e-6) << one.name;
        // Without the matte it smears, but for the method that keeps near things from it itself.
        if (one.name.find("leak=depth") == std::string::npos) EXPECT_GT(leaked, 1) << one.name;
    }
}

TEST(Mattes, AgreeWithTheReferenceAndLightsStillSum) {
    TestFrame frame = bright_frame(45, 37);
    TestFrame neighbored = frame;
    add_neighbors(neighbored);
    for (TestFrame* one : {&frame, &neighbored}) add_lights(*one, 2);
    for (const int soft_px : {0, 4}) {
        for (const NamedChain& one : every_mode()) {
            for (TestFrame held : {frame, neighbored}) {
                add_matte(held, square_matte(45, 37, soft_px), one.chain.links.size());
                const FramePlanes out = filter(one.chain, held.description, held.planes);
                const ReferenceFrame expected = reference(one.chain, held.description, held.planes);
                for (const Role role : {Role::color, Role::layers}) {
                    const Difference difference =
                        compare(out.at(role), expected.planes.at(role), 2e-3);
                    EXPECT_LE(difference.fraction, 0.02)
                        << one.name << ", " << name_of(role) << ": " << difference.text;
                }
                EXPECT_LE(
                    relative_difference(sum_of(out.at(Role::layers), 37), out.at(Role::color)),
                    1e-5)
                    << one.name;
            }
        }
    }
}

// A pass without a matte is filtered as ever, another one of the chain with its own.
TEST(Mattes, HoldForThePassThatHasThem) {
    TestFrame frame = bright_frame(67, 45);
    Chain chain = chain_of("motion_blur");
    append(chain, "depth_of_field");
    frame.planes[Role::mattes] = stack_planes({square_matte(67, 45), ImageF(67, 45, 1, 1.0f)});
    frame.description.planes.add(Role::mattes);
    frame.description.mattes = {-1, 1};
    const FramePlanes out = filter(chain, frame.description, frame.planes);
    TestFrame plain = bright_frame(67, 45);
    const FramePlanes alone = filter(chain_of("motion_blur"), plain.description, plain.planes);
    EXPECT_TRUE(equal_bits(out.at(Role::color), alone.at(Role::color)));
}

TEST(Mattes, NamedButNotHandedInIsAnError) {
    TestFrame frame = bright_frame(20, 20);
    Chain chain = chain_of("motion_blur");
    chain.links[0].matte = "hero";
    const auto plan = make_plan(chain, frame.description);
    ASSERT_FALSE(plan.ok());
    EXPECT_EQ(plan.status().code(), StatusCode::input);
    EXPECT_NE(plan.status().message().find("passes[0].motion_blur: matte hero"), std::string::npos)
        << plan.status().message();
    EXPECT_NE(chain.text().find("matte=hero"), std::string::npos);
}

}  // namespace
}  // namespace postchain::test
