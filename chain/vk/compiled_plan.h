// A plan made ready for a Vulkan device: pipelines, images, descriptor sets, barriers, and uniform
// blocks for each run in flight, so that recording it allocates nothing. Shape and values are those
// of gl::CompiledPlan.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/plan_values.h"
#include "chain/plan/storage.h"
#include "chain/vk/clock.h"
#include "chain/vk/device.h"
#include "chain/vk/image_pool.h"
#include "chain/vk/programs.h"

namespace postchain::vk {

// A host's images by the name that a frame gives them: index + 1. One image has one name.
struct HostView {
    VkImageView view = VK_NULL_HANDLE;
    VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
    bool operator==(const HostView&) const = default;
};
// Color, depth, motion, exposure of the frame, of the one before and of the one after; mask,
// output.
using HostViews = std::array<HostView, 14>;

// The objects that plans are made and run with.
struct Objects {
    const Device& device;
    ImagePool& pool;
    Programs& programs;
    uint32_t runs_in_flight;
    Image& unused;         // takes the place of units that the program has and the step does not
    const Image& to_host;  // the work list that plans import: a buffer that the host reads
};

class CompiledPlan : public PlanValues {
  public:
    // `run`: of the last run that began. Errors: those of pool and compiler.
    static Result<std::unique_ptr<CompiledPlan>> make(Plan plan, const Objects& objects,
                                                      const MaxFrameSize& max_size, uint64_t run);
    ~CompiledPlan();
    CompiledPlan(const CompiledPlan&) = delete;
    CompiledPlan& operator=(const CompiledPlan&) = delete;

    uint32_t barriers() const { return barriers_; }
    // True if no plan used one of its images since that run.
    bool holds_unused(uint64_t last_used) const;

    // The name of an imported texture. Its view says what else an image has.
    template <class... OfView>
    void import(TextureId texture, unsigned name, const OfView&...) {
        names_[size_t(texture)] = name;
    }

    // Its images are no longer counted as used by it; it does not run again.
    void release();

    // A run begins: its blocks and descriptors are written. What is recorded until the next
    // begin_run() is this run's.
    void begin_run(uint64_t run, const HostViews& views);
    size_t steps() const { return commands_.size(); }
    // Records the whole run with its barriers. `clock`: its run has begun; `by_step`: an interval
    // for each step, otherwise for each pass.
    void record(VkCommandBuffer commands, Clock& clock, bool by_step);
    // Records what comes before the first step, or a step, without barriers between them. A step
    // that writes for the host ends with a barrier for it.
    void record_begin(VkCommandBuffer commands);
    void record_step(VkCommandBuffer commands, size_t step);

    // A resource that the begin (-1) or a step reads or writes, for a host that sets the barriers.
    struct Use {
        const Image* image = nullptr;  // of the library; null: the host's
        unsigned name = 0;             // of the host's: as in import()
        TextureId texture = -1;
        VkPipelineStageFlags stages = 0;
        VkAccessFlags access = 0;
    };
    // Appends them, each image once.
    void find_uses(int step, std::vector<Use>& uses) const;
    bool waits(size_t step) const { return commands_[step].waits != 0; }

  private:
    struct Command {
        const Program* program = nullptr;
        uint32_t waits = 0;
        bool imports = false;  // binds images of the host
        bool to_host = false;  // writes for the host
    };
    CompiledPlan(Plan plan, const Objects& objects);
    bool is_to_host(TextureId texture) const {
        const PlanTexture& one = plan().textures[size_t(texture)];
        return one.imported && one.format == Format::work_list;
    }
    Status take_programs();
    Status take_images(const MaxFrameSize& max_size, uint64_t run);
    Status make_uniforms();
    Status make_sets();
    void find_barriers();
    // `index`: that of the step.
    void write_set(size_t index, VkDescriptorSet set, const HostViews& views) const;
    void write_sets(uint32_t slot, const HostViews& views);
    void begin(VkCommandBuffer commands, bool waits) const;
    bool empty_lists(VkCommandBuffer commands) const;
    void wait(VkCommandBuffer commands, uint32_t waits) const;
    void dispatch(VkCommandBuffer commands, const Step& step, const Program& program) const;

    const Objects objects_;
    std::vector<Image*> images_;          // of the pool, each once
    std::vector<const Image*> image_of_;  // of the plan's textures; null: the host's, or none
    std::vector<unsigned> names_;         // of imported ones
    std::vector<int> storage_;            // number of the storage of each of them
    std::vector<Command> commands_;
    Buffer uniforms_;  // bytes() of each run in flight
    uint32_t slot_ = 0;
    size_t offset_ = 0;  // of the run's blocks in `uniforms_`
    VkDescriptorPool sets_pool_ = VK_NULL_HANDLE;
    std::vector<VkDescriptorSet> sets_;  // of each run in flight, of each step
    uint32_t barriers_ = 0;
};

}  // namespace postchain::vk
