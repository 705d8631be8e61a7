// Objects held out of a pass: they stay as they are, and leave nothing of themselves in what is
// filtered.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

// A sharp green object before a background of one color without green that moves too: the object
// keeps every bit, and the background stays what it is right up to it, whatever blurs.
TEST(Mattes, HeldOutObjectLeavesNothingInTheBackground) {
    TestFrame frame = bright_frame(101, 67);
    const ImageF matte = square_matte(101, 67);
    ImageF& color = frame.planes.at(Role::color);
    const float ground[] = {0.5f, 0.0f, 0.25f, 1.0f};
    for (int y = 0; y < 67; ++y)
        for (int x = 0; x < 101; ++x)
            for (int c = 0; c < 4; ++c)
                color.at(x, y, c) =
                    matte.at(x, y) == 1 ? (c == 1 ? 3.0f + float((x + y) % 5) : 0.0f) : ground[c];
    frame.description.bounds = {};
    frame.description.camera.focus_distance = 5;  // neither of the two
    for (const Variant& one : one_of_each_kind()) {
        TestFrame held = frame;
        add_matte(held, matte, one.links.size());
        const FramePlanes plain = filter(one.chain(), frame.description, frame.planes);
        const FramePlanes out = filter(one.chain(), held.description, held.planes);
        const ImageF& result = out.at(Role::color);
        double leaked = 0, worst = 0;
        bool same = true;
        for (int y = 0; y < 67; ++y)
            for (int x = 0; x < 101; ++x)
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
        EXPECT_GT(leaked, 1) << one.name << " smears it without the matte";
    }
}

// The same with an antialiased edge: a pixel there shows m of the object and 1 - m of the ground,
// and still does.
TEST(Mattes, AntialiasedEdgesKeepWhatEachSideShows) {
    TestFrame frame = bright_frame(101, 67);
    const ImageF matte = square_matte(101, 67, 1);
    ImageF& color = frame.planes.at(Role::color);
    const float ground[] = {0.5f, 0.0f, 0.25f, 1.0f}, object[] = {0.0f, 8.0f, 0.0f, 1.0f};
    for (int y = 0; y < 67; ++y)
        for (int x = 0; x < 101; ++x)
            for (int c = 0; c < 4; ++c)
                color.at(x, y, c) = matte.at(x, y) * object[c] + (1 - matte.at(x, y)) * ground[c];
    frame.description.bounds = {};
    frame.description.camera.focus_distance = 5;
    for (const Variant& one : one_of_each_kind()) {
        TestFrame held = frame;
        add_matte(held, matte, one.links.size());
        const FramePlanes out = filter(one.chain(), held.description, held.planes);
        // At m of a half a part of 1/8 (1/2)^16 of the pixel's own color counts as ground.
        EXPECT_LE(compare(out.at(Role::color), color, 1e-5).max, 1e-4)
            << one.name << compare(out.at(Role::color), color, 1e-5).text;
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
