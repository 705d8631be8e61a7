// Focus at a place of the frame, whose depth stays on the device.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "chain/guest/followed_depths.h"
#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"

namespace postchain::test::focus_test {
namespace {

constexpr int kWidth = 96, kHeight = 60;

// The frame with one inverse depth left and another right of the middle.
HostTexture two_depths(float left, float right) {
    return HostTexture(GL_R32F, make_image(kWidth, kHeight, 1, [&](int x, int, int) {
                           return x < kWidth / 2 ? left : right;
                       }));
}

ImageF filtered(const pc::Instance& guest, const pc::Chain& chain, const pc_frame& frame) {
    const pc_texture result = run(guest, chain, frame);
    glFinish();  // the next frame knows this one's depth
    return read(result, kWidth, kHeight);
}

// A lens at the distance that the chain is said to focus at.
ImageF at_distance(const pc::Instance& guest, pc_frame frame, double inverse_depth) {
    static const pc::Chain plain = chain("depth_of_field");
    frame.focus_distance = float(1 / inverse_depth);
    return read(prepare_and_run(guest, plain, frame), kWidth, kHeight);
}

void expect_focus(const ImageF& found, const ImageF& expected) {
    expect_near(found, expected, 1e-4, 2e-3);
}

struct Scene {
    HostFrameTextures host = canonical_frame(kWidth, kHeight);
    HostTexture depth = two_depths(0.25f, 0.05f);
    pc_frame frame = host.frame;
    Scene() {
        frame.depth = depth;
        frame.f_stop = 0.1f;  // circles of up to 7 px
    }
};

// The first frame knows its depth; each encoding, rows from the bottom, a place at the border.
TEST(Focus, FirstFrameIsInFocus) {
    const Scene scene;
    const auto guest = instance(PC_VALIDATE);
    for (const double x : {0.2, 0.8, 1.0}) {
        const auto made = focused(x, 0.5);
        prepare(guest, made, scene.frame);
        const double w = x < 0.5 ? 0.25 : double(0.05f);
        const ImageF found = filtered(guest, made, scene.frame);
        expect_focus(found, at_distance(guest, scene.frame, w));
        EXPECT_GT(compare(found, at_distance(guest, scene.frame, 0.3 - w), 1e-3).fraction, 0.2);
    }
    pc_frame up = scene.frame;
    // The lower half, as stored, is near.
    const HostTexture distance(GL_R32F, make_image(kWidth, kHeight, 1, [](int, int y, int) {
                                   return y < kHeight / 2 ? 4 : 20;
                               }));
    up.depth = distance;
    up.depth_encoding = PC_DEPTH_LINEAR;
    up.flags &= ~uint32_t(PC_TOP_LEFT);
    const auto made = focused(0.5, 0.9);
    prepare(guest, made, up);
    expect_focus(filtered(guest, made, up), at_distance(guest, up, 0.25));
    const HostTexture output(GL_RGBA32F, kWidth, kHeight);
    pc_frame half = scene.frame;
    half.flags |= PC_HALF_RESOLUTION;
    half.output = output;
    const auto right = focused(0.8, 0.5);
    prepare(guest, right, half);
    expect_focus(filtered(guest, right, half), at_distance(guest, half, double(0.05f)));
}

// Only pixels that have a depth count, among 5 x 5.
TEST(Focus, WhatIsNoDepthDoesNotCount) {
    const Scene scene;
    const auto guest = instance();
    const auto made = focused(0.2, 0.5);
    for (const float none : {NAN, INFINITY}) {
        ImageF pixels = read(scene.depth, kWidth, kHeight, 1);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 17; x < 20; ++x) pixels.at(x, y) = none;
        const HostTexture holes(GL_R32F, pixels);
        pc_frame frame = scene.frame;
        frame.depth = holes;
        frame.flags |= PC_CAMERA_CUT;
        prepare(guest, made, frame);
        expect_focus(filtered(guest, made, frame), at_distance(guest, frame, 0.25));
    }
    // Sky alone is infinitely far, whatever was there before.
    const HostTexture sky(GL_R32F, ImageF(kWidth, kHeight, 1, NAN));
    pc_frame frame = scene.frame;
    frame.depth = sky;
    frame.flags |= PC_CAMERA_CUT;
    expect_focus(filtered(guest, made, frame), at_distance(guest, frame, 1e-9));
}

// Each pass has the depth of its own place.
TEST(Focus, OfTwoPlacesInOneChain) {
    const Scene scene;
    const auto guest = instance();
    const auto at_places = chain("depth_of_field,depth_of_field"),
               at_distances = chain("depth_of_field,depth_of_field");
    for (const uint32_t pass : {0u, 1u}) {
        ASSERT_EQ(pc_chain_set_point(at_places.get(), pass, "focus_at", pass ? 0.8 : 0.2, 0.5),
                  PC_OK);
        set(at_distances, pass, "focus_distance", pass ? 20 : 4);
    }
    for (const auto* made : {&at_places, &at_distances}) prepare(guest, *made, scene.frame);
    expect_focus(filtered(guest, at_places, scene.frame),
                 filtered(guest, at_distances, scene.frame));
}

// The median of a disc: a thin near twig at the place itself does not count.
TEST(Focus, RegionsTakeTheMedian) {
    const Scene scene;
    ImageF pixels = read(scene.depth, kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 17; x < 22; ++x) pixels.at(x, y) = 0.9f;
    const HostTexture twig(GL_R32F, pixels);
    pc_frame frame = scene.frame;
    frame.depth = twig;
    const auto guest = instance();
    const auto made = focused(0.2, 0.5);
    prepare(guest, made, frame);
    expect_focus(filtered(guest, made, frame), at_distance(guest, frame, double(0.9f)));
    frame.focus_radius = 0.25f;
    frame.flags |= PC_CAMERA_CUT;
    expect_focus(filtered(guest, made, frame), at_distance(guest, frame, 0.25));
    // Neither the corners of the square around the disc count, nor what is within a quarter of the
    // width.
    const HostTexture disc(GL_R32F, make_image(kWidth, kHeight, 1, [](int x, int y, int) {
                               return std::hypot(x - kWidth / 2, y - kHeight / 2) < 13 ? 0.25
                                                                                       : 0.05;
                           }));
    frame.depth = disc;
    const auto middle = focused(0.5, 0.5);
    prepare(guest, middle, frame);
    expect_focus(filtered(guest, middle, frame), at_distance(guest, frame, 0.25));
    // In each corner, of the frame's part of a larger texture alone.
    const HostTexture larger =
        HostTexture::inside(GL_R32F, read(scene.depth, kWidth, kHeight, 1), 128, 92, 16, 16);
    frame.depth = larger;
    frame.width = kWidth;
    frame.height = kHeight;
    for (const auto& [x, y, w] : {std::tuple(0.0, 0.0, 0.25f), {1.0, 1.0, 0.05f}}) {
        const auto corner = focused(x, y);
        prepare(guest, corner, frame);
        expect_focus(filtered(guest, corner, frame), at_distance(guest, frame, double(w)));
    }
}

// Two chains on one instance keep their own focus, and a place that is set begins anew.
TEST(Focus, EachChainHasItsOwn) {
    const Scene scene;
    const auto guest = instance();
    const auto left = focused(0.2, 0.5), right = focused(0.8, 0.5);
    pc_frame frame = scene.frame;
    frame.focus_seconds = 100;
    frame.frame_seconds = 0.01f;
    for (const auto* made : {&left, &right}) prepare(guest, *made, frame);
    for (int i = 0; i < 3; ++i) {
        expect_focus(filtered(guest, left, frame), at_distance(guest, frame, 0.25));
        expect_focus(filtered(guest, right, frame), at_distance(guest, frame, double(0.05f)));
    }
    ASSERT_EQ(pc_chain_set_point(left.get(), 0, "focus_at", 0.8, 0.5), PC_OK);
    frame.flags |= PC_CAMERA_CUT;
    expect_focus(filtered(guest, left, frame), at_distance(guest, frame, double(0.05f)));
}

// With 8 chains the focus once stood still, with 9 it jumped.
TEST(Focus, ManyChainsInTurnAreFollowed) {
    const Scene scene;
    const HostTexture other = two_depths(0.05f, 0.25f);
    for (const size_t number : {8u, 9u}) {
        const auto guest = instance();
        pc_frame frame = scene.frame;
        std::vector<pc::Chain> chains;
        for (size_t i = 0; i < number; ++i) {
            chains.push_back(focused(0.2, 0.5));
            prepare(guest, chains.back(), frame);
        }
        // Half of the way in each frame; a depth counts from the next frame on.
        frame.frame_seconds = 1;
        frame.focus_seconds = float(1 / std::log(2.0));
        for (const auto& made : chains) filtered(guest, made, frame);
        frame.depth = other;
        for (int i = 0; i < 2; ++i)
            for (const auto& made : chains) filtered(guest, made, frame);
        const double quarter = 0.05 + 0.25 * (0.25 - 0.05);
        expect_focus(filtered(guest, chains[0], frame), at_distance(guest, frame, quarter));
    }
}

// Each place goes on from the nearest place before. What was found at the others does not count.
TEST(Focus, PlacesMove) {
    guest::FollowedChains chains;
    const guest::Depths places = {{{0.1, 0.5}, 0}, {{0.9, 0.5}, 0}};
    guest::Followed& first = chains.find(7, places, 1);
    pc_frame frame = {};
    first.approach({1, 2}, frame);
    EXPECT_EQ(first.depths, (guest::Depths{{{0.1, 0.5}, 1}, {{0.9, 0.5}, 2}}));
    EXPECT_EQ(chains.find(7, places, 2).since, 1u) << "the same places";
    const guest::Depths moved = {{{0.2, 0.1}, 0}, {{0.8, 0.9}, 0}, {{0.85, 0.5}, 0}};
    const guest::Followed& then = chains.find(7, moved, 3);
    EXPECT_EQ(then.depths, (guest::Depths{{{0.2, 0.1}, 1}, {{0.8, 0.9}, 2}, {{0.85, 0.5}, 2}}));
    EXPECT_EQ(then.since, 3u);
    EXPECT_TRUE(then.known);
    // Each place covers half of the way to its own depth.
    frame.frame_seconds = 1;
    frame.focus_seconds = float(1 / std::log(2.0));
    chains.find(7, moved, 4).approach({3, 4, 1}, frame);
    for (const auto& [place, depth] : chains.find(7, moved, 5).depths)
        EXPECT_NEAR(depth, place[0] < 0.5 ? 2 : place[1] > 0.5 ? 3 : 1.5, 1e-6);
}

// A place is set while a frame with another depth is under way: what it finds is of the old place.
TEST(Focus, WhatWasFoundAtAnotherPlaceDoesNotCount) {
    const Scene scene;
    const auto guest = instance();
    const auto made = focused(0.2, 0.5);
    pc_frame frame = scene.frame;
    prepare(guest, made, frame);
    for (int i = 0; i < 2; ++i) filtered(guest, made, frame);
    const HostTexture other = two_depths(0.125f, 0.05f);
    frame.depth = other;
    filtered(guest, made, frame);
    ASSERT_EQ(pc_chain_set_point(made.get(), 0, "focus_at", 0.8, 0.5), PC_OK);
    expect_focus(filtered(guest, made, frame), at_distance(guest, frame, 0.25));
    expect_focus(filtered(guest, made, frame), at_distance(guest, frame, double(0.05f)));
}

// The chain that ran longest ago makes room for a new one.
TEST(Focus, OneMoreChainThanCanBeFollowed) {
    guest::FollowedChains chains;
    const guest::Depths places = {{{0.5, 0.5}, 0}};
    const auto most = uint64_t(guest::FollowedChains::kMost);
    const auto knows = [&](uint64_t chain) { return chains.find(chain, places, 1).known; };
    for (uint64_t chain = 1; chain <= most; ++chain) chains.find(chain, places, 1).known = true;
    EXPECT_TRUE(knows(1)) << "it ran";
    EXPECT_FALSE(knows(most + 1)) << "new";
    EXPECT_TRUE(knows(1));
    EXPECT_TRUE(knows(3));
    EXPECT_FALSE(knows(2)) << "it ran longest ago";
}

// A chain that focuses at a place is prepared like any other.
TEST(Focus, LaterFramesCreateNothing) {
    const Scene scene;
    const auto guest = instance(0, PC_STATE_LEAVE);
    const auto made = focused(0.2, 0.5);
    pc_frame frame = scene.frame;
    EXPECT_EQ(pc_run(guest.get(), made.get(), &frame, nullptr), PC_ERROR_PREPARE);
    auto needs = pc::make<pc_frame_needs>();
    EXPECT_EQ(pc_query_frame(guest.get(), made.get(), &frame, &needs), PC_OK);
    prepare(guest, made, frame);
    EXPECT_EQ(count(guest).programs, needs.programs);
    EXPECT_EQ(count(guest).texture_bytes, needs.texture_bytes);
    filtered(guest, made, frame);
    GlCalls::start();
    for (int i = 0; i < 3; ++i) {
        ++frame.frame_number;
        run(guest, made, frame);
    }
    auto calls = GlCalls::stop();
    for (const char* none : {"glFinish", "glCreateTextures", "glCreateBuffers", "glCompileShader"})
        EXPECT_EQ(calls[none], 0u) << none;
    EXPECT_GE(calls["glFenceSync"], 3u);
}

TEST(Focus, MorePlacesThanCanBeFollowed) {
    const auto guest = instance();
    const Scene scene;
    const auto made =
        chain("depth_of_field,depth_of_field,depth_of_field,depth_of_field,depth_of_field");
    for (uint32_t i = 0; i < 5; ++i)
        ASSERT_EQ(pc_chain_set_point(made.get(), i, "focus_at", 0.1 * i, 0.5), PC_OK);
    expect_error(pc_prepare(guest.get(), made.get(), &scene.frame, 1), PC_ERROR_CHAIN,
                 "focus_at: the chain has 5 places; at most 4");
    ASSERT_EQ(pc_chain_unset(made.get(), 4, "focus_at"), PC_OK);
    auto needs = pc::make<pc_frame_needs>();
    EXPECT_EQ(pc_query_frame(guest.get(), made.get(), &scene.frame, &needs), PC_OK) << pc_error();
}

}  // namespace
}  // namespace postchain::test::focus_test
