// Objects held out of a pass: they stay as they are, and leave nothing of themselves in what is
// filtered.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

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
        if (lights) add_lights(frame, kLayersPerStep);
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
    for (const NamedChain& one : every_mode()) {
        TestFrame held = frame;
        add_matte(held, matte, one.chain.links.size());
        const FramePlanes plain = filter(one.chain, frame.description, frame.planes);
        const FramePlanes out = filter(one.chain, held.description, held.planes);
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
        // Without the matte it smears, but for the method that keeps near things from it itself.
        if (one.name.find("leak=depth") == std::string::npos) {
            EXPECT_GT(leaked, 1) << one.name;
        }
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
    for (const NamedChain& one : every_mode()) {
        TestFrame held = frame;
        add_matte(held, matte, one.chain.links.size());
        const FramePlanes out = filter(one.chain, held.description, held.planes);
        // At m of a half a part of 1/8 (1/2)^16 of the pixel's own color counts as ground.
        EXPECT_LE(compare(out.at(Role::color), color, 1e-5).max, 1e-4)
            << one.name << compare(out.at(Role::color), color, 1e-5).text;
    }
}

// Texture before texture, the edge antialiased: against what is composed of ground and object as
// they are known, filtered as layers. `c (1 - m)` in the place of the ground is several times as
// wrong.
TEST(Mattes, SoftPixelsAreTakenApart) {
    const int width = 101, height = 67;
    TestFrame frame = bright_frame(width, height);
    frame.description.camera.focus_distance = 5;
    const ImageF ground = textured_image(width, height, 4, 21);
    ImageF object = textured_image(width, height, 4, 22), matte(width, height, 1);
    for (float& value : object.data) value += 2;
    ImageF& color = frame.planes.at(Role::color);
    ImageF true_held(width, height, 4), color_held = true_held, kept = true_held;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float from_edge = 18.3f - std::hypot(float(x) - 47.6f, float(y) - 31.2f);
            const float m = std::clamp(from_edge + 0.5f, 0.0f, 1.0f);
            matte.at(x, y) = m;
            kept.at(x, y) = 1 - m;
            for (int c = 0; c < 4; ++c) {
                color.at(x, y, c) = m * object.at(x, y, c) + (1 - m) * ground.at(x, y, c);
                true_held.at(x, y, c) = (1 - m) * ground.at(x, y, c);
                color_held.at(x, y, c) = (1 - m) * color.at(x, y, c);
            }
        }
    frame.description.bounds = {};
    for (const char* type : {"motion_blur", "depth_of_field", "joint_blur"}) {
        const Chain chain = chain_of(type);
        TestFrame lit = frame;
        lit.description.layers = 3;
        lit.description.planes.add(Role::layers);
        lit.planes[Role::layers] = stack_planes({true_held, color_held, kept});
        const ImageF layers = filter(chain, lit.description, lit.planes).at(Role::layers);
        TestFrame held = frame;
        add_matte(held, matte, 1);
        const ImageF out = filter(chain, held.description, held.planes).at(Role::color);
        double error = 0, by_color = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double m = matte.at(x, y), coverage = layers.at(x, y + 2 * height);
                if (m == 1 || coverage < 0.1) continue;
                for (int c = 0; c < 3; ++c) {
                    const double truth =
                        m * object.at(x, y, c) + (1 - m) / coverage * layers.at(x, y, c);
                    const double old =
                        m * color.at(x, y, c) + (1 - m) / coverage * layers.at(x, y + height, c);
                    error += std::abs(out.at(x, y, c) - truth);
                    by_color += std::abs(old - truth);
                }
            }
        EXPECT_LT(error, 0.25 * by_color) << type;
        std::printf("%s: %.2f of the error of c (1 - m)\n", type, error / by_color);
    }
}

TEST(Mattes, AgreeWithTheReferenceAndLightsStillSum) {
    TestFrame frame = bright_frame(45, 37);
    TestFrame neighbored = frame;
    add_neighbors(neighbored);
    for (TestFrame* one : {&frame, &neighbored}) add_lights(*one, kLayersPerStep);
    for (const int soft_px : {0, 1, 4}) {
        for (const NamedChain& one : every_mode()) {
            for (TestFrame held : {frame, neighbored}) {
                add_matte(held, square_matte(45, 37, soft_px), one.chain.links.size());
                SCOPED_TRACE(one.name);
                expect_reference_and_sum(one.chain, held);
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

// The programs that the planner adds around a pass with a matte.
std::set<std::string> matte_programs(int layers) {
    TestFrame frame = bright_frame(20, 20);
    add_lights(frame, layers);
    add_matte(frame, square_matte(20, 20), 1);
    const auto plan = make_plan(chain_of("fxaa"), frame.description);
    EXPECT_TRUE(plan.ok()) << plan.status().message();
    std::set<std::string> programs;
    for (const Step& step : plan->steps)
        if (step.program.file.starts_with("common/")) programs.insert(step.program.text());
    return programs;
}

TEST(Mattes, HaveOneProgramForAnyCountOfLayers) {
    EXPECT_EQ(matte_programs(1).size(), 2);
    EXPECT_EQ(matte_programs(1), matte_programs(9));
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
