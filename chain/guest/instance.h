// Implementation of pc_instance: the programs, textures and plans of one GL context.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "chain/egl/context.h"
#include "chain/gl/clock.h"
#include "chain/gl/compiled_plan.h"
#include "chain/gl/device.h"
#include "chain/gl/image_reads.h"
#include "chain/gl/program.h"
#include "chain/gl/run_objects.h"
#include "chain/gl/texture_pool.h"
#include "chain/guest/budgets.h"
#include "chain/guest/current_context.h"
#include "chain/guest/focus.h"
#include "chain/guest/host_context.h"
#include "chain/guest/host_frame.h"
#include "chain/guest/instance_calls.h"
#include "chain/guest/max_frame_sizes.h"
#include "chain/guest/plan_cache.h"

namespace postchain::guest {

class Instance : public InstanceBase<pc_create_info> {
  public:
    // On the current context, or on one of its own.
    static Failure create(const pc_create_info& info, std::unique_ptr<Instance>& instance);
    ~Instance();  // as abandon() if its context is not current
    // The GL names are forgotten, not deleted.
    void abandon();

    // PC_ERROR_CONTEXT if its context is not current on this thread, or is lost.
    Failure check_context();

    // PC_PENDING while programs are left to compile.
    Failure prepare(const ChainVersion& chain, const pc_frame& given, bool wait);
    Failure run(const ChainVersion& chain, const pc_frame& given, pc_texture& result);

    Failure set_budget(const ChainVersion& chain, const pc_budget& given) {
        plans_.forget_prepared();  // the budget's samples may be other programs
        return budgets_.set(chain, given);
    }
    void budget(const ChainVersion& chain, pc_budget_state& state) const {
        budgets_.query(chain, state);
    }

    Failure set_timing(int level) {
        timing_ = level;
        return {};
    }
    // Null if no frame is finished.
    const Times* newest_times() { return objects_->clock.newest(); }
    void capabilities(pc_capabilities& out) const;
    // Calls no GL.
    Failure needs_of(const ChainVersion& chain, const pc_frame& given, pc_frame_needs& out);
    void count(pc_counters& out) const { plans_.count(objects_->programs, objects_->pool, out); }
    std::string explain() const { return plans_.explain(); }
    const gl::Device& device() const { return device_; }

  private:
    using Plans = PlanCache<Instance, gl::CompiledPlan>;
    using Entry = Plans::Entry;
    friend Plans;
    // A plan is taken over by another chain after as many frames without a run.
    static constexpr size_t kMaxPlans = 64;

    // GL objects of the context.
    struct Objects {
        explicit Objects(const gl::Device& device)
            : programs(device.log), clock(device), timer(device) {}
        gl::TexturePool pool;
        gl::ProgramCache programs;
        gl::RunObjects run;
        gl::Clock clock;
        gl::BandTimer timer;
        Focus focus;
        std::set<unsigned> warm;  // programs that were dispatched
    };

    using InstanceBase::InstanceBase;
    Failure open();
    // check_frame(), the device's limits, check_context(), and the depths in focus so far.
    Failure check(const ChainVersion& chain, const pc_frame& given, HostFrame& frame);
    // PC_ERROR_INPUT: larger than the device's textures.
    Failure check_size(const HostFrame& frame) const;
    // Programs of every frame of this kind, with the samples of every part of a budget.
    std::vector<ProgramKey> programs_to_prepare(const ChainVersion& chain, const HostFrame& frame,
                                                const Plan& plan) const;
    // The result of work(), which uses these units; the host's state is then as `info_.state` says.
    template <class Work>
    auto keep_state(const gl::UsedUnits& used, bool arrays, const Work& work);
    Failure ready_focus(const HostFrame& frame);
    // Finds and follows the depths at the places that the chain focuses at.
    Failure follow_focus(const ChainVersion& chain, HostFrame& frame);
    Failure find_or_make(const ChainVersion& chain, const HostFrame& frame, Entry*& entry);
    bool has(const ProgramKey& key) const { return objects_ && objects_->programs.has(key); }
    void begin(const ProgramKey& key) { objects_->programs.begin(key); }
    Status compile(const ProgramKey& key) { return objects_->programs.get(key).status(); }
    Result<std::unique_ptr<gl::CompiledPlan>> compile(Plan plan, const MaxFrameSize& max_size);
    bool holds_unused(const gl::CompiledPlan& plan) const {
        return plan.holds_unused(plans_.kept_frames());
    }
    static void retire(std::unique_ptr<gl::CompiledPlan>) {}
    // Every plan, and their textures.
    void forget_all();
    // Dispatches the plan's programs that never were, or, without waiting, one of them. True if
    // none is left.
    bool warm_up(Entry& entry, const HostFrame& frame, bool wait);
    Failure dispatch(Entry& entry, const HostFrame& frame, bool timed);

    std::unique_ptr<egl::Context> own_context_;
    ContextId context_;
    bool tells_loss_ = false;
    bool lost_ = false;
    uint32_t gl_version_ = 0;
    gl::Device device_;
    std::unique_ptr<Objects> objects_;
    Plans plans_{*this, kMaxPlans, "pc_prepare()", find_format};
    Depths focused_;  // the places of the last chain that was checked
    GlState state_;
    MaxFrameSizes max_sizes_;
    uint64_t forgot_ = 0;        // plans_.frames when a run found no memory beside other plans
    uint64_t newest_frame_ = 0;  // plans_.frames when a plan was looked for
    Budgets budgets_;
};

}  // namespace postchain::guest
