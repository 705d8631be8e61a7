// Objects held out of a pass: they stay as they are, and leave nothing of themselves in what is
// filtered.
#include <algorithm>
#include <cmath>
#include <string>

#include "chain/pass/matte.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

constexpr float kGround[] = {0.5f, 0.0f, 0.25f, 1.0f};

// A green object before a background of one color without green that moves too; neither is in
// focus.
TestFrame green_frame(const ImageF& matte, float object_light) {
    TestFrame frame = bright_frame(101, 67);
    const float object[] = {0.0f, object_light, 0.0f, 1.0f};
    frame.planes.at(Role::color) = make_image(101, 67, 4, [&](int x, int y, int c) {
        return matte.at(x, y) * object[c] + (1 - matte.at(x, y)) * kGround[c];
    });
    frame.description.bounds = {};
    frame.description.camera.focus_distance = 5;
    return frame;
}

ImageF held_out(const Variant& one, TestFrame frame, const ImageF& matte) {
    add_matte(frame, matte, one.links.size());
    return filter(one.chain(), frame.description, frame.planes).at(Role::color);
}

// The object keeps every bit, and the background stays what it is right up to it, whatever blurs.
TEST(Mattes, HeldOutObjectLeavesNothingInTheBackground) {
    const ImageF matte = square_matte(101, 67);
    TestFrame frame = green_frame(matte, 3);
    ImageF& color = frame.planes.at(Role::color);
    for (int y = 0; y < 67; ++y)
        for (int x = 0; x < 101; ++x)
            if (matte.at(x, y) == 1) color.at(x, y, 1) += float((x + y) % 5);
    for (const Variant& one : one_of_each_kind()) {
        const ImageF smeared = filter(one.chain(), frame.description, frame.planes).at(Role::color);
        const ImageF result = held_out(one, frame, matte);
        double leaked = 0, worst = 0;
        bool same = true;
        for (int y = 0; y < 67; ++y)
            for (int x = 0; x < 101; ++x)
                for (int c = 0; c < 4; ++c) {
                    if (matte.at(x, y) == 1) {
                        same = same && result.at(x, y, c) == color.at(x, y, c);
                        continue;
                    }
                    worst = std::max(worst, std::abs(double(result.at(x, y, c)) - kGround[c]));
                    leaked += std::abs(double(smeared.at(x, y, c)) - kGround[c]);
                }
        EXPECT_TRUE(same) << one.name;
        EXPECT_LE(worst, 2e-6) << one.name;
        EXPECT_GT(leaked, 1) << one.name << " smears it without the matte";
    }
}

// A pixel of an antialiased edge shows m of the object and 1 - m of the ground, and still does.
// So it does where the object leaves the frame by a corner.
TEST(Mattes, AntialiasedEdgesKeepWhatEachSideShows) {
    const ImageF square = square_matte(101, 67, 1);
    const auto in_corner = [&](bool last) {
        return make_image(101, 67, 1, [&](int x, int y, int) {
            return square.at(std::min(last ? 140 - x : x + 40, 100),
                             std::min(last ? 93 - y : y + 27, 66));
        });
    };
    for (const ImageF& matte : {square, in_corner(false), in_corner(true)}) {
        const TestFrame frame = green_frame(matte, 8);
        for (const Variant& one : one_of_each_kind()) {
            const Difference difference =
                compare(held_out(one, frame, matte), frame.planes.at(Role::color), 1e-5);
            // At m of a half a part of 1/8 (1/2)^16 of the pixel's own color counts as ground.
            EXPECT_LE(difference.max, 1e-4) << one.name << difference.text;
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
    const TestFrame plain = bright_frame(67, 45);
    const FramePlanes alone = filter(chain_of("motion_blur"), plain.description, plain.planes);
    EXPECT_TRUE(equal_bits(out.at(Role::color), alone.at(Role::color)));
}

// The frame's own and its neighbors'. The surfaces behind may show the object, and are not read.
TEST(Mattes, OneOfSeveralIsThatOneAlone) {
    TestFrame frame = bright_frame(67, 45);
    add_motion_back(frame);
    add_neighbors(frame);
    add_matte(frame, square_matte(67, 45, 2), 1);
    TestFrame several = frame;
    add_behind(several);
    for (const Role role : {Role::mattes, Role::mattes_before, Role::mattes_after})
        several.planes[role] = stack_planes({ImageF(67, 45, 1, 0.75f), several.planes.at(role)});
    several.description.mattes = {1};
    for (const char* pass : {"motion_blur", "joint_blur"})
        for (const MatteEffect effect : {MatteEffect::unblurred, MatteEffect::unmoved}) {
            Chain chain = chain_of(pass, {{"samples", int64_t(9)}});
            chain.links[0].matte = "object";
            chain.links[0].matte_effect = effect;
            const auto color_of = [&](TestFrame held) {
                find_speeds(chain, held.planes, held.description);
                return filter(chain, held.description, held.planes).at(Role::color);
            };
            EXPECT_TRUE(equal_bits(color_of(several), color_of(frame))) << pass << int(effect);
            TestFrame alone = frame;
            for (const Role role : {Role::color_before, Role::color_after})
                alone.description.planes.remove(role);
            EXPECT_FALSE(equal_bits(color_of(alone), color_of(frame))) << "they are read";
        }
}

// A later pass gets the layers of the frame and its neighbors, not those without the object.
TEST(Mattes, LayersOfALaterPassAreTheFrames) {
    TestFrame frame = bright_frame(67, 45);
    add_motion_back(frame);
    add_neighbors(frame);
    add_lights(frame, 1);
    TestFrame held = frame;
    add_matte(held, ImageF(67, 45, 1, 1.0f), 1);  // FXAA leaves all as it is
    held.description.mattes.push_back(-1);
    Chain chain = chain_of("fxaa");
    append(chain, "motion_blur", {{"samples", int64_t(9)}});
    const FramePlanes out = filter(chain, held.description, held.planes),
                      expected = filter(chain_of("motion_blur", {{"samples", int64_t(9)}}),
                                        frame.description, frame.planes);
    for (const Role role : {Role::color, Role::layers})
        EXPECT_TRUE(equal_bits(out.at(role), expected.at(role))) << name_of(role);
}

// A half holds each value of the frame, but no part of it.
TEST(Mattes, HeldLayersHaveAllBits) {
    TestFrame frame = bright_frame(67, 45);
    add_lights(frame, 1);
    add_matte(frame, square_matte(67, 45, 1), 1);
    frame.description.bounds.color_is_half = frame.description.bounds.layers_are_half = true;
    const Plan plan =
        *make_plan(chain_of("fxaa"), frame.description, {.precision = Precision::fp16});
    size_t held = 0;
    for (const PlanTexture& texture : plan.textures) {
        if (texture.slices != 3) continue;  // the frame's layer and what is held out
        EXPECT_EQ(texture.format, Format::rgba32f) << texture.name;
        ++held;
    }
    EXPECT_GE(held, 2u);
}

TEST(Mattes, NamedButNotHandedInIsAnError) {
    Chain chain = chain_of("motion_blur");
    chain.links[0].matte = "hero";
    const Status status = make_plan(chain, bright_frame(20, 20).description).status();
    EXPECT_EQ(status.code(), StatusCode::input);
    EXPECT_NE(status.message().find("passes[0].motion_blur: matte hero"), std::string::npos)
        << status.message();
    EXPECT_NE(chain.text().find("matte=hero"), std::string::npos);
}

}  // namespace
}  // namespace postchain::test
