// The plans that an instance keeps ready, and the one of a frame among them: for GL and Vulkan.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "chain/guest/chain_handle.h"
#include "chain/guest/failure.h"
#include "chain/guest/frame_check.h"
#include "chain/guest/host_frame.h"
#include "chain/guest/host_plan.h"
#include "chain/pass/resolved_chain.h"
#include "chain/plan/plan.h"
#include "chain/plan/plan_print.h"

namespace postchain::guest {

// `Instance` compiles for its device. It has
//
//   - has(key): whether a program is compiled; begin(key) starts to compile it, compile(key) ends;
//   - compile(plan, max_size): a Result with the plan's `Compiled`, which is a PlanValues;
//   - holds_unused(compiled): whether it holds storage that no plan used for a while;
//   - retire(compiled): takes a plan that the cache has removed.
template <class Instance, class Compiled>
class PlanCache {
  public:
    // A plan that is ready to run, and its frames: those of this key and shape.
    struct Entry {
        PlanKey key;
        PlanOptions options;
        RuleNames rules;  // options.rules() of the chain
        PlanShape shape;
        HostPlan host;  // without its plan
        std::unique_ptr<Compiled> compiled;
        uint64_t last_run = 0;
    };

    // `most`: plans kept, for example for other chains, a cut, or the other eye. `prepare`: the
    // host's function, for messages. `find`: the formats of its textures.
    PlanCache(Instance& instance, size_t most, const char* prepare,
              const HostFormat* (*find)(unsigned))
        : instance_(instance), most_(most), prepare_(prepare), find_(find) {}

    // The device that all plans are for; before the first one.
    void set_device(DeviceClass device) { device_ = device; }
    DeviceClass device() const { return device_; }

    // Frames without a run after which a plan may go.
    void set_kept_frames(uint64_t kept) { kept_frames_ = kept; }
    uint64_t kept_frames() const { return kept_frames_; }

    // Compiles the programs of every frame of this kind, which list(plan) returns for the frame's
    // plan. Without `wait` one of them at most; PC_PENDING if more are left.
    template <class List>
    Failure compile_programs(const ChainVersion& version, const HostFrame& frame, bool wait,
                             const List& list) {
        // Without waiting the host calls again and again with one frame: that is planned once.
        const PlanKey key = key_of(frame, {}, version.id, version.revision);
        const PlanOptions options = options_of(frame, device_);
        const RuleNames rules = options.rules(*version.chain);
        ResolvedChain resolved;
        RETURN_IF_ERROR(
            resolved.resolve(*version.chain, describe(frame, *version.chain), options, rules));
        if (!prepared_ || prepared_->key != key || prepared_->shape != resolved.shape()) {
            prepared_.reset();
            ASSIGN_OR_RETURN(auto host, make_host_plan(resolved, frame));
            prepared_ = Prepared{key, resolved.shape(), list(host.plan)};
        }
        for (const ProgramKey& program : prepared_->programs)
            if (wait) instance_.begin(program);
        bool compiled = false;
        for (const ProgramKey& program : prepared_->programs) {
            if (instance_.has(program)) continue;
            if (!wait && compiled) return {PC_PENDING, ""};
            RETURN_IF_ERROR(instance_.compile(program));
            compiled = true;
        }
        const FrameKind kind = kind_of(frame, version.id, version.revision);
        std::erase(prepared_kinds_, kind);
        prepared_kinds_.push_back(kind);
        if (prepared_kinds_.size() > kMaxKinds) prepared_kinds_.erase(prepared_kinds_.begin());
        return {};
    }
    // Other programs may be needed for the same frame.
    void forget_prepared() { prepared_.reset(); }
    Failure not_prepared(const ChainVersion& version, const HostFrame& frame) const {
        return {PC_ERROR_PREPARE, difference_text(kind_of(frame, version.id, version.revision),
                                                  prepared_kinds_, prepare_)};
    }

    // The frame's plan with its values. PC_ERROR_PREPARE if a program is not compiled. Allocates
    // nothing for a frame whose plan is kept, unless a pass has a matte.
    Failure find_or_make(const ChainVersion& version, const HostFrame& frame,
                         const MaxFrameSize& max_size, Entry*& entry) {
        const Chain& chain = *version.chain;
        const PlanKey key = key_of(frame, max_size, version.id, version.revision);
        entry = nullptr;
        bool is_resolved = false;
        for (const auto& known : entries_) {
            if (known->key != key) continue;
            if (!is_resolved)
                RETURN_IF_ERROR(
                    resolved_.resolve(chain, describe(frame, chain), known->options, known->rules));
            is_resolved = true;
            if (known->shape != resolved_.shape()) continue;
            known->compiled->rewrite_values([&](Plan& plan) { write_values(resolved_, plan); });
            entry = known.get();
            return {};
        }
        auto made = std::make_unique<Entry>();
        made->key = key;
        made->options = options_of(frame, device_);
        made->rules = made->options.rules(chain);
        RETURN_IF_ERROR(
            resolved_.resolve(chain, describe(frame, chain), made->options, made->rules));
        made->shape = resolved_.shape();
        ASSIGN_OR_RETURN(made->host, make_host_plan(resolved_, frame));
        Plan plan = std::exchange(made->host.plan, {});
        made->last_run = frames;
        ++plans_made_;
        // One of an earlier revision, or that did not run for a while.
        for (auto& known : entries_) {
            const bool replaced =
                known->key.chain == key.chain && known->key.revision != key.revision;
            if (!replaced && known->last_run + std::max<uint64_t>(kept_frames_, most_) >= frames)
                continue;
            if (known->key.max_size != key.max_size || !same_shape(known->compiled->plan(), plan))
                continue;
            made->compiled = std::move(known->compiled);
            made->compiled->take_values(std::move(plan));
            known = std::move(made);
            entry = known.get();
            return {};
        }
        for (const Step& step : plan.steps)
            if (!instance_.has(step.program)) return not_prepared(version, frame);
        ASSIGN_OR_RETURN(made->compiled, instance_.compile(std::move(plan), max_size));
        entries_.push_back(std::move(made));
        entry = entries_.back().get();
        return {};
    }

    // The entry runs on this frame, number `frames`.
    void run(Entry& entry, const ChainVersion& version, const HostFrame& frame) {
        entry.last_run = frames;
        last_.chain = version.chain;
        last_.frame = *frame.given;
        set_neighbors(last_.frame, {last_.frame.before, last_.frame.after}, last_.neighbors);
        if (frame.focus) last_.focus = *frame.focus;
        last_.focus_slot = frame.focus_slot;
        last_.debug_view = entry.key.debug_view;
        if (entry.compiled->plan().steps.empty()) return;
        dispatches += entry.compiled->plan().steps.size();
        barriers += entry.compiled->barriers() + 1;
    }

    // Plans that did not run for a while and hold storage that no other plan uses, and those that
    // ran longest ago.
    void forget_unused() {
        for (size_t i = entries_.size(); i-- > 0;)
            if (entries_[i]->last_run + kept_frames_ < frames &&
                instance_.holds_unused(*entries_[i]->compiled))
                forget(i);
        while (entries_.size() > most_)
            forget(size_t(std::ranges::min_element(entries_, {}, &last_run_of) - entries_.begin()));
    }
    void forget_all() {
        while (!entries_.empty()) forget(entries_.size() - 1);
    }
    bool empty() const { return entries_.empty(); }

    // Textures, memory and programs that a frame of this plan needs. `programs`: those of every
    // frame of its kind.
    void count_needs(const Plan& plan, const std::optional<MaxFrameSize>& max_size,
                     const std::vector<ProgramKey>& programs, pc_frame_needs& out) const {
        const StoragePlan storage = share_storage(plan, max_size);
        out.textures = uint32_t(storage.all.size());
        out.texture_bytes = storage.bytes();
        out.programs = uint32_t(programs.size());
        out.programs_to_compile = uint32_t(std::ranges::count_if(
            programs, [&](const ProgramKey& key) { return !instance_.has(key); }));
    }
    template <class Programs, class Pool>
    void count(const Programs& programs, const Pool& pool, pc_counters& out) const {
        out.frames = frames;
        out.dispatches = dispatches;
        out.barriers = barriers;
        out.plans_made = plans_made_;
        out.programs = programs.compiled();
        out.programs_loaded = programs.loaded();
        out.texture_allocations = pool.allocations();
        out.textures_alive = pool.alive();
        out.texture_bytes = pool.bytes();
        out.texture_bytes_peak = pool.bytes_peak();
    }
    // The frame with a camera cut if it has none, and without one if it has: the plan of the first
    // frame of a shot, which is prepared with those of the others. Empty: no valid frame.
    struct OtherCut {
        pc_frame given;
        HostFrame frame;
    };
    std::unique_ptr<OtherCut> other_cut(const HostFrame& frame) const {
        auto other = std::make_unique<OtherCut>();
        other->given = *frame.given;
        other->given.flags ^= PC_CAMERA_CUT;
        if (!check_frame(&other->given, other->frame, find_).ok()) return nullptr;
        other->frame.focus = frame.focus;
        other->frame.focus_slot = frame.focus_slot;
        return other;
    }
    // Plans the last frame again; "" before the first frame.
    std::string explain() const {
        if (!last_.chain) return {};
        pc_frame given = last_.frame;
        given.debug_view = last_.debug_view.data();
        HostFrame frame;
        if (!check_frame(&given, frame, find_).ok()) return {};
        frame.focus = &last_.focus;
        frame.focus_slot = last_.focus_slot;
        const auto host = make_host_plan(*last_.chain, frame, device_);
        return host.ok() ? json_text(plan_json(host->plan)) : std::string();
    }

    uint64_t frames = 0;  // that began to run
    uint64_t dispatches = 0, barriers = 0;

  private:
    static constexpr size_t kMaxKinds = 64;  // for messages
    // The last frame of compile_programs(), and the programs that it needs.
    struct Prepared {
        PlanKey key;
        PlanShape shape;
        std::vector<ProgramKey> programs;
    };
    // The values of the last frame that its plan depends on.
    struct LastFrame {
        std::shared_ptr<const Chain> chain;  // null before the first frame
        pc_frame frame = {};
        std::array<pc_frame, kNeighbors.size()> neighbors = {};
        std::map<Place, double> focus;
        int focus_slot = -1;
        std::array<char, sizeof(PlanKey::debug_view)> debug_view = {};
    };
    static uint64_t last_run_of(const std::unique_ptr<Entry>& entry) { return entry->last_run; }
    void forget(size_t index) {
        instance_.retire(std::move(entries_[index]->compiled));
        entries_.erase(entries_.begin() + std::ptrdiff_t(index));
    }

    Instance& instance_;
    const size_t most_;
    const char* const prepare_;
    const HostFormat* (*const find_)(unsigned);
    DeviceClass device_ = DeviceClass::gpu;
    uint64_t kept_frames_ = 8;
    std::vector<std::unique_ptr<Entry>> entries_;
    ResolvedChain resolved_;  // the frame whose plan is looked for
    std::optional<Prepared> prepared_;
    std::vector<FrameKind> prepared_kinds_;  // the newest last
    LastFrame last_;
    uint64_t plans_made_ = 0;
};

// Hands the frame's textures and values to the device's plan.
template <class Compiled>
void import_frame(const HostPlan& host, const HostFrame& frame, Compiled& compiled) {
    if (host.color >= 0) compiled.import(host.color, frame.color.name);
    if (host.depth >= 0) compiled.import(host.depth, frame.depth.name);
    if (host.motion >= 0) compiled.import(host.motion, frame.motion.name);
    if (host.mask >= 0) compiled.import(host.mask, frame.mask.name);
    if (host.exposure >= 0) compiled.import(host.exposure, frame.exposure.name);
    for (size_t i = 0; i < frame.neighbors.size(); ++i) {
        const HostInputs& inputs = host.neighbors[i];
        const HostPlanes& planes = frame.neighbors[i];
        if (inputs.color >= 0) compiled.import(inputs.color, planes.color.name);
        if (inputs.depth >= 0) compiled.import(inputs.depth, planes.depth.name);
        if (inputs.motion >= 0) compiled.import(inputs.motion, planes.motion.name);
        if (inputs.exposure >= 0) compiled.import(inputs.exposure, planes.exposure.name);
        if (host.neighbor_steps[i] < 0) continue;
        const shared::GuestUniforms uniforms = uniforms_of(planes, inputs);
        compiled.set_uniforms(host.neighbor_steps[i], std::as_bytes(std::span(&uniforms, 1)));
    }
    if (host.writes_output)
        compiled.import(host.result, frame.output.name, frame.output.format->name,
                        frame.output.image);
    if (host.own_steps.empty()) return;
    const shared::GuestUniforms uniforms = uniforms_of(frame, host, compiled.plan());
    for (const int step : host.own_steps)
        compiled.set_uniforms(step, std::as_bytes(std::span(&uniforms, 1)));
}

}  // namespace postchain::guest
