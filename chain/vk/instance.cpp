#include "chain/vk/instance.h"

#include <algorithm>

#include "chain/guest/frame_check.h"
#include "chain/guest/host_struct.h"

namespace postchain::vk {

using guest::ChainVersion;
using guest::Failure;
using guest::HostFrame;

namespace {

constexpr uint32_t kMaxRuns = 64;

uint32_t runs_of(const pc_vk_create_info& info) {
    return info.runs_in_flight ? info.runs_in_flight : 2;
}

}  // namespace

Instance::Instance(const pc_vk_create_info& info) : info_(info) {
    if (info_.keep_frames) plans_.set_kept_frames(info_.keep_frames);
}

Failure Instance::create(const pc_vk_create_info& info, std::unique_ptr<Instance>& instance) {
    std::unique_ptr<Instance> made(new Instance(info));
    RETURN_IF_ERROR(made->open());
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
    RETURN_IF_ERROR(check_images(given, images));
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

Failure Instance::prepare(const ChainVersion& chain, const pc_vk_frame& given, bool wait) {
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    const HostFrame& frame = images.frame;
    const auto list = [&](const Plan& plan) {
        return host_programs(*chain.chain, frame, plan, plans_.device());
    };
    RETURN_IF_ERROR(plans_.compile_programs(chain, frame, wait, list));
    pc_frame values_of_cut = images.values;
    values_of_cut.flags ^= PC_CAMERA_CUT;
    HostFrame cut;
    Plans::Entry* entry = nullptr;
    if (check_frame(&values_of_cut, cut, find_format).ok())
        (void)find_or_make(chain, cut,
                           entry);  // if it fails, the frame is still prepared
    return find_or_make(chain, frame, entry);
}

Failure Instance::find_or_make(const ChainVersion& chain, const HostFrame& frame,
                               Plans::Entry*& entry) {
    Failure failure = plans_.find_or_make(chain, frame, max_size(frame), entry);
    if (failure.result != PC_ERROR_MEMORY || plans_.empty()) return failure;
    // Once more without what other plans hold.
    plans_.forget_all();
    pool_->trim(plans_.frames, plans_.frames, *retired_);
    return plans_.find_or_make(chain, frame, max_size(frame), entry);
}

Result<std::unique_ptr<CompiledPlan>> Instance::compile(Plan plan, const MaxFrameSize& max_size) {
    const Objects objects{device_, *pool_, *programs_, runs_of(info_), *unused_};
    auto compiled = CompiledPlan::make(std::move(plan), objects, max_size, plans_.frames);
    if (!compiled.ok()) pool_->trim(plans_.frames, plans_.frames, *retired_);
    return compiled;
}

void Instance::retire(std::unique_ptr<CompiledPlan> plan) {
    plan->release();
    retired_->add(plans_.frames, std::move(plan));
}

Failure Instance::run(const ChainVersion& chain, const pc_vk_frame& given,
                      VkCommandBuffer commands) {
    if (!commands) return {PC_ERROR_ARGUMENT, "command_buffer is NULL"};
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    Plans::Entry* entry = nullptr;
    RETURN_IF_ERROR(find_or_make(chain, images.frame, entry));
    ++plans_.frames;
    retired_->begin(plans_.frames);
    plans_.run(*entry, chain, images.frame);
    import_frame(entry->host, images.frame, *entry->compiled);
    entry->compiled->record(commands, plans_.frames, images.views);
    plans_.forget_unused();
    if (last_kept() > 0) pool_->trim(last_kept(), plans_.frames, *retired_);
    return {};
}

Failure Instance::needs_of(const ChainVersion& chain, const pc_vk_frame& given,
                           pc_frame_needs& out) const {
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    ASSIGN_OR_RETURN(auto host, make_host_plan(*chain.chain, images.frame, plans_.device()));
    plans_.count_needs(host.plan, max_size(images.frame),
                       host_programs(*chain.chain, images.frame, host.plan, plans_.device()), out);
    return {};
}

}  // namespace postchain::vk
