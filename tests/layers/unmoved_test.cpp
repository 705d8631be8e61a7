// Objects that a matte keeps still: as in a frame whose vectors say so.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

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

// Those of one pass that blur by motion, by name.
std::vector<std::pair<std::string, Chain>> unmoved_chains() {
    std::vector<std::pair<std::string, Chain>> all;
    for (const Variant& one : variants_that(one_of_each_kind(), reads_motion))
        all.emplace_back(one.name, unmoved(one.chain()));
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

TestFrame with_matte(const TestFrame& frame, const ImageF& matte) {
    TestFrame held = frame;
    add_matte(held, matte, 1);
    return held;
}

ImageF color_of(const Chain& chain, const TestFrame& frame) {
    return filter(chain, frame.description, frame.planes).at(Role::color);
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

// With this matte, `frame` has the color of `expected` without one, also in the reference.
void expect_color_of(const TestFrame& expected, const TestFrame& frame, const ImageF& matte) {
    const TestFrame held = with_matte(frame, matte);
    for (const auto& [name, chain] : unmoved_chains())
        EXPECT_EQ(first_difference(color_of(plain(chain), expected), color_of(chain, held)), "")
            << name;
    // Its samples do not depend on the last bit of a vector.
    const Chain blur = unmoved(chain_of("motion_blur", {{"mode", "single"}}));
    const auto color = [](const Chain& chain, const TestFrame& of) {
        return reference(chain, of.description, of.planes).planes.at(Role::color).data;
    };
    const std::vector<double> still = color(plain(blur), expected), found = color(blur, held);
    size_t different = 0;
    for (size_t i = 0; i < still.size(); ++i)
        different += std::abs(still[i] - found[i]) > 1e-3 * std::max(1.0, std::abs(still[i]));
    EXPECT_LE(double(different), 0.005 * double(still.size()));
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
        for (const auto& [name, chain] : unmoved_chains()) {
            SCOPED_TRACE(name);
            TestFrame held = with_matte(frame, matte);
            const FramePlanes expected = filter(plain(chain), still.description, still.planes);
            EXPECT_FALSE(equal_bits(expected.at(Role::color), color_of(plain(chain), frame)));
            for (const bool known : {false, true}) {
                if (known) find_speeds(chain, held.planes, held.description);
                const FramePlanes out = filter(chain, held.description, held.planes);
                for (const auto& [role, plane] : expected)
                    EXPECT_EQ(first_difference(plane, out.at(role)), "") << name_of(role);
            }
        }
    }
}

// Forth or back: the blur is left out if both are short, however fast the object is.
TEST(Unmoved, EitherSpeedBesideTheObjectCounts) {
    TestFrame frame = bright_frame(16, 8);
    add_motion_back(frame);
    add_matte(frame, square_matte(16, 8), 1);
    const Chain chain = unmoved(chain_of("motion_blur"));
    for (const auto& [px, back_px] : {std::pair(0.01, 0.01), {9.0, 0.01}, {0.01, 9.0}}) {
        frame.description.speeds_beside[0] = {px, back_px};
        const auto plan = make_plan(chain, frame.description);
        ASSERT_TRUE(plan.ok()) << plan.status().message();
        EXPECT_EQ(plan->passes[0].elided, px + back_px < 1) << px << " " << back_px;
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

// Nor can they where the object reaches a border softly: no ground is near.
TEST(Unmoved, SoftMattesScaleVectorsAtEachBorder) {
    const int width = 61, height = 45;
    const std::function<int(int, int)> distances[] = {
        [](int x, int) { return x; }, [&](int x, int) { return width - 1 - x; },
        [](int, int y) { return y; }, [&](int, int y) { return height - 1 - y; }};
    for (const auto& distance : distances) {
        SCOPED_TRACE(&distance - distances);
        TestFrame frame = bright_frame(width, height);
        ImageF matte(width, height, 1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const int px = distance(x, y);
                matte.at(x, y) = px == 0 ? 0.5f : px < 20 ? 1.0f : 0.0f;
                frame.planes.at(Role::inverse_depth).at(x, y) = px < 20 ? 0.5f : 0.1f;
            }
        frame.description.bounds = describe(frame.planes).bounds;
        TestFrame scaled = frame;
        ImageF& motion = scaled.planes.at(Role::motion);
        for (size_t i = 0; i < motion.data.size(); ++i) motion.data[i] *= 1.0f - matte.data[i / 2];
        scaled.description.bounds = describe(scaled.planes).bounds;
        expect_color_of(scaled, frame, matte);
    }
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
// ground does, the disc has as many green pixels as before (its edge is 112 pixels long). Pixels of
// its edge that have less than a fifth of it may show the ground alone.
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
            const ImageF color = color_of(unmoved(chain_of(type)), with_matte(frame, share));
            double gained = 0, thin = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const double f = double(share.at(x, y));
                    gained += double(color.at(x, y, 1)) - f;
                    if (f < 0.2) thin += f;
                }
            EXPECT_LE(gained, 0.5) << type << ", speed " << speed;
            EXPECT_GE(gained, -thin) << type << ", speed " << speed;
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
    const auto worst_green = [&](const ImageF& color) {
        double worst = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if (matte.at(x, y) == 0) worst = std::max(worst, double(color.at(x, y, 1)));
        return worst;
    };
    for (const char* type : {"motion_blur", "joint_blur"}) {
        SCOPED_TRACE(type);
        const Chain chain = unmoved(chain_of(type));
        TestFrame held = with_matte(frame, matte);
        for (const auto& [neighbor, there] : theirs)
            held.planes[role_of(neighbor, Role::mattes)] = there;
        const ImageF out = color_of(chain, held);
        const ImageF without = color_of(unmoved(chain_of(type, {{"neighbors", "none"}})), held);
        EXPECT_LE(worst_green(out), worst_green(without) + 1e-6);
        // The pixel diagonal to a corner is at no edge, so its color is interpolated with the
        // object's.
        EXPECT_LE(worst_green(out), 0.01);
        EXPECT_FALSE(equal_bits(out, without)) << "the frames around were searched";
        // Mattes of zeros in the frames around: there it would be a second one.
        for (const auto& [neighbor, there] : theirs)
            held.planes[role_of(neighbor, Role::mattes)] = ImageF(width, height, 1);
        EXPECT_GT(worst_green(color_of(chain, held)), 0.02);
        for (const auto& [neighbor, there] : theirs) {
            held.planes.erase(role_of(neighbor, Role::mattes));
            held.description.planes.remove(role_of(neighbor, Role::mattes));
        }
        EXPECT_TRUE(equal_bits(color_of(chain, held), without)) << "not searched without mattes";
    }
}

// Only the object moves: the pass is elided, and no bit of the image changes.
TEST(Unmoved, WhatAloneMovesLeavesThePassOut) {
    TestFrame frame = layered_frame(101, 67, {23.0f, -11.0f}, {0, 0}, 5);
    const ImageF matte = square_matte(101, 67);
    for (const char* mode : {"inverse_warp", "guertin"}) {
        const Chain chain = unmoved(chain_of("motion_blur", {{"mode", mode}}));
        TestFrame held = with_matte(frame, matte);
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
            other = with_matte(other, matte);
            find_speeds(chain, other.planes, other.description);
            EXPECT_EQ(make_plan(chain, other.description)->steps.empty(), speed < 1);
            expect_same_bits(chain, other.description, other.planes, {});
        }
    }
}

// Both planes count, by the part of a pixel that is not the object: 0 to 1.
TEST(Unmoved, SpeedsBesideTheObject) {
    TestFrame frame = layered_frame(101, 67, {23.0f, 0}, {8.0f, 0}, 5);
    const ImageF matte = square_matte(101, 67);
    const Chain chain = unmoved(chain_of("motion_blur"));
    const auto speeds_of = [&](const ImageF& object) {
        TestFrame held = with_matte(frame, object);
        find_speeds(chain, held.planes, held.description);
        return held.description.speeds_beside.at(0);
    };
    EXPECT_EQ(speeds_of(matte).px, 8);
    EXPECT_EQ(speeds_of(matte).back_px, 0);
    add_motion_back(frame);
    EXPECT_EQ(speeds_of(matte).px, 8);
    EXPECT_NEAR(speeds_of(matte).back_px, std::hypot(7, 1), 1e-6);
    for (const float none : {-1.0f, std::numeric_limits<float>::quiet_NaN()})
        EXPECT_EQ(speeds_of(ImageF(101, 67, 1, none)).px, 23);
    EXPECT_EQ(speeds_of(ImageF(101, 67, 1, 2)).px, 0);
    EXPECT_EQ(speeds_of(ImageF(101, 67, 1, 0.5f)).px, 11.5);
    TestFrame second = with_matte(frame, stack_planes({ImageF(101, 67, 1, 0.5f), matte}));
    second.description.mattes = {1};
    find_speeds(chain, second.planes, second.description);
    EXPECT_EQ(second.description.speeds_beside.size(), 1u);
    EXPECT_EQ(second.description.speeds_beside.at(1).px, 8);
}

// A later pass gets the frame's own motion.
TEST(Unmoved, HoldsForThePassThatHasIt) {
    const TestFrame frame = bright_frame(67, 45);
    Chain chain = unmoved(chain_of("joint_blur", {{"samples", int64_t(8)}}));
    append(chain, "motion_blur", {{"mode", "guertin"}});
    TestFrame held = with_matte(frame, ImageF(67, 45, 1));
    held.description.mattes = {0, -1};
    EXPECT_TRUE(equal_bits(color_of(chain, held), color_of(plain(chain), frame)));
    const Plan plan = *make_plan(chain, held.description);
    const auto second = std::ranges::find_if(
        plan.steps, [](const Step& step) { return step.pass == 1 && step.name == "tile_max"; });
    ASSERT_NE(second, plan.steps.end());
    EXPECT_TRUE(std::ranges::any_of(second->bindings, [&](const Binding& binding) {
        return plan.textures[size_t(binding.texture)].name == "input.motion";
    }));
}

TEST(Unmoved, IsRefusedWhereNothingMoves) {
    const TestFrame held = with_matte(bright_frame(20, 20), square_matte(20, 20));
    const Chain chain = unmoved(chain_of("fxaa"));
    EXPECT_EQ(make_plan(chain, held.description).status().code(), StatusCode::chain);
    EXPECT_NE(chain.text().find("matte_effect=unmoved"), std::string::npos);
}

}  // namespace
}  // namespace postchain::test
