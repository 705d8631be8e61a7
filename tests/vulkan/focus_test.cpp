// Focus at a place of the frame: its depth is found on the device, and known when its run is over.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "chain/vk/device.h"
#include "tests/support/images.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::focus_test {
namespace {

constexpr int kWidth = 48, kHeight = 30;
// Their inverses are exact, and so are the bits of both ways to focus.
constexpr float kNear = 0.25f, kFar = 0.0625f;

ImageF two_depths(float left, float right) {
    return make_image(kWidth, kHeight, 1,
                      [&](int x, int, int) { return x < kWidth / 2 ? left : right; });
}

struct Scene {
    HostFrameTextures canonical = canonical_frame(kWidth, kHeight);
    VkFrame frame{canonical.test.planes, canonical.frame};
    pc_frame& values = frame.frame;

    explicit Scene(float left = kNear, float right = kFar) {
        frame.depth.write(two_depths(left, right));
        values.f_stop = 0.1f;  // circles of up to 3.5 px
        values.focus_distance = 0;
    }
};

VkInstanceOfChain instance_of(uint32_t runs_in_flight, uint32_t flags = 0) {
    pc_vk_create_info info = vk_info(kWidth, kHeight);
    info.runs_in_flight = runs_in_flight;
    info.flags = flags;
    return vk_instance(info);
}

ImageF next(const VkInstanceOfChain& vulkan, const pc::Chain& made, Scene& scene) {
    EXPECT_EQ(run(vulkan, made, scene.frame.vk), PC_OK) << pc_error();
    return scene.frame.output.read();
}

// The frame with a lens that is set to this depth.
ImageF at_depth(Scene& scene, double inverse_depth) {
    static const pc::Chain plain = chain("depth_of_field");
    static const VkInstanceOfChain vulkan = vk_instance(kWidth, kHeight);
    set(plain, 0, "focus_distance", inverse_depth == 0 ? 1e30 : 1 / inverse_depth);
    return filtered(vulkan, plain, scene.frame);
}

void expect_focus(const VkInstanceOfChain& vulkan, const pc::Chain& made, Scene& scene,
                  double inverse_depth, const std::string& what) {
    const ImageF found = next(vulkan, made, scene);
    EXPECT_TRUE(equal_bits(found, at_depth(scene, inverse_depth))) << what;
}

// A scene, and a chain that follows its left half, prepared.
struct Shot : Scene {
    VkInstanceOfChain vulkan;
    pc::Chain made = focused(0.2, 0.5);

    explicit Shot(uint32_t runs_in_flight) : vulkan(instance_of(runs_in_flight)) {
        prepare(vulkan, made, frame.vk);
    }
    ImageF next() { return focus_test::next(vulkan, made, *this); }
    void expect_focus(double inverse_depth, const std::string& what) {
        focus_test::expect_focus(vulkan, made, *this, inverse_depth, what);
    }
    // Up to the rounding of a focus that is pulled.
    void expect_near_focus(double inverse_depth) {
        const ImageF found = next();
        expect_near(found, at_depth(*this, inverse_depth), 1e-4, 2e-3);
    }
};

// Infinitely far until the first depth is known, which is that of `runs_in_flight` runs before.
TEST(Focus, TheDepthIsKnownWhenItsRunIsOver) {
    Scene scene;
    EXPECT_FALSE(equal_bits(at_depth(scene, double(kNear)), at_depth(scene, double(kFar))));
    EXPECT_FALSE(equal_bits(at_depth(scene, double(kFar)), at_depth(scene, 0)));
    for (const uint32_t runs : {1u, 2u, 3u})
        for (const double x : {0.2, 1.0}) {
            const auto vulkan = instance_of(runs, PC_VALIDATE);
            const auto made = focused(x, 0.5);
            scene.frame.depth.write(two_depths(kNear, kFar));
            prepare(vulkan, made, scene.frame.vk);
            const auto depth = double(x < 0.5 ? kNear : kFar);
            for (uint32_t i = 0; i < 2 * runs + 2; ++i) {
                if (i == runs + 1) scene.frame.depth.write(two_depths(kFar, kNear));
                const double expected = i < runs           ? 0
                                        : i < 2 * runs + 1 ? depth
                                                           : double(kNear + kFar) - depth;
                expect_focus(vulkan, made, scene, expected, concat(runs, " runs, frame ", i));
            }
        }
}

// At first and after a cut, the distance of the frame or of the chain's camera.
TEST(Focus, ADistanceHoldsUntilADepthIsKnown) {
    Shot shot(2);
    shot.values.focus_distance = 8;
    for (int i = 0; i < 3; ++i)
        shot.expect_focus(i < 2 ? 0.125 : double(kNear), concat("frame ", i));
    set(shot.made, PC_CAMERA, "focus_distance", 2);
    prepare(shot.vulkan, shot.made, shot.frame.vk);
    for (int i = 0; i < 3; ++i) {
        shot.values.flags = i == 0 ? PC_CAMERA_CUT : 0;
        shot.expect_focus(i < 2 ? 0.5 : double(kNear), concat("after a cut, ", i));
    }
}

// After a change of depth, focus covers 1 - exp(-t/T) of the way in each frame, and all of it when
// the depth after a cut arrives. Until then it stays.
TEST(Focus, FollowsOverTime) {
    Shot shot(2);
    shot.values.focus_seconds = 0.5f;
    shot.values.frame_seconds = 0.1f;
    for (int i = 0; i < 2; ++i) shot.next();
    shot.frame.depth.write(two_depths(kFar, kFar));
    for (int i = 0; i < 2; ++i) shot.expect_focus(double(kNear), concat("before, ", i));
    const double step = std::exp(-double(0.1f) / 0.5);
    double pulled = 0;
    for (int i = 1; i <= 5; ++i) {
        pulled = double(kFar) + double(kNear - kFar) * std::pow(step, i);
        shot.expect_near_focus(pulled);
    }
    shot.frame.depth.write(two_depths(kNear, kNear));
    for (int i = 0; i < 3; ++i) {
        shot.values.flags = i == 0 ? PC_CAMERA_CUT : 0;
        shot.expect_near_focus(i < 2 ? pulled : double(kNear));
    }
}

// From the depth before. What was found at the other place in runs in flight does not count.
TEST(Focus, IsPulledToAnotherPlace) {
    Shot shot(2);
    shot.values.frame_seconds = 1;
    shot.values.focus_seconds = float(1 / std::log(2.0));
    for (int i = 0; i < 3; ++i) shot.next();
    shot.frame.depth.write(two_depths(0.125f, kFar));
    shot.next();
    ASSERT_EQ(pc_chain_set_point(shot.made.get(), 0, "focus_at", 0.8, 0.5), PC_OK) << pc_error();
    for (int i = 0; i < 4; ++i) {
        const double way = i < 2 ? 1 : std::pow(0.5, i - 1);
        shot.expect_near_focus(double(kFar) + double(kNear - kFar) * way);
    }
}

// Depth in another encoding, with rows from the bottom; the median of a disc, without a thin near
// twig at the place itself.
TEST(Focus, ReadsTheHostsDepth) {
    Scene scene;
    const auto vulkan = instance_of(1);
    const auto made = focused(0.2, 0.9);
    scene.values.depth_encoding = PC_DEPTH_LINEAR;
    scene.values.flags |= PC_BOTTOM_LEFT;
    ImageF distance = make_image(kWidth, kHeight, 1,
                                 [](int, int y, int) { return y < kHeight / 2 ? 4.0f : 16.0f; });
    for (int y = 0; y < kHeight; ++y)
        for (int x = kWidth / 5 - 2; x < kWidth / 5 + 3; ++x) distance.at(x, y) = 2;
    scene.frame.depth.write(distance);
    prepare(vulkan, made, scene.frame.vk);
    next(vulkan, made, scene);
    scene.values.focus_radius = 0.25f;
    expect_focus(vulkan, made, scene, 0.5, "5 x 5 pixels");
    expect_focus(vulkan, made, scene, 0.25, "a disc");
}

TEST(Focus, AsManyPlacesAsCanBeFollowed) {
    Scene scene;
    ImageF depth = two_depths(kNear, kNear);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) depth.at(x, y) = 1.0f / float(2 << (4 * x / kWidth));
    scene.frame.depth.write(depth);
    const auto vulkan = instance_of(1);
    const auto four = chain("depth_of_field,depth_of_field,depth_of_field,depth_of_field");
    const auto plain = chain("depth_of_field,depth_of_field,depth_of_field,depth_of_field");
    for (uint32_t i = 0; i < 4; ++i) {
        ASSERT_EQ(pc_chain_set_point(four.get(), i, "focus_at", 0.875 - 0.25 * i, 0.5), PC_OK);
        set(plain, i, "focus_distance", 2 << (3 - i));
    }
    prepare(vulkan, four, scene.frame.vk);
    next(vulkan, four, scene);
    const ImageF found = next(vulkan, four, scene);
    EXPECT_TRUE(equal_bits(found, filtered(vulkan, plain, scene.frame)));

    const auto five =
        chain("depth_of_field,depth_of_field,depth_of_field,depth_of_field,depth_of_field");
    for (uint32_t i = 0; i < 5; ++i)
        ASSERT_EQ(pc_chain_set_point(five.get(), i, "focus_at", 0.1 * i, 0.5), PC_OK);
    expect_error(pc_vk_prepare(vulkan.get(), five.get(), &scene.frame.vk, 1), PC_ERROR_CHAIN,
                 "focus_at: the chain has 5 places");
}

// Two chains in turn, and one that focuses nowhere, on one instance.
TEST(Focus, EachChainHasItsOwn) {
    Scene scene;
    const auto vulkan = instance_of(2);
    const auto left = focused(0.2, 0.5), right = focused(0.8, 0.5), other = chain("fxaa");
    for (const auto* made : {&left, &right, &other}) prepare(vulkan, *made, scene.frame.vk);
    for (int i = 0; i < 3; ++i) {
        expect_focus(vulkan, left, scene, i == 0 ? 0 : double(kNear), concat("left, ", i));
        expect_focus(vulkan, right, scene, i == 0 ? 0 : double(kFar), concat("right, ", i));
        next(vulkan, other, scene);
    }
}

// A recorded run that is never submitted found nothing; the others in flight are forgotten too.
TEST(Focus, GivenUpRunsFindNothing) {
    Shot shot(2);
    for (const float depth : {kNear, kNear, 0.125f, kFar}) {
        shot.frame.depth.write(two_depths(depth, kNear));
        shot.next();
    }
    const VkCommandBuffer never = Vulkan::get().begin();
    EXPECT_EQ(pc_vk_run(shot.vulkan.get(), shot.made.get(), &shot.frame.vk, never), PC_OK);
    vkEndCommandBuffer(never);
    EXPECT_EQ(pc_vk_give_up(shot.vulkan.get()), PC_OK);
    shot.frame.depth.write(two_depths(kNear, kNear));
    for (int i = 0; i < 3; ++i) shot.expect_focus(i < 2 ? 0.125 : double(kNear), concat("run ", i));
}

// All runs in flight are recorded before the first is submitted: each finds the depth of its frame.
TEST(Focus, RunsInFlightKeepTheirPlaces) {
    constexpr int kRuns = 3;
    const auto vulkan = instance_of(kRuns);
    const auto made = focused(0.2, 0.5);
    std::vector<std::unique_ptr<Scene>> scenes;
    for (int i = 0; i < kRuns; ++i)
        scenes.push_back(std::make_unique<Scene>(1.0f / float(4 << i), kNear));
    prepare(vulkan, made, scenes[0]->frame.vk);
    for (int round = 0; round < 2; ++round) {
        std::vector<VkCommandBuffer> commands;
        std::vector<VkFence> fences;
        for (const auto& scene : scenes) {
            commands.push_back(Vulkan::get().begin());
            full_barrier(commands.back());
            EXPECT_EQ(pc_vk_run(vulkan.get(), made.get(), &scene->frame.vk, commands.back()),
                      PC_OK);
        }
        for (const VkCommandBuffer one : commands) fences.push_back(Vulkan::get().submit(one));
        for (size_t i = 0; i < fences.size(); ++i) Vulkan::get().wait_for(fences[i], commands[i]);
    }
    for (int i = 0; i < kRuns; ++i) {
        const ImageF found = scenes[size_t(i)]->frame.output.read();
        EXPECT_TRUE(equal_bits(found, at_depth(*scenes[size_t(i)], 1.0 / (4 << i)))) << i;
    }
}

// In two phases the step is one of the dispatches, and its buffer one of the resources.
TEST(Focus, IsADispatchOfItsOwn) {
    Shot shot(1);
    for (int i = 0; i < 2; ++i) {
        int found = 0;
        auto steps = pc::make<pc_vk_steps>();
        Vulkan::get().run([&](VkCommandBuffer commands) {
            full_barrier(commands);
            ASSERT_EQ(pc_vk_begin(shot.vulkan.get(), shot.made.get(), &shot.frame.vk, &steps),
                      PC_OK);
            for (uint32_t d = 0; d < steps.dispatch_count; ++d) {
                EXPECT_EQ(pc_vk_record(shot.vulkan.get(), d, commands), PC_OK) << pc_error();
                full_barrier(commands);
                const pc_vk_dispatch& dispatch = steps.dispatches[d];
                for (uint32_t u = 0; u < dispatch.use_count; ++u) {
                    const pc_vk_use& use = dispatch.uses[u];
                    const pc_vk_resource& resource = steps.resources[use.resource];
                    if (std::strcmp(resource.name, "focus.depths") != 0) continue;
                    EXPECT_STREQ(dispatch.name, "focus.depths");
                    EXPECT_TRUE(resource.buffer && !resource.image && !resource.view);
                    EXPECT_EQ(use.stages,
                              VkPipelineStageFlags(VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT));
                    EXPECT_TRUE(use.access & VK_ACCESS_SHADER_WRITE_BIT);
                    ++found;
                }
            }
        });
        EXPECT_EQ(found, 1);
    }
    EXPECT_TRUE(equal_bits(shot.frame.output.read(), at_depth(shot, double(kNear))));
}

// Also if the chain changes nothing, into color itself.
TEST(Focus, IsFollowedWhileTheLensIsClosed) {
    Shot shot(1);
    pc_vk_frame closed = shot.frame.vk;
    pc_frame values = shot.values;
    values.f_stop = 1e6f;
    values.nearest = 1;
    closed.values = &values;
    closed.output = closed.color;
    prepare(shot.vulkan, shot.made, closed);
    EXPECT_EQ(run(shot.vulkan, shot.made, closed), PC_OK) << pc_error();
    shot.expect_focus(double(kNear), "open");
}

TEST(Focus, LaterFramesMakeNothing) {
    Scene scene;
    const auto vulkan = instance_of(2);
    const auto made = focused(0.2, 0.5);
    EXPECT_EQ(run(vulkan, made, scene.frame.vk), PC_ERROR_PREPARE);
    auto needs = pc::make<pc_frame_needs>();
    EXPECT_EQ(pc_vk_query_frame(vulkan.get(), made.get(), &scene.frame.vk, &needs), PC_OK);
    prepare(vulkan, made, scene.frame.vk);
    const pc_counters before = count(vulkan);
    EXPECT_EQ(before.programs, needs.programs);
    EXPECT_EQ(before.texture_bytes, needs.texture_bytes);
    for (int i = 0; i < 5; ++i) {
        scene.frame.depth.write(two_depths(kNear / float(i + 1), kFar));
        next(vulkan, made, scene);
    }
    expect_nothing_made(before, count(vulkan));
}

}  // namespace
}  // namespace postchain::test::focus_test
