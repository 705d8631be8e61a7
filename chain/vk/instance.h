// Implementation of pc_vk_instance: the programs, images and plans of one device.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/guest/instance_calls.h"
#include "chain/guest/plan_cache.h"
#include "chain/vk/clock.h"
#include "chain/vk/compiled_plan.h"
#include "chain/vk/device.h"
#include "chain/vk/focus.h"
#include "chain/vk/format.h"
#include "chain/vk/host_images.h"
#include "chain/vk/image_pool.h"
#include "chain/vk/postchain_vk.h"
#include "chain/vk/programs.h"

namespace postchain::vk {

class Instance : public guest::InstanceBase<pc_vk_create_info> {
  public:
    static guest::Failure create(const pc_vk_create_info& info,
                                 std::unique_ptr<Instance>& instance);

    // PC_PENDING while programs are left to compile.
    guest::Failure prepare(const guest::ChainVersion& chain, const pc_vk_frame& given, bool wait);
    guest::Failure run(const guest::ChainVersion& chain, const pc_vk_frame& given,
                       VkCommandBuffer commands);
    guest::Failure needs_of(const guest::ChainVersion& chain, const pc_vk_frame& given,
                            pc_frame_needs& out) const;
    // A frame in two phases. The arrays of `steps` are this object's.
    guest::Failure begin(const guest::ChainVersion& chain, const pc_vk_frame& given,
                         pc_vk_steps& steps);
    guest::Failure record(uint32_t dispatch, VkCommandBuffer commands);
    // Runs that were recorded are never submitted.
    void give_up();
    guest::Failure set_timing(int level);
    const Times* newest_times() const { return clock_->newest(); }
    void count(pc_counters& out) const { plans_.count(*programs_, *pool_, out); }
    std::string explain() const { return plans_.explain(); }
    // Vulkan has no current context.
    static guest::Failure check_context() { return {}; }

  private:
    using Plans = guest::PlanCache<Instance, CompiledPlan>;
    friend Plans;
    static constexpr size_t kMaxPlans = 8;

    explicit Instance(const pc_vk_create_info& info);
    guest::Failure open();
    guest::Failure check(const pc_vk_frame& given, HostImages& images) const;
    // The depths that the frame focuses at, before its run or in it.
    guest::Failure set_focus(const guest::ChainVersion& chain, HostImages& images, bool runs);
    // The plan of a frame whose run begins.
    guest::Failure begin_run(const guest::ChainVersion& chain, HostImages& images,
                             Plans::Entry*& entry);
    void end_run();
    void list_uses(int step, const HostImages& images);
    uint32_t runs_in_flight() const { return info_.runs_in_flight ? info_.runs_in_flight : 2; }
    // The plan of the frame; PC_ERROR_PREPARE if a program is not compiled.
    guest::Failure find_or_make(const guest::ChainVersion& chain, const guest::HostFrame& frame,
                                Plans::Entry*& entry);
    bool has(const ProgramKey& key) const { return programs_->has(key); }
    static void begin(const ProgramKey&) {}
    Status compile(const ProgramKey& key) { return programs_->get(key).status(); }
    Result<std::unique_ptr<CompiledPlan>> compile(Plan plan, const MaxFrameSize& max_size);
    bool holds_unused(const CompiledPlan& plan) const { return plan.holds_unused(last_kept()); }
    void retire(std::unique_ptr<CompiledPlan> plan);
    MaxFrameSize max_size(const guest::HostFrame& frame) const {
        return frame.max_planes(info_.max_width, info_.max_height);
    }
    // The last run after which something was not used for too long.
    uint64_t last_kept() const {
        const uint64_t kept = plans_.kept_frames();
        return plans_.frames > kept ? plans_.frames - kept - 1 : 0;
    }

    Device device_;
    Sampler sampler_;
    std::unique_ptr<Image> unused_;
    std::optional<ImagePool> pool_;
    std::optional<Programs> programs_;
    std::optional<Retired> retired_;
    std::optional<Clock> clock_;
    std::optional<Focus> focus_;
    guest::Depths places_;  // of the last chain with places
    // The plan of the run that begin() began last; null: no run is open.
    CompiledPlan* open_ = nullptr;
    std::vector<pc_vk_resource> resources_;
    std::vector<pc_vk_use> uses_;
    std::vector<pc_vk_dispatch> dispatches_;
    std::vector<CompiledPlan::Use> found_;
    Plans plans_{*this, kMaxPlans, "pc_vk_prepare()", find_format};
};

}  // namespace postchain::vk
