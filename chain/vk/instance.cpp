#include "chain/vk/instance.h"

#include <algorithm>

#include "chain/guest/frame_check.h"
#include "chain/guest/program_callbacks.h"
#include "chain/plan_print.h"
#include "chain/same_shape.h"
#include "chain/vk/format.h"

namespace postchain::vk {

using guest::ChainHandle;
using guest::Failure;
using guest::HostFrame;
using guest::HostPlan;

namespace {

constexpr uint32_t kMaxRuns = 64;

uint32_t runs_of(const pc_vk_create_info& info) {
    return info.runs_in_flight ? info.runs_in_flight : 2;
}

}  // namespace

Instance::Instance(const pc_vk_create_info& info) : info_(info) {}

Failure Instance::create(const pc_vk_create_info& info, std::unique_ptr<Instance>& instance) {
    std::unique_ptr<Instance> made(new Instance(info));
    if (Failure failure = made->open(); !failure.ok()) return failure;
    instance = std::move(made);
    return {};
}

Failure Instance::open() {
    if (info_.runs_in_flight > kMaxRuns)
        return {PC_ERROR_ARGUMENT,
                concat("runs_in_flight: ", info_.runs_in_flight, " is more than ", kMaxRuns)};
    RETURN_IF_ERROR(
        device_.open({info_.get_instance_proc_addr, info_.instance, info_.physical_device,
                      info_.device, info_.pipeline_cache, info_.queue_family}));
    const uint32_t limit = device_.limits().maxImageDimension2D;
    if (info_.max_width == 0 || info_.max_height == 0 || info_.max_width > limit ||
        info_.max_height > limit)
        return {PC_ERROR_ARGUMENT,
                concat("max_width, max_height: ", info_.max_width, "x", info_.max_height,
                       "; give the largest frame, 1 to ", limit, " a side")};
    RETURN_IF_ERROR(sampler_.make(device_));
    retired_.emplace(runs_of(info_));
    programs_.emplace(device_, sampler_.handle(), guest::store_of(info_));
    pool_.emplace(device_, info_.texture_budget);
    ASSIGN_OR_RETURN(unused_, make_image(device_, {Format::rgba32f, 1, 1, 0}));
    return {};
}

void Instance::log(int level, const std::string& message) const {
    if (!info_.log || message == logged_) return;  // not every frame again
    logged_ = message;
    info_.log(info_.user, level, message.c_str());
}

Failure Instance::check(const pc_vk_frame& given, HostImages& images) const {
    if (Failure failure = check_images(given, images); !failure.ok()) return failure;
    const HostFrame& frame = images.frame;
    if (uint32_t(frame.width) > info_.max_width || uint32_t(frame.height) > info_.max_height)
        return {PC_ERROR_INPUT, concat("the frame is ", frame.width, "x", frame.height,
                                       "; pc_vk_create_info states ", info_.max_width, "x",
                                       info_.max_height, " at most")};
    if (!device_.supports(VkFormat(given.output.format), VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT))
        return {PC_ERROR_INPUT, concat("output: this device cannot store to images of ",
                                       frame.output.format->text)};
    return (info_.flags & PC_VALIDATE) != 0 ? check_deeper(frame) : Failure();
}

Failure Instance::prepare(const ChainHandle& chain, const pc_vk_frame& given, bool wait) {
    HostImages images;
    if (Failure failure = check(given, images); !failure.ok()) return failure;
    const HostFrame& frame = images.frame;
    // Without waiting the host calls again and again with one frame: that is planned once.
    const guest::PlanKey key = key_of(frame, {}, chain.id(), chain.revision());
    const guest::FrameValues values = values_of(frame);
    if (prepared_ != key || prepared_values_ != values) {
        prepared_.reset();
        ASSIGN_OR_RETURN(auto host, make_host_plan(chain.chain(), frame));
        prepared_programs_ = host_programs(chain.chain(), frame, host.plan);
        prepared_ = key;
        prepared_values_ = values;
    }
    bool compiled = false;
    for (const ProgramKey& program : prepared_programs_) {
        if (programs_->has(program)) continue;
        if (!wait && compiled) return {PC_PENDING, ""};
        RETURN_IF_ERROR(programs_->get(program).status());
        compiled = true;
    }
    const guest::FrameKind kind = kind_of(frame, chain.id(), chain.revision());
    std::erase(prepared_kinds_, kind);
    prepared_kinds_.push_back(kind);
    if (prepared_kinds_.size() > kMaxKinds) prepared_kinds_.erase(prepared_kinds_.begin());
    pc_frame values_of_cut = images.values;
    values_of_cut.flags ^= PC_CAMERA_CUT;
    HostFrame cut;
    Entry* entry = nullptr;
    if (check_frame(&values_of_cut, cut, find_format).ok())
        (void)find_or_make(chain, cut, entry);  // if it fails, the frame itself is still prepared
    return find_or_make(chain, frame, entry);
}

Failure Instance::find_or_make(const ChainHandle& handle, const HostFrame& frame, Entry*& entry) {
    const Chain& chain = handle.chain();
    const guest::PlanKey key = key_of(frame, room(frame), handle.id(), handle.revision());
    if (Failure failure = find_entry(entries_, chain, frame, key, resolved_, entry);
        entry || !failure.ok())
        return failure;
    guest::Purpose purpose;
    RETURN_IF_ERROR(resolve(chain, frame, key, resolved_, purpose));
    ASSIGN_OR_RETURN(auto host, make_host_plan(resolved_, frame));
    ++plans_;
    for (const auto& known : entries_) {
        const guest::PlanKey& other = known->purpose.key;
        const bool replaced = other.chain == key.chain && other.revision < key.revision;
        if (!replaced && known->last_run + kept_frames() >= runs_) continue;
        if (!same_shape(known->compiled.plan(), host.plan)) continue;
        known->compiled.take_values(std::move(host.plan));
        known->purpose = std::move(purpose);
        known->host = std::move(host);
        entry = known.get();
        return {};
    }
    for (const Step& step : host.plan.steps)
        if (!programs_->has(step.program))
            return {PC_ERROR_PREPARE,
                    difference_text(kind_of(frame, handle.id(), handle.revision()), prepared_kinds_,
                                    "pc_vk_prepare()")};
    Failure failure = make(purpose, host, entry);
    if (failure.result != PC_ERROR_MEMORY || entries_.empty()) return failure;
    // Once more without what other plans hold.
    while (!entries_.empty()) forget_entry(entries_.size() - 1);
    pool_->trim(runs_, runs_, *retired_);
    return make(std::move(purpose), host, entry);
}

Failure Instance::make(guest::Purpose purpose, HostPlan& host, Entry*& entry) {
    const Objects objects{device_, *pool_, *programs_, runs_of(info_), *unused_};
    auto compiled = CompiledPlan::make(host.plan, objects, purpose.key.room, runs_);
    if (!compiled.ok()) {
        pool_->trim(runs_, runs_, *retired_);
        return compiled.status();
    }
    HostPlan about = host;
    about.plan = {};
    CompiledPlan& plan = **compiled;
    entries_.push_back(std::unique_ptr<Entry>(
        new Entry{std::move(purpose), std::move(about), std::move(*compiled), plan, runs_}));
    entry = entries_.back().get();
    return {};
}

void Instance::forget_entry(size_t index) {
    entries_[index]->plan->release();
    retired_->add(runs_, std::move(entries_[index]->plan));
    entries_.erase(entries_.begin() + std::ptrdiff_t(index));
}

// Plans that did not run for a while and hold images that no other plan uses, and the one that ran
// longest ago.
void Instance::forget_entries() {
    for (size_t i = entries_.size(); i-- > 0;)
        if (entries_[i]->last_run + kept_frames() < runs_ &&
            entries_[i]->compiled.holds_unused(last_kept()))
            forget_entry(i);
    while (entries_.size() > kMaxEntries) {
        const auto oldest = std::min_element(
            entries_.begin(), entries_.end(),
            [](const auto& a, const auto& b) { return a->last_run < b->last_run; });
        forget_entry(size_t(oldest - entries_.begin()));
    }
    if (last_kept() > 0) pool_->trim(last_kept(), runs_, *retired_);
}

Failure Instance::run(const ChainHandle& chain, const pc_vk_frame& given,
                      VkCommandBuffer commands) {
    if (!commands) return {PC_ERROR_ARGUMENT, "command_buffer is NULL"};
    HostImages images;
    if (Failure failure = check(given, images); !failure.ok()) return failure;
    Entry* entry = nullptr;
    if (Failure failure = find_or_make(chain, images.frame, entry); !failure.ok()) return failure;
    entry->last_run = ++runs_;
    retired_->begin(runs_);
    last_chain_ = chain.version().chain;
    last_frame_ = images.values;
    last_view_ = entry->purpose.key.debug_view;
    CompiledPlan& compiled = entry->compiled;
    import_frame(entry->host, images.frame, compiled);
    compiled.record(commands, runs_, images.views);
    dispatches_ += compiled.plan().steps.size();
    barriers_ += compiled.barriers() + 1;
    forget_entries();
    return {};
}

Failure Instance::needs_of(const ChainHandle& chain, const pc_vk_frame& given,
                           pc_frame_needs& out) const {
    HostImages images;
    if (Failure failure = check(given, images); !failure.ok()) return failure;
    ASSIGN_OR_RETURN(auto host, make_host_plan(chain.chain(), images.frame));
    const StoragePlan storage = share_storage(host.plan, room(images.frame));
    out.textures = uint32_t(storage.all.size());
    out.texture_bytes = storage.bytes();
    out.programs = out.programs_to_compile = 0;
    for (const ProgramKey& key : host_programs(chain.chain(), images.frame, host.plan)) {
        ++out.programs;
        if (!programs_->has(key)) ++out.programs_to_compile;
    }
    return {};
}

void Instance::count(pc_counters& out) const {
    out.frames = runs_;
    out.dispatches = dispatches_;
    out.barriers = barriers_;
    out.plans_made = plans_;
    out.programs = programs_->compiled();
    out.texture_allocations = pool_->allocations();
    out.textures_alive = pool_->alive();
    out.texture_bytes = pool_->bytes();
    out.texture_bytes_peak = pool_->bytes_peak();
    out.programs_loaded = programs_->loaded();
}

std::string Instance::explain() const {
    if (!last_chain_) return {};
    pc_frame given = last_frame_;
    given.debug_view = last_view_.data();
    HostFrame frame;
    if (!check_frame(&given, frame, find_format).ok()) return {};
    const auto host = make_host_plan(*last_chain_, frame);
    return host.ok() ? json_text(plan_json(host->plan)) : std::string();
}

}  // namespace postchain::vk
