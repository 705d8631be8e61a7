// Memory of the device: textures that no frame uses any more are freed, and what a frame needs is
// known before the first one.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "tests/guest/gl_calls.h"
#include "tests/guest/host.h"

namespace postchain::test::memory_test {
namespace {

void run(const pc::Instance& guest, const pc::Chain& chain, const pc_frame& frame, int times) {
    for (int i = 0; i < times; ++i) test::run(guest, chain, frame);
}

// A shorter chain, another precision, a closed shutter, a debug view: after keep_frames (8) frames
// the memory is that of a guest that has seen nothing else.
TEST(Memory, WhatNoFrameUsesIsFreed) {
    const auto host = canonical_frame(40, 24);
    const HostTexture half(GL_RGBA16F, 40, 24);
    const auto longer = chain("motion_blur,fxaa"), shorter = chain("fxaa"), papers = paper_chain();
    pc_frame halves = host.frame, closed = host.frame, viewed = host.frame;
    halves.color = half;
    halves.flags |= PC_HALF_PLANES;
    closed.shutter_frames = -1;
    viewed.debug_view = "input.color";
    const struct {
        const char* name;
        const pc::Chain& before;
        const pc::Chain& after;
        const pc_frame& frame_after;
    } cases[] = {{"a shorter chain", longer, shorter, host.frame},
                 {"other methods", longer, papers, host.frame},
                 {"halves", papers, papers, halves},
                 {"a closed shutter", longer, longer, closed},
                 {"a debug view", longer, longer, viewed}};
    const auto settle = [](const pc::Instance& guest, const pc::Chain& made,
                           const pc_frame& frame) {
        prepare_and_run(guest, made, frame);
        run(guest, made, frame, 10);
    };
    for (const auto& one : cases) {
        SCOPED_TRACE(one.name);
        const auto guest = instance(), fresh = instance();
        settle(guest, one.before, host.frame);
        const uint64_t before = count(guest).texture_bytes;
        settle(guest, one.after, one.frame_after);
        settle(fresh, one.after, one.frame_after);
        EXPECT_EQ(count(guest).texture_bytes, count(fresh).texture_bytes);
        EXPECT_EQ(count(guest).textures_alive, count(fresh).textures_alive);
        settle(guest, one.before, host.frame);
        EXPECT_EQ(count(guest).texture_bytes, before) << "and back";
    }
}

// The plan of an earlier revision serves a later one only for frames of its size.
TEST(Memory, APlanForOtherSizesIsNotUsedForANewRevision) {
    const auto small = canonical_frame(40, 24), large = canonical_frame(80, 48);
    for (const auto* first : {&small, &large}) {
        const auto& then = first == &small ? large : small;
        const int width = then.test.description.width, height = then.test.description.height;
        const auto guest = instance(), fresh = instance();
        const auto made = chain("fxaa");
        prepare_and_run(guest, made, first->frame);
        set(made, 0, "subpix", 0.3);
        const ImageF found = read(prepare_and_run(guest, made, then.frame), width, height);
        const ImageF expected = read(prepare_and_run(fresh, made, then.frame), width, height);
        expect_equal(found, expected);
        run(guest, made, then.frame, 10);
        EXPECT_EQ(count(guest).texture_bytes, count(fresh).texture_bytes);
    }
}

// A long list of chains, each of which runs once: the plans that ran longest ago go.
TEST(Memory, PlansOfManyChainsAreNotAllKept) {
    constexpr size_t kMost = 64;
    const auto host = canonical_frame(8, 8);
    make_host_context();
    auto info = pc::create_info();
    info.keep_frames = 10 * kMost;
    const pc::Instance guest = pc::create(info);
    std::vector<pc::Chain> chains;
    gl_faults().silent_dispatches = true;
    for (size_t i = 0; i < kMost + 4; ++i) {
        chains.push_back(chain("fxaa"));
        prepare_and_run(guest, chains.back(), host.frame);
    }
    const auto plans_made_for = [&](const pc::Chain& made) {
        const uint64_t before = count(guest).plans_made;
        test::run(guest, made, host.frame);
        return count(guest).plans_made - before;
    };
    EXPECT_EQ(plans_made_for(chains[8]), 0u);
    EXPECT_EQ(plans_made_for(chains.front()), 1u) << "its plan was kept";
    EXPECT_EQ(plans_made_for(chains.back()), 0u);
    gl_faults().silent_dispatches = false;
}

// Neither textures, nor programs, buffers, queries and fences.
TEST(Memory, NoObjectOutlivesItsInstance) {
    const auto host = canonical_frame(40, 24), large = canonical_frame(80, 48);
    const auto small = chain("fxaa"), focused_chain = focused(0.5, 0.5), papers = paper_chain();
    GlCalls::start();
    {
        const auto guest = instance();
        EXPECT_EQ(pc_set_timing(guest.get(), 2), PC_OK);
        for (const auto* made : {&small, &focused_chain, &papers})
            for (const auto* frame : {&host.frame, &large.frame})
                prepare_and_run(guest, *made, *frame);
    }
    GlCalls::stop();
    EXPECT_EQ(GlCalls::objects(), 0);
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
    const struct {
        const char* passes;
        uint32_t side = 0;           // of the largest frame that is stated
        const char* view = nullptr;  // a debug view, whose programs are counted too
    } cases[] = {{"motion_blur,depth_of_field,fxaa", 100},
                 {"fxaa"},
                 {"joint_blur"},
                 {"motion_blur,fxaa", 0, "input.color"},
                 {"motion_blur,fxaa", 0, "0.motion_blur.moving_blocks"},
                 {"motion_blur,fxaa", 0, "fill"}};
    for (const auto& [passes, side, view] : cases) {
        SCOPED_TRACE(concat(passes, " ", view ? view : ""));
        const auto made = chain(passes);
        pc_frame frame = host.frame;
        frame.debug_view = view;
        auto info = pc::create_info();
        info.max_width = info.max_height = side;
        const pc::Instance guest = pc::create(info);
        auto needs = pc::make<pc_frame_needs>();
        ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &frame, &needs), PC_OK) << pc_error();
        EXPECT_EQ(needs.programs_to_compile, needs.programs);
        EXPECT_EQ(count(guest).programs, 0u);
        EXPECT_EQ(count(guest).texture_allocations, 0u);
        prepare_and_run(guest, made, frame);
        EXPECT_EQ(count(guest).texture_bytes, needs.texture_bytes);
        EXPECT_EQ(count(guest).textures_alive, needs.textures);
        EXPECT_EQ(count(guest).programs, needs.programs);
        ASSERT_EQ(pc_query_frame(guest.get(), made.get(), &frame, &needs), PC_OK);
        EXPECT_EQ(needs.programs_to_compile, 0u);
        // A budget of exactly this suffices, and one byte less keeps nothing.
        info.texture_budget = needs.texture_bytes;
        prepare_and_run(pc::create(info), made, frame);
        if (side > 0) continue;  // smaller textures would do
        --info.texture_budget;
        const pc::Instance poor = pc::create(info);
        expect_error(pc_prepare(poor.get(), made.get(), &frame, 1), PC_ERROR_MEMORY,
                     concat("the budget is ", info.texture_budget));
        EXPECT_EQ(count(poor).texture_bytes, 0u);
        EXPECT_LE(count(poor).texture_bytes_peak, info.texture_budget);
    }
}

}  // namespace
}  // namespace postchain::test::memory_test
