// Implementation of pc_vk_instance: the programs, images and plans of one device.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chain/guest/chain_handle.h"
#include "chain/guest/failure.h"
#include "chain/guest/purpose.h"
#include "chain/vk/compiled_plan.h"
#include "chain/vk/device.h"
#include "chain/vk/host_images.h"
#include "chain/vk/image_pool.h"
#include "chain/vk/postchain_vk.h"
#include "chain/vk/programs.h"

namespace postchain::vk {

class Instance {
  public:
    static guest::Failure create(const pc_vk_create_info& info,
                                 std::unique_ptr<Instance>& instance);
    ~Instance() { entries_.clear(); }  // before the pool that their images are of
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    // PC_PENDING while programs are left to compile.
    guest::Failure prepare(const guest::ChainHandle& chain, const pc_vk_frame& given, bool wait);
    guest::Failure run(const guest::ChainHandle& chain, const pc_vk_frame& given,
                       VkCommandBuffer commands);
    guest::Failure needs_of(const guest::ChainHandle& chain, const pc_vk_frame& given,
                            pc_frame_needs& out) const;
    void count(pc_counters& out) const;
    // Plans the last frame again; "" before the first frame.
    std::string explain() const;
    void log(int level, const std::string& message) const;

    std::string error;  // of the last call

  private:
    // A plan that is ready to run.
    struct Entry {
        guest::Purpose purpose;
        guest::HostPlan host;  // without its plan
        std::unique_ptr<CompiledPlan> plan;
        CompiledPlan& compiled;
        uint64_t last_run = 0;
    };
    static constexpr size_t kMaxKinds = 64;   // for messages
    static constexpr size_t kMaxEntries = 8;  // for example for a cut, a debug view, the other eye

    explicit Instance(const pc_vk_create_info& info);
    guest::Failure open();
    guest::Failure check(const pc_vk_frame& given, HostImages& images) const;
    // The plan of the frame; PC_ERROR_PREPARE if a program is not compiled.
    guest::Failure find_or_make(const guest::ChainHandle& chain, const guest::HostFrame& frame,
                                Entry*& entry);
    guest::Failure make(guest::Purpose purpose, guest::HostPlan& host, Entry*& entry);
    void forget_entry(size_t index);
    void forget_entries();
    Room room(const guest::HostFrame& frame) const {
        const int part = frame.halved() ? 2 : 1;
        return {(int(info_.max_width) + part - 1) / part,
                (int(info_.max_height) + part - 1) / part};
    }
    uint64_t kept_frames() const { return info_.keep_frames ? info_.keep_frames : 8; }
    // The last run after which something was not used for too long.
    uint64_t last_kept() const { return runs_ > kept_frames() ? runs_ - kept_frames() - 1 : 0; }

    const pc_vk_create_info info_;
    Device device_;
    Sampler sampler_;
    std::unique_ptr<Image> unused_;
    std::optional<ImagePool> pool_;
    std::optional<Programs> programs_;
    std::optional<Retired> retired_;
    std::vector<std::unique_ptr<Entry>> entries_;
    std::optional<guest::PlanKey> prepared_;  // of the last prepare(), and its programs
    guest::FrameValues prepared_values_ = {};
    std::vector<ProgramKey> prepared_programs_;
    std::vector<guest::FrameKind> prepared_kinds_;  // the newest last
    ResolvedChain resolved_;                        // the frame whose plan is looked for
    std::shared_ptr<const Chain> last_chain_;       // null before the first frame
    pc_frame last_frame_ = {};
    std::array<char, sizeof(guest::PlanKey::debug_view)> last_view_ = {};
    uint64_t runs_ = 0, dispatches_ = 0, barriers_ = 0, plans_ = 0;
    mutable std::string logged_;
};

}  // namespace postchain::vk
