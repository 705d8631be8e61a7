// Frames in flight: what one run uses, no other changes before it is over.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "chain/plan/bands.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::flight_test {
namespace {

constexpr int kWidth = 80, kHeight = 48;

// A run that is recorded, and may be submitted.
struct Flight {
    std::unique_ptr<VkFrame> frame;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    ImageF expected;

    void record(const VkInstanceOfChain& instance, const pc::Chain& chain) {
        commands = Vulkan::get().begin();
        full_barrier(commands);
        EXPECT_EQ(pc_vk_run(instance.get(), chain.get(), &frame->vk, commands), PC_OK)
            << pc_error();
    }
    void submit() { fence = Vulkan::get().submit(commands); }
    void finish(const char* what) {
        Vulkan::get().wait_for(fence, commands);
        EXPECT_TRUE(equal_bits(frame->output.read(), expected)) << what;
    }
};

// All runs in flight are recorded before the first is submitted: each has to have its own values
// and images.
TEST(Flight, RunsInFlightKeepTheirValues) {
    constexpr uint32_t kRuns = 3, kFrames = 12;
    const auto made = paper_chain();
    auto info = vk_info(kWidth, kHeight);
    info.runs_in_flight = kRuns;
    const auto vulkan = vk_instance(info), alone = vk_instance(kWidth, kHeight);
    std::vector<Flight> flights(kFrames);
    for (uint32_t i = 0; i < kFrames; ++i) {
        flights[i].frame = random_frame(kWidth, kHeight, i);
        flights[i].expected = filtered(alone, made, *flights[i].frame);
        flights[i].frame->output.write(
            ImageF(flights[i].expected.width, flights[i].expected.height, 4, 0.5f));
    }
    prepare(vulkan, made, flights[0].frame->vk);
    for (uint32_t first = 0; first < kFrames; first += kRuns) {
        for (uint32_t i = first; i < first + kRuns; ++i) flights[i].record(vulkan, made);
        for (uint32_t i = first; i < first + kRuns; ++i) flights[i].submit();
        for (uint32_t i = first; i < first + kRuns; ++i) flights[i].finish("all at once");
    }
    // As a host does: it waits for the frame before the last two.
    for (uint32_t i = 0; i < kFrames + kRuns; ++i) {
        if (i >= kRuns) flights[i - kRuns].finish("one after another");
        if (i >= kFrames) continue;
        flights[i].record(vulkan, made);
        flights[i].submit();
    }
    EXPECT_EQ(count(vulkan).frames, 2 * kFrames);
}

// Two eyes: two runs in one command buffer, with the same images of the library.
TEST(Flight, RunsOfOneCommandBufferWaitForEachOther) {
    const auto made = paper_chain();
    const auto vulkan = vk_instance(kWidth, kHeight), alone = vk_instance(kWidth, kHeight);
    std::unique_ptr<VkFrame> eyes[] = {random_frame(kWidth, kHeight, 6),
                                       random_frame(kWidth, kHeight, 7)};
    ImageF expected[2];
    for (int i = 0; i < 2; ++i) {
        expected[i] = filtered(alone, made, *eyes[i]);
        eyes[i]->output.write(ImageF(expected[i].width, expected[i].height, 4, 0.5f));
        prepare(vulkan, made, eyes[i]->vk);
    }
    Vulkan::get().run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        for (const auto& eye : eyes)
            EXPECT_EQ(pc_vk_run(vulkan.get(), made.get(), &eye->vk, commands), PC_OK);
    });
    for (int i = 0; i < 2; ++i) EXPECT_TRUE(equal_bits(eyes[i]->output.read(), expected[i])) << i;
}

// A budget for one chain alone: the plan and the images of the other are given up while its run is
// recorded, and live until it is over. Destroyed before, they end the process.
TEST(Flight, WhatIsGivenUpLivesUntilItsRunIsOver) {
    const auto first = paper_chain(), second = chain("motion_blur");
    Flight flights[2];
    const auto alone = vk_instance(kWidth, kHeight);
    uint64_t needed = 0;
    for (int i = 0; i < 2; ++i) {
        const pc::Chain& of = i == 0 ? first : second;
        flights[i].frame = random_frame(kWidth, kHeight, uint32_t(1 + i));
        flights[i].expected = filtered(alone, of, *flights[i].frame);
        auto needs = pc::make<pc_frame_needs>();
        EXPECT_EQ(pc_vk_query_frame(alone.get(), of.get(), &flights[i].frame->vk, &needs), PC_OK);
        needed = std::max(needed, needs.texture_bytes);
        EXPECT_EQ(needs.programs_to_compile, 0u);
    }
    auto info = vk_info(kWidth, kHeight);
    info.texture_budget = needed;
    const auto vulkan = vk_instance(info);
    for (int round = 0; round < 3; ++round) {
        for (int i = 0; i < 2; ++i) {
            prepare(vulkan, i == 0 ? first : second, flights[i].frame->vk);
            flights[i].record(vulkan, i == 0 ? first : second);
        }
        for (Flight& flight : flights) flight.submit();
        for (Flight& flight : flights) flight.finish("given up");
    }
    EXPECT_LE(count(vulkan).texture_bytes_peak, needed);
    EXPECT_GT(count(vulkan).texture_allocations, count(alone).texture_allocations);
    info.texture_budget = 1000;
    const auto poor = vk_instance(info);
    expect_error(pc_vk_prepare(poor.get(), first.get(), &flights[0].frame->vk, 1), PC_ERROR_MEMORY,
                 "the budget is 1000");
}

// The part of larger images has the bits of a render in images of its size.
TEST(Flight, DynamicResolutionChangesNoBit) {
    const auto made = paper_chain();
    const auto vulkan = vk_instance(kWidth, kHeight);
    for (const auto& [width, height] : {std::pair(1, 1), {17, 33}}) {
        const auto canonical = canonical_frame(width, height, uint32_t(width + height));
        VkFrame frame(canonical.test.planes, canonical.frame);
        const ImageF found = filtered(vulkan, made, frame);
        frame.output.write(ImageF(width, height, 4, 0.5f));
        const auto tight = vk_instance(uint32_t(width), uint32_t(height));
        expect_equal(filtered(tight, made, frame), found);
    }
}

// A parameter that costs values makes nothing; the images of a chain that is not used are given up.
TEST(Flight, ParametersAndUnusedImages) {
    const auto made = chain("motion_blur,depth_of_field");
    auto info = vk_info(kWidth, kHeight);
    info.keep_frames = 3;
    const auto vulkan = vk_instance(info);
    const auto frame = random_frame(kWidth, kHeight, 3);
    prepare(vulkan, made, frame->vk);
    EXPECT_EQ(run(vulkan, made, frame->vk), PC_OK);
    const pc_counters before = count(vulkan);
    for (int i = 0; i < 6; ++i) {
        set(made, 0, "samples", 9 + 2 * i);
        EXPECT_EQ(run(vulkan, made, frame->vk), PC_OK) << pc_error();
    }
    EXPECT_EQ(count(vulkan).texture_allocations, before.texture_allocations);
    EXPECT_GT(count(vulkan).plans_made, before.plans_made);
    const auto shorter = chain("fxaa");
    prepare(vulkan, shorter, frame->vk);
    // Fewer than are kept without keep_frames.
    for (int i = 0; i < 7; ++i) EXPECT_EQ(run(vulkan, shorter, frame->vk), PC_OK) << pc_error();
    EXPECT_LT(count(vulkan).textures_alive, before.textures_alive);
    EXPECT_LT(count(vulkan).texture_bytes, before.texture_bytes);
}

// A step of a large frame that writes the texture it reads is cut into bands: the layers find no
// hazard.
TEST(Flight, BandsOfOneStepWaitForEachOther) {
    const int width = 1920, height = 1080;
    auto canonical = canonical_frame(width, height);
    // Bands are of what a step may fetch. What it does fetch of a still frame in focus is little.
    std::ranges::fill(canonical.test.planes.at(Role::motion).data, 0);
    std::ranges::fill(canonical.test.planes.at(Role::inverse_depth).data,
                      float(1 / *canonical.test.description.camera.focus_distance));
    VkFrame frame(canonical.test.planes, canonical.frame);
    const auto vulkan = vk_instance(uint32_t(width), uint32_t(height));
    const auto made = chain("joint_blur");
    set(made, 0, "samples", 8);
    filtered(vulkan, made, frame);
}

// Dispatches with more fetches than a band has: of the whole plane, and by a list longer than a row
// of its launch, with other launches after it. A group of its gather has 127 x 4 and more fetches a
// pixel.
TEST(Flight, LongDispatchesAreCutIntoBands) {
    const auto made = chain("depth_of_field,depth_of_field");
    set(made, 0, "samples", 127);
    set(made, 1, "samples", 5);
    const int width = 3136, height = 16;
    ASSERT_GT(width * height * 127.0 * 8, kBandTaps);
    const auto canonical = canonical_frame(width, height);
    const auto guest = instance();
    const ImageF expected = read(prepare_and_run(guest, made, canonical.frame), width, height);
    VkFrame frame(canonical.test.planes, canonical.frame);
    const auto vulkan = vk_instance(uint32_t(width), uint32_t(height));
    for (const uint32_t flags : {0u, uint32_t(PC_NO_ELISION)}) {
        frame.frame.flags |= flags;
        expect_as_gl(filtered(vulkan, made, frame), expected);
    }
}

}  // namespace
}  // namespace postchain::test::flight_test
