// A frame in two phases, whose barriers are the host's, and times of steps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "chain/vk/device.h"
#include "tests/support/transcript.h"
#include "tests/vulkan/frames.h"

namespace postchain::test::steps_test {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 80, kHeight = 48;
constexpr VkAccessFlags kWrites = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;

using Handle = std::array<uint64_t, 3>;
Handle handle_of(const pc_vk_resource& resource) {
    return {vk::number_of(resource.image), vk::number_of(resource.buffer),
            vk::number_of(resource.view)};
}

bool conflict(VkAccessFlags a, VkAccessFlags b) {
    return ((a | b) & kWrites) != 0;
}

// Every stage in which commands of the chain have such an access.
VkPipelineStageFlags stages_of(VkAccessFlags access) {
    VkPipelineStageFlags stages = 0;
    if (access & (VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT))
        stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    if (access & VK_ACCESS_INDIRECT_COMMAND_READ_BIT) stages |= VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
    if (access & VK_ACCESS_TRANSFER_WRITE_BIT) stages |= VK_PIPELINE_STAGE_TRANSFER_BIT;
    return stages;
}

// A render graph: it knows the uses of each resource since its last barrier, over all runs.
class Graph {
  public:
    // Records a frame, with a barrier only where a use conflicts with an earlier one.
    void record(const VkInstanceOfChain& vulkan, const pc_vk_steps& steps,
                VkCommandBuffer commands) {
        for (uint32_t d = 0; d < steps.dispatch_count; ++d) {
            const pc_vk_dispatch& dispatch = steps.dispatches[d];
            bool waits = false;
            for (uint32_t u = 0; u < dispatch.use_count; ++u) {
                const pc_vk_use& use = dispatch.uses[u];
                const auto before = since_.find(handle_of(steps.resources[use.resource]));
                waits |= before != since_.end() && conflict(before->second.access, use.access);
            }
            if (waits && places_barriers) barrier(commands);
            for (uint32_t u = 0; u < dispatch.use_count; ++u) {
                const pc_vk_use& use = dispatch.uses[u];
                auto& since = since_[handle_of(steps.resources[use.resource])];
                since.stages |= use.stages;
                since.access |= use.access;
            }
            EXPECT_EQ(pc_vk_record(vulkan.get(), d, commands), PC_OK) << pc_error();
        }
    }
    bool places_barriers = true;
    int barriers = 0;

  private:
    struct Since {
        VkPipelineStageFlags stages = 0;
        VkAccessFlags access = 0;
    };
    void barrier(VkCommandBuffer commands) {
        constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT |
                                              VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT |
                                              VK_PIPELINE_STAGE_TRANSFER_BIT;
        auto one = vk::info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
        for (const auto& [handle, since] : since_) one.srcAccessMask |= since.access & kWrites;
        one.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                            VK_ACCESS_INDIRECT_COMMAND_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
        vkCmdPipelineBarrier(commands, kAll, kAll, 0, 1, &one, 0, nullptr, 0, nullptr);
        since_.clear();
        ++barriers;
    }
    std::map<Handle, Since> since_;
};

struct Subject {
    pc::Chain chain;
    VkInstanceOfChain vulkan = vk_instance(kWidth, kHeight);
    HostFrameTextures canonical = canonical_frame(kWidth, kHeight);
    VkFrame frame{canonical.test.planes, canonical.frame};

    explicit Subject(const char* passes) : chain(test::chain(passes)) {
        prepare(vulkan, chain, frame.vk);
    }
    pc_vk_steps begin() {
        auto steps = pc::make<pc_vk_steps>();
        EXPECT_EQ(pc_vk_begin(vulkan.get(), chain.get(), &frame.vk, &steps), PC_OK) << pc_error();
        return steps;
    }
};

TEST(Steps, TheHostSetsTheBarriers) {
    for (const char* passes : {"motion_blur,fxaa,depth_of_field", "joint_blur"}) {
        Subject subject(passes);
        const ImageF expected = filtered(subject.vulkan, subject.chain, subject.frame);
        subject.frame.output.write(ImageF(kWidth, kHeight, 4, 0.5f));
        Graph graph;
        for (int i = 0; i < 3; ++i)
            Vulkan::get().run([&](VkCommandBuffer commands) {
                full_barrier(commands);
                graph.record(subject.vulkan, subject.begin(), commands);
            });
        EXPECT_TRUE(equal_bits(subject.frame.output.read(), expected)) << passes;
        EXPECT_GT(graph.barriers, 3);
    }
}

// The layers see a missing barrier: the uses that are listed are those of the commands.
TEST(Steps, WithoutBarriersTheLayersComplain) {
    Subject subject("motion_blur");
    Graph graph;
    graph.places_barriers = false;
    Vulkan::get().run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        graph.record(subject.vulkan, subject.begin(), commands);
    });
    auto& messages = Vulkan::get().messages;
    ASSERT_FALSE(messages.empty());
    EXPECT_THAT(messages[0], HasSubstr("SYNC-HAZARD"));
    messages.clear();
}

// Every member, of two runs: the images are made in the first one.
TEST(Steps, EveryMember) {
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/vulkan/expected");
    Subject subject("fxaa");
    ASSERT_EQ(pc_chain_set_text(subject.chain.get(), 0, "mode", "search"), PC_OK) << pc_error();
    prepare(subject.vulkan, subject.chain, subject.frame.vk);
    for (int i = 0; i < 2; ++i)
        Vulkan::get().run([&](VkCommandBuffer commands) {
            const pc_vk_steps steps = subject.begin();
            for (uint32_t r = 0; r < steps.resource_count; ++r) {
                const pc_vk_resource& one = steps.resources[r];
                Transcript::say(concat("resource ", r, " ", one.name, one.image ? ", image" : "",
                                       one.buffer ? ", buffer" : "", one.view ? ", view" : ""));
            }
            for (uint32_t d = 0; d < steps.dispatch_count; ++d) {
                const pc_vk_dispatch& one = steps.dispatches[d];
                Transcript::say(concat("dispatch ", d, " ", one.name, ", level ", one.level));
                for (uint32_t u = 0; u < one.use_count; ++u)
                    Transcript::say(concat("  uses ", one.uses[u].resource, ", stages ",
                                           one.uses[u].stages, ", access ", one.uses[u].access));
            }
            Graph().record(subject.vulkan, steps, commands);
        });
    auto counters = pc::make<pc_counters>();
    ASSERT_EQ(pc_vk_count(subject.vulkan.get(), &counters), PC_OK);
    counters.programs_loaded = 0;  // depends on the tests before
    say(counters);
    auto needs = pc::make<pc_frame_needs>();
    ASSERT_EQ(
        pc_vk_query_frame(subject.vulkan.get(), subject.chain.get(), &subject.frame.vk, &needs),
        PC_OK);
    say(needs);
}

TEST(Steps, AreListedWithTheirUses) {
    Subject subject("motion_blur");
    const pc_vk_steps steps = subject.begin();
    ASSERT_GT(steps.dispatch_count, 3u);
    EXPECT_STREQ(steps.dispatches[0].name, "begin");
    std::map<Handle, std::pair<uint32_t, VkAccessFlags>> last;  // level and access
    std::map<std::string, VkAccessFlags> of_host;
    bool launched = false;
    uint32_t level = 0;
    for (uint32_t d = 0; d < steps.dispatch_count; ++d) {
        const pc_vk_dispatch& dispatch = steps.dispatches[d];
        EXPECT_GE(dispatch.level, level);
        level = dispatch.level;
        for (uint32_t u = 0; u < dispatch.use_count; ++u) {
            const pc_vk_use& use = dispatch.uses[u];
            ASSERT_LT(use.resource, steps.resource_count);
            const pc_vk_resource& resource = steps.resources[use.resource];
            EXPECT_EQ((resource.image != VK_NULL_HANDLE) + (resource.buffer != VK_NULL_HANDLE) +
                          (resource.view != VK_NULL_HANDLE),
                      1);
            if (resource.view) of_host[resource.name] |= use.access;
            launched |= (use.access & VK_ACCESS_INDIRECT_COMMAND_READ_BIT) != 0;
            EXPECT_EQ(use.stages, stages_of(use.access)) << dispatch.name << " " << resource.name;
            auto& before = last[handle_of(resource)];
            // Steps that write one texture together write different pixels of it.
            const bool together = use.access == VK_ACCESS_SHADER_WRITE_BIT &&
                                  before.second == VK_ACCESS_SHADER_WRITE_BIT;
            if (before.second && !together && conflict(before.second, use.access)) {
                EXPECT_GT(dispatch.level, before.first) << dispatch.name << " " << resource.name;
            }
            before.second = before.first == level ? before.second | use.access : use.access;
            before.first = level;
        }
    }
    EXPECT_TRUE(launched);
    EXPECT_EQ(of_host.at("host.color"), VkAccessFlags(VK_ACCESS_SHADER_READ_BIT));
    EXPECT_EQ(of_host.at("host.motion"), VkAccessFlags(VK_ACCESS_SHADER_READ_BIT));
    EXPECT_EQ(of_host.at("host.output"), VkAccessFlags(VK_ACCESS_SHADER_WRITE_BIT));
    // Refused: past the end, no command buffer, and after another run began or was prepared.
    Vulkan::get().run([&](VkCommandBuffer commands) {
        pc_vk_instance* const vulkan = subject.vulkan.get();
        expect_error(pc_vk_record(vulkan, steps.dispatch_count, commands), PC_ERROR_ARGUMENT,
                     "dispatch: ");
        expect_error(pc_vk_record(vulkan, 0, nullptr), PC_ERROR_ARGUMENT, "command_buffer is NULL");
        full_barrier(commands);
        EXPECT_EQ(pc_vk_run(vulkan, subject.chain.get(), &subject.frame.vk, commands), PC_OK);
        expect_error(pc_vk_record(vulkan, 0, commands), PC_ERROR_ARGUMENT,
                     "pc_vk_begin() was not the last call");
        auto again = pc::make<pc_vk_steps>();
        EXPECT_EQ(pc_vk_begin(vulkan, subject.chain.get(), &subject.frame.vk, &again), PC_OK);
        prepare(subject.vulkan, subject.chain, subject.frame.vk);
        expect_error(pc_vk_record(vulkan, 0, commands), PC_ERROR_ARGUMENT,
                     "pc_vk_begin() was not the last call");
    });
}

TEST(Steps, HaveTimes) {
    const Transcript whole(POSTCHAIN_SOURCE_DIR "/tests/vulkan/expected");
    Subject subject("motion_blur,fxaa");
    pc_vk_instance* const vulkan = subject.vulkan.get();
    expect_error(pc_vk_set_timing(vulkan, 3), PC_ERROR_ARGUMENT, "level: 3 is not 0, 1 or 2");
    for (const int level : {1, 2}) {
        EXPECT_EQ(pc_vk_set_timing(vulkan, level), PC_OK);
        uint64_t frame = 0;
        uint32_t count = 0;
        // Two runs in flight: the third reads the times of the first.
        for (uint64_t number = 10; number < 14; ++number) {
            subject.frame.frame.frame_number = number;
            EXPECT_EQ(run(subject.vulkan, subject.chain, subject.frame.vk), PC_OK);
            count = 0;
            const pc_result result = pc_vk_timings(vulkan, nullptr, &count, &frame);
            if (number >= 12) {
                EXPECT_EQ(frame, number - 2);
            } else if (level == 1) {
                EXPECT_EQ(result, PC_PENDING);
            }
        }
        std::vector<pc_time> times(count);
        EXPECT_EQ(pc_vk_timings(vulkan, times.data(), &count, &frame), PC_OK);
        std::map<std::string, float> by_name;
        for (const pc_time& time : times) by_name[time.name] += time.milliseconds;
        EXPECT_EQ(by_name.size(), times.size()) << "a name occurs twice";
        for (const pc_time& time : times) Transcript::say(concat(level, " ", time.name));
        const char* name = level == 1 ? "motion_blur" : "motion_blur.gather";
        ASSERT_TRUE(by_name.contains(name));
        EXPECT_GT(by_name.at(name), 0);
        EXPECT_LT(by_name.at(name), 60'000);
        EXPECT_TRUE(by_name.contains(level == 1 ? "fxaa" : "fxaa.fxaa"));
    }
}

// A run that is never submitted has no times, and those in flight are forgotten with it.
TEST(Steps, GivenUpRunsHaveNoTimes) {
    Subject subject("fxaa");
    pc_vk_instance* const vulkan = subject.vulkan.get();
    EXPECT_EQ(pc_vk_set_timing(vulkan, 1), PC_OK);
    const auto timed = [&](uint64_t number) {
        subject.frame.frame.frame_number = number;
        EXPECT_EQ(run(subject.vulkan, subject.chain, subject.frame.vk), PC_OK);
        uint32_t count = 0;
        uint64_t frame = 0;
        (void)pc_vk_timings(vulkan, nullptr, &count, &frame);
        return frame;
    };
    for (uint64_t number = 10; number < 14; ++number) timed(number);
    subject.frame.frame.frame_number = 14;
    const VkCommandBuffer never = Vulkan::get().begin();
    EXPECT_EQ(pc_vk_run(vulkan, subject.chain.get(), &subject.frame.vk, never), PC_OK);
    vkEndCommandBuffer(never);
    EXPECT_EQ(pc_vk_give_up(vulkan), PC_OK);
    const uint64_t known[] = {12, 12, 15};  // the last that was read, and two runs ago
    for (uint64_t i = 0; i < 3; ++i) EXPECT_EQ(timed(15 + i), known[i]) << i;
}

}  // namespace
}  // namespace postchain::test::steps_test
