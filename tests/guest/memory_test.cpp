// Memory of the device: textures that no frame uses any more are freed, and what a frame needs is
// known before the first one.
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/guest/host.h"

namespace postchain::test::memory_test {
namespace {

pc_counters count(const pc::Instance& guest) {
    auto counters = pc::make<pc_counters>();
    EXPECT_EQ(pc_count(guest.get(), &counters), PC_OK);
    return counters;
}

// The textures of an instance that has seen nothing but this.
pc_counters fresh_count(const pc::Chain& chain, const pc_frame& frame) {
    const auto guest = instance();
    prepare_and_run(guest, chain, frame);
    return count(guest);
}

void run(const pc::Instance& guest, const pc::Chain& chain, const pc_frame& frame, int times) {
    for (int i = 0; i < times; ++i)
        ASSERT_EQ(pc_run(guest.get(), chain.get(), &frame, nullptr), PC_OK) << pc_error();
}

// A shorter chain, another precision, a closed shutter, a debug view: after keep_frames (8) frames
// the memory is that of a guest that has seen nothing else.
TEST(Memory, WhatNoFrameUsesIsFreed) {
    const auto host = canonical_frame(64, 48);
    const HostTexture half(GL_RGBA16F, 64, 48);
    const auto longer = chain("motion_blur,depth_of_field,fxaa"), shorter = chain("fxaa"),
               papers = paper_chain();
    pc_frame halves = host.frame, closed = host.frame, viewed = host.frame;
    halves.color = half;
    halves.flags |= PC_HALF_PLANES;
    closed.shutter_frames = -1;
    viewed.debug_view = "input.color";
    const struct {
        const char* name;
        const pc::Chain& before;
        const pc_frame& frame_before;
        const pc::Chain& after;
        const pc_frame& frame_after;
    } cases[] = {{"a shorter chain", longer, host.frame, shorter, host.frame},
                 {"other methods", longer, host.frame, papers, host.frame},
                 {"halves", papers, host.frame, papers, halves},
                 {"a closed shutter", longer, host.frame, longer, closed},
                 {"a debug view", longer, host.frame, longer, viewed}};
    for (const auto& one : cases) {
        const auto guest = instance();
        prepare_and_run(guest, one.before, one.frame_before);
        run(guest, one.before, one.frame_before, 12);
        prepare_and_run(guest, one.after, one.frame_after);
        run(guest, one.after, one.frame_after, 12);
        const auto fresh = instance();
        prepare_and_run(fresh, one.after, one.frame_after);
        run(fresh, one.after, one.frame_after, 12);
        EXPECT_EQ(count(guest).texture_bytes, count(fresh).texture_bytes) << one.name;
        EXPECT_EQ(count(guest).textures_alive, count(fresh).textures_alive) << one.name;
        // And back.
        prepare_and_run(guest, one.before, one.frame_before);
        run(guest, one.before, one.frame_before, 12);
        EXPECT_EQ(count(guest).texture_bytes,
                  fresh_count(one.before, one.frame_before).texture_bytes)
            << one.name;
    }
}

// Two views in turn: neither is freed, and none is made again.
TEST(Memory, ViewsInTurnKeepTheirTextures) {
    const auto host = canonical_frame(64, 48), small = canonical_frame(32, 24);
    const auto guest = instance();
    const auto main = chain("motion_blur,fxaa"), mirror = chain("fxaa");
    prepare_and_run(guest, main, host.frame);
    prepare_and_run(guest, mirror, small.frame);
    const uint64_t made = count(guest).texture_allocations;
    for (int i = 0; i < 20; ++i) {
        run(guest, main, host.frame, 1);
        run(guest, mirror, small.frame, 1);
    }
    EXPECT_EQ(count(guest).texture_allocations, made);
}

// The figures before the first frame are those after it.
TEST(Memory, AFramesNeedsAreKnownBefore) {
    const auto host = canonical_frame(64, 48);
    make_host_context();
    for (const char* passes : {"motion_blur,depth_of_field,fxaa", "fxaa", "joint_blur,fxaa"}) {
        const auto made = chain(passes);
        for (const bool stated : {false, true}) {
            auto info = pc::create_info();
            if (stated) info.max_width = info.max_height = 100;
            const pc::Instance guest = pc::create(info);
            auto needs = pc::make<pc_frame_needs>();
            ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &host.frame, &needs), PC_OK)
                << pc_error();
            EXPECT_EQ(needs.programs_to_compile, needs.programs);
            EXPECT_EQ(count(guest).programs, 0u);
            EXPECT_EQ(count(guest).texture_allocations, 0u);
            prepare_and_run(guest, made, host.frame);
            EXPECT_EQ(count(guest).texture_bytes, needs.texture_bytes) << passes;
            EXPECT_EQ(count(guest).textures_alive, needs.textures) << passes;
            EXPECT_EQ(count(guest).programs, needs.programs) << passes;
            ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &host.frame, &needs), PC_OK);
            EXPECT_EQ(needs.programs_to_compile, 0u);
            // A budget of exactly this suffices.
            info.texture_budget = needs.texture_bytes;
            const pc::Instance tight = pc::create(info);
            prepare_and_run(tight, made, host.frame);
        }
    }
}

// The programs of a debug view are counted too.
TEST(Memory, ADebugViewsProgramsAreKnownBefore) {
    const auto host = canonical_frame(64, 48);
    const auto made = chain("motion_blur,fxaa");
    for (const char* view : {"input.color", "0.motion_blur.moving_blocks", "fill"}) {
        const auto guest = instance();
        pc_frame frame = host.frame;
        frame.debug_view = view;
        auto needs = pc::make<pc_frame_needs>();
        ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &frame, &needs), PC_OK) << pc_error();
        prepare_and_run(guest, made, frame);
        EXPECT_EQ(count(guest).programs, needs.programs) << view;
        ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &frame, &needs), PC_OK);
        EXPECT_EQ(needs.programs_to_compile, 0u) << view;
    }
}

// The textures of a frame that does not fit are freed at once.
TEST(Memory, ARefusedFrameKeepsNothing) {
    const auto host = canonical_frame(64, 48);
    const auto made = chain("motion_blur,depth_of_field,fxaa");
    auto needs = pc::make<pc_frame_needs>();
    ASSERT_EQ(pc_query_frame(instance().get(), made.get(), &host.frame, &needs), PC_OK);
    auto info = pc::create_info();
    info.texture_budget = needs.texture_bytes - 1;
    const pc::Instance guest = pc::create(info);
    EXPECT_EQ(pc_prepare(guest.get(), made.get(), &host.frame, 1), PC_ERROR_MEMORY);
    EXPECT_GT(count(guest).texture_allocations, 1u);
    EXPECT_EQ(count(guest).texture_bytes, 0u);
}

}  // namespace
}  // namespace postchain::test::memory_test
