// Objects that a matte keeps still: as in a frame whose vectors say so.
#include <algorithm>
#include <cmath>

#include "chain/pass/matte.h"
#include "tests/elision/support.h"
#include "tests/support/layers.h"
#include "tests/support/variants.h"

namespace postchain::test {
namespace {

// The matte "object" keeps its first pass from moving what it covers.
Chain unmoved(Chain chain) {
    chain.links[0].matte = "object";
    chain.links[0].matte_effect = MatteEffect::unmoved;
    return chain;
}

// Chains with a matte `unmoved` over their passes that blur by motion. `mattes`: for
// FrameDescription::mattes.
struct UnmovedChain {
    std::string name;
    Chain chain;
    std::vector<int> mattes;
};
std::vector<UnmovedChain> unmoved_chains() {
    std::vector<UnmovedChain> all;
    for (const Variant& one : variants_that(one_of_each_kind(), reads_motion))
        all.push_back({one.name, unmoved(one.chain()), {0}});
    return all;
}

Chain plain(const Chain& chain) {
    Chain twin = chain.clone();
    for (ChainLink& link : twin.links) {
        link.matte.clear();
        link.matte_effect.reset();
    }
    return twin;
}

TestFrame with_matte(const TestFrame& frame, const ImageF& matte, const std::vector<int>& mattes) {
    TestFrame held = frame;
    add_matte(held, matte, mattes.size());
    held.description.mattes = mattes;
    return held;
}

// The same frame as if a renderer had rendered the object at rest: by a loop of its own.
TestFrame at_rest(const TestFrame& frame, const ImageF& matte) {
    TestFrame still = frame;
    for (const Role role : {Role::motion, Role::motion_back})
        if (still.planes.count(role))
            for (size_t i = 0; i < matte.data.size(); ++i)
                if (matte.data[i] == 1)
                    still.planes.at(role).data[2 * i] = still.planes.at(role).data[2 * i + 1] = 0;
    const FrameBounds bounds = describe(still.planes).bounds;
    still.description.bounds.max_speed_px = bounds.max_speed_px;
    still.description.bounds.max_speed_back_px = bounds.max_speed_back_px;
    return still;
}

// With this matte, `frame` has the color of `expected` without one.
void expect_color_of(const TestFrame& expected, const TestFrame& frame, const ImageF& matte) {
    for (const UnmovedChain& one : unmoved_chains()) {
        const TestFrame held = with_matte(frame, matte, one.mattes);
        const ImageF wanted =
            filter(plain(one.chain), expected.description, expected.planes).at(Role::color);
        const ImageF out = filter(one.chain, held.description, held.planes).at(Role::color);
        EXPECT_EQ(first_difference(wanted, out), "") << one.name;
    }
}

TEST(Unmoved, IsTheFrameWhoseObjectIsAtRest) {
    const ImageF matte = square_matte(67, 45);
    for (const bool rich : {false, true}) {
        TestFrame frame = bright_frame(67, 45);
        if (rich) {
            add_motion_back(frame);
            add_lights(frame, kLayersPerStep);
        }
        const TestFrame still = at_rest(frame, matte);
        for (const UnmovedChain& one : unmoved_chains()) {
            SCOPED_TRACE(one.name);
            TestFrame held = with_matte(frame, matte, one.mattes);
            const FramePlanes moving = filter(plain(one.chain), frame.description, frame.planes);
            const FramePlanes expected = filter(plain(one.chain), still.description, still.planes);
            for (const bool known : {false, true}) {
                if (known) find_speeds(one.chain, held.planes, held.description);
                const FramePlanes out = filter(one.chain, held.description, held.planes);
                for (const auto& [role, plane] : expected)
                    EXPECT_EQ(first_difference(plane, out.at(role)), "") << name_of(role);
                EXPECT_FALSE(equal_bits(out.at(Role::color), moving.at(Role::color)));
            }
        }
    }
}

// At one depth, object and ground cannot be told apart: vectors count by what the matte leaves. So
// they do over a wide ramp.
TEST(Unmoved, SoftMattesScaleVectors) {
    TestFrame frame = bright_frame(67, 45);
    const ImageF soft = square_matte(67, 45, 4);
    for (float& q : frame.planes.at(Role::inverse_depth).data) q = 0.1f;
    frame.description.bounds = describe(frame.planes).bounds;
    TestFrame scaled = frame;
    ImageF& motion = scaled.planes.at(Role::motion);
    for (size_t i = 0; i < motion.data.size(); ++i) motion.data[i] *= 1.0f - soft.data[i / 2];
    scaled.description.bounds = describe(scaled.planes).bounds;
    expect_color_of(scaled, frame, soft);
}

// The edge of an antialiased matte, a pixel wide: its pixels have the depth of object or ground,
// and vectors that are mixed. Those of the object are at rest, those of the ground move with it.
TEST(Unmoved, AntialiasedEdgesMoveWithWhatTheirDepthShows) {
    const int width = 101, height = 67;
    TestFrame frame = bright_frame(width, height);
    const ImageF soft = square_matte(width, height, 1);  // 1, then a rim of 0.5
    const ImageF hard = square_matte(width, height);
    TestFrame still = at_rest(frame, hard);
    ImageF& motion = frame.planes.at(Role::motion);
    ImageF& depth = frame.planes.at(Role::inverse_depth);
    const ImageF ground_motion = still.planes.at(Role::motion);
    int rim = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (soft.at(x, y) != 0.5f) continue;
            ++rim;
            motion.at(x, y, 0) = 0.5f * (23 - 3);
            motion.at(x, y, 1) = 0.5f * (-11 + 5);
            if ((x + y) % 2) continue;  // else of the ground, as it was
            depth.at(x, y) = depth.at(width / 2, height / 2);
            for (int c = 0; c < 2; ++c) still.planes.at(Role::motion).at(x, y, c) = 0;
        }
    ASSERT_GT(rim, 50);
    still.planes[Role::inverse_depth] = depth;
    frame.description.bounds = describe(frame.planes).bounds;
    still.description.bounds = describe(still.planes).bounds;
    expect_color_of(still, frame, soft);
}

// A green disc with antialiased edges, held still before a ground without green: whatever the
// ground does, the disc has as many green pixels as before (its edge is 112 pixels long).
TEST(Unmoved, AntialiasedEdgesDoNotSpread) {
    const int width = 101, height = 67;
    for (const double speed : {3.0, 17.0}) {
        TestFrame frame =
            layered_frame(width, height, {23.0f, -11.0f}, {float(speed), float(speed / 5)}, 5);
        frame.description.camera.f_stop = 1000;
        const float of_ground = frame.planes.at(Role::inverse_depth).at(0, 0),
                    of_disc = frame.planes.at(Role::inverse_depth).at(width / 2, height / 2);
        ImageF share(width, height, 1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const float f =
                    float(std::clamp(17.8 - std::hypot(x + 0.5 - 47.3, y + 0.5 - 31.8), 0.0, 1.0));
                share.at(x, y) = f;
                frame.planes.at(Role::inverse_depth).at(x, y) = f >= 0.5f ? of_disc : of_ground;
                frame.planes.at(Role::motion).at(x, y, 0) = f >= 0.5f ? 23.0f : float(speed);
                frame.planes.at(Role::motion).at(x, y, 1) = f >= 0.5f ? -11.0f : float(speed / 5);
                for (int c = 0; c < 3; ++c)
                    frame.planes.at(Role::color).at(x, y, c) = c == 1 ? f : 0.5f * (1 - f);
            }
        frame.description.bounds = describe(frame.planes).bounds;
        for (const char* type : {"motion_blur", "joint_blur"}) {
            const Chain chain = unmoved(chain_of(type));
            const TestFrame held = with_matte(frame, share, {0});
            const ImageF color = filter(chain, held.description, held.planes).at(Role::color);
            double gained = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    gained += double(color.at(x, y, 1)) - double(share.at(x, y));
            EXPECT_NEAR(gained, 0, 0.5) << type << ", speed " << speed;
        }
    }
}

// A green object before a moving ground without green, elsewhere in the frames around: nothing of
// it is found there, where the ground comes out from behind it.
TEST(Unmoved, NeighborsShowNoSecondObject) {
    const int width = 96, height = 64;
    TestFrame frame = layered_frame(width, height, {23.0f, -11.0f}, {17.0f, 3.0f}, 5);
    add_neighbors(frame);
    frame.description.bounds = describe(frame.planes).bounds;
    frame.description.camera.f_stop = 1000;
    const ImageF matte = square_matte(width, height);
    const auto paint = [&](Role color_role, const ImageF& where, float ground) {
        ImageF& color = frame.planes.at(color_role);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c)
                    color.at(x, y, c) =
                        where.at(x, y) == 1 ? (c == 1 ? 1.0f : 0.0f) : (c == 1 ? 0.0f : ground);
    };
    paint(Role::color, matte, 0.5f);
    std::map<Neighbor, ImageF> theirs;
    for (const Neighbor neighbor : kNeighbors) {
        // The same depths, moved by half its width.
        const int shift = neighbor == Neighbor::before ? -16 : 16;
        const ImageF there = make_image(width, height, 1, [&](int x, int y, int) {
            return matte.at(std::clamp(x - shift, 0, width - 1), y);
        });
        ImageF& depth = frame.planes.at(role_of(neighbor, Role::inverse_depth));
        ImageF& motion = frame.planes.at(role_of(neighbor, Role::motion));
        const ImageF& own_depth = frame.planes.at(Role::inverse_depth);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const bool object = there.at(x, y) == 1;
                depth.at(x, y) = object ? own_depth.at(width / 2, height / 2) : own_depth.at(0, 0);
                motion.at(x, y, 0) = object ? 23.0f : 17.0f;
                motion.at(x, y, 1) = object ? -11.0f : 3.0f;
            }
        frame.planes[role_of(neighbor, Role::motion_back)] = motion;
        paint(role_of(neighbor, Role::color), there, 0.55f);  // almost the same light
        theirs[neighbor] = there;
    }
    for (const char* type : {"motion_blur", "joint_blur"}) {
        const Chain chain = unmoved(chain_of(type));
        TestFrame held = with_matte(frame, matte, {0});
        for (const auto& [neighbor, there] : theirs)
            held.planes[role_of(neighbor, Role::mattes)] = there;
        const auto worst_green = [&](const ImageF& color) {
            double worst = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x)
                    if (matte.at(x, y) == 0) worst = std::max(worst, double(color.at(x, y, 1)));
            return worst;
        };
        const FramePlanes out = filter(chain, held.description, held.planes);
        // The result shows that the frames around were searched: without them it differs.
        const Chain alone = unmoved(chain_of(type, {{"neighbors", "none"}}));
        const FramePlanes without = filter(alone, held.description, held.planes);
        EXPECT_LE(worst_green(out.at(Role::color)), worst_green(without.at(Role::color)) + 1e-6)
            << type;
        // The pixel diagonal to a corner is at no edge, so its color is interpolated with the
        // object's.
        EXPECT_LE(worst_green(out.at(Role::color)), 0.01) << type;
        EXPECT_FALSE(equal_bits(out.at(Role::color), without.at(Role::color))) << type;
        // Mattes of zeros in the frames around: there it would be a second one.
        for (const auto& [neighbor, there] : theirs)
            held.planes[role_of(neighbor, Role::mattes)] = ImageF(width, height, 1);
        const FramePlanes second = filter(chain, held.description, held.planes);
        EXPECT_GT(worst_green(second.at(Role::color)), 0.02) << type;
        // Without mattes they are not searched.
        for (const auto& [neighbor, there] : theirs) {
            held.planes.erase(role_of(neighbor, Role::mattes));
            held.description.planes.remove(role_of(neighbor, Role::mattes));
        }
        const FramePlanes unsearched = filter(chain, held.description, held.planes);
        EXPECT_TRUE(equal_bits(unsearched.at(Role::color), without.at(Role::color))) << type;
    }
}

// Only the object moves: the pass is elided, and no bit of the image changes.
TEST(Unmoved, WhatAloneMovesLeavesThePassOut) {
    TestFrame frame = layered_frame(101, 67, {23.0f, -11.0f}, {0, 0}, 5);
    const ImageF matte = square_matte(101, 67);
    for (const char* mode : {"inverse_warp", "guertin"}) {
        const Chain chain = unmoved(chain_of("motion_blur", {{"mode", mode}}));
        TestFrame held = with_matte(frame, matte, {0});
        EXPECT_FALSE(make_plan(chain, held.description)->steps.empty()) << "nothing is known";
        const Elided blocks = expect_same_bits(chain, held.description, held.planes, {});
        EXPECT_TRUE(equal_bits(blocks.outputs.at(Role::color), frame.planes.at(Role::color)));
        find_speeds(chain, held.planes, held.description);
        EXPECT_EQ(held.description.speeds_beside.at(0).px, 0);
        EXPECT_TRUE(make_plan(chain, held.description)->steps.empty());
        expect_same_bits(chain, held.description, held.planes, {});
        // A ground that moves by a quarter of a pixel does not bring it back, one by 20 does.
        for (const float speed : {0.25f, 20.0f}) {
            TestFrame other = layered_frame(101, 67, {23.0f, -11.0f}, {speed, 0}, 5);
            other = with_matte(other, matte, {0});
            find_speeds(chain, other.planes, other.description);
            EXPECT_EQ(make_plan(chain, other.description)->steps.empty(), speed < 1);
            expect_same_bits(chain, other.description, other.planes, {});
        }
    }
}

// A later pass gets the frame's own motion.
TEST(Unmoved, HoldsForThePassThatHasIt) {
    const TestFrame frame = bright_frame(67, 45);
    Chain chain = chain_of("joint_blur", {{"samples", int64_t(8)}});
    append(chain, "motion_blur", {{"mode", "guertin"}});
    Chain first = plain(chain);
    chain.links[0].matte = "object";
    chain.links[0].matte_effect = MatteEffect::unmoved;
    const TestFrame held = with_matte(frame, ImageF(67, 45, 1), {0, -1});
    EXPECT_TRUE(equal_bits(filter(chain, held.description, held.planes).at(Role::color),
                           filter(first, frame.description, frame.planes).at(Role::color)));
    const TestFrame all = with_matte(frame, ImageF(67, 45, 1, 1.0f), {0, -1});
    const Plan plan = *make_plan(chain, all.description);
    // The second pass reads the frame's own vectors.
    for (const Step& step : plan.steps) {
        if (step.pass != 1 || step.name != "tile_max") continue;
        bool own = false;
        for (const Binding& binding : step.bindings)
            own = own || plan.textures[size_t(binding.texture)].name == "input.motion";
        EXPECT_TRUE(own);
    }
}

TEST(Unmoved, IsRefusedWhereNothingMovesAndWithoutAMatte) {
    const TestFrame frame = bright_frame(20, 20);
    for (const char* type : {"fxaa", "depth_of_field"}) {
        const Chain chain = unmoved(chain_of(type));
        const TestFrame held = with_matte(frame, square_matte(20, 20), {0});
        const auto plan = make_plan(chain, held.description);
        ASSERT_FALSE(plan.ok());
        EXPECT_EQ(plan.status().code(), StatusCode::chain);
        EXPECT_NE(plan.status().message().find(concat(type, " moves nothing")), std::string::npos)
            << plan.status().message();
    }
    Chain chain = chain_of("motion_blur");
    chain.links[0].matte_effect = MatteEffect::unblurred;
    const auto plan = make_plan(chain, frame.description);
    ASSERT_FALSE(plan.ok());
    EXPECT_EQ(plan.status().code(), StatusCode::chain);
    EXPECT_NE(plan.status().message().find("none is named"), std::string::npos);
    EXPECT_EQ(chain.text().find("matte_effect"), std::string::npos);
    chain.links[0].matte_effect = MatteEffect::unmoved;
    EXPECT_NE(chain.text().find("matte_effect=unmoved"), std::string::npos);
}

}  // namespace
}  // namespace postchain::test
