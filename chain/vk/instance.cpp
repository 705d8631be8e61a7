#include "chain/vk/instance.h"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "chain/guest/frame_check.h"
#include "chain/guest/host_struct.h"

namespace postchain::vk {

using guest::ChainVersion;
using guest::Failure;
using guest::HostFrame;

namespace {

constexpr uint32_t kMaxRuns = 64;

void set_name(char (&to)[48], const std::string& name) {
    std::memset(to, 0, sizeof(to));
    std::strncpy(to, name.c_str(), sizeof(to) - 1);
}

HostMemory memory_of(const pc_vk_create_info& info) {
    if (!info.allocate_memory) return {};
    return {[info](const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                   MemoryPart& part) {
                pc_vk_memory made = {};
                const VkResult result = info.allocate_memory(info.user, &needs, properties, &made);
                part.memory = made.memory;
                part.offset = made.offset;
                part.mapped = static_cast<std::byte*>(made.mapped);
                part.owner = made.allocation;
                return result;
            },
            [info](const MemoryPart& part) {
                const pc_vk_memory given = {part.memory, part.offset, part.mapped, part.owner};
                info.free_memory(info.user, &given);
            }};
}

}  // namespace

Instance::Instance(const pc_vk_create_info& info) : InstanceBase(info) {
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
    if (!info_.allocate_memory != !info_.free_memory)
        return {PC_ERROR_ARGUMENT, "allocate_memory, free_memory: give both or neither"};
    RETURN_IF_ERROR(
        device_.open({info_.get_instance_proc_addr, info_.instance, info_.physical_device,
                      info_.device, info_.pipeline_cache, info_.queue_family, info_.allocator,
                      memory_of(info_), (info_.flags & PC_LABELS) != 0}));
    if ((info_.flags & PC_LABELS) != 0 && !device_.has_labels())
        log(PC_LOG_WARNING, "PC_LABELS has no effect: VK_EXT_debug_utils is not enabled");
    const uint32_t limit = device_.limits().maxImageDimension2D;
    if (info_.max_width == 0 || info_.max_height == 0 || info_.max_width > limit ||
        info_.max_height > limit)
        return {PC_ERROR_ARGUMENT,
                concat("max_width, max_height: ", info_.max_width, "x", info_.max_height,
                       "; give the largest frame, 1 to ", limit, " a side")};
    RETURN_IF_ERROR(sampler_.make(device_));
    retired_.emplace(runs_in_flight());
    clock_.emplace(device_, runs_in_flight());
    focus_.emplace(device_, runs_in_flight());
    ProgramSet set;
    if (info_.programs) {
        ASSIGN_OR_RETURN(set, ProgramSet::read({static_cast<const std::byte*>(info_.programs),
                                                info_.programs_size}));
    }
    programs_.emplace(device_, sampler_.handle(), set, guest::store_of(info_));
    pool_.emplace(device_, info_.texture_budget);
    ASSIGN_OR_RETURN(unused_, make_image(device_, {Format::rgba32f, 1, 1, 0}));
    return {};
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

Failure Instance::set_focus(const ChainVersion& chain, HostImages& images, bool runs) {
    const uint64_t run = plans_.frames + 1;
    if (runs) focus_->take_place(run);
    places_.clear();
    RETURN_IF_ERROR(guest::find_places(*chain.chain, places_));
    if (places_.empty()) return {};
    HostFrame& frame = images.frame;
    if (frame.depth.name) {
        RETURN_IF_ERROR(focus_->make_buffer());
        frame.focus_slot = int(run % runs_in_flight());
    }
    const double distance =
        chain.chain->camera.focus_distance.value_or(double(frame.given->focus_distance));
    frame.focus = runs ? &focus_->follow(chain.id, places_, *frame.given, distance, run)
                       : &focus_->now(chain.id, places_, run);
    return {};
}

Failure Instance::prepare(const ChainVersion& chain, const pc_vk_frame& given, bool wait) {
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    images.values = guest::with_neighbors_in_use(images.values);
    RETURN_IF_ERROR(check_frame(&images.values, images.frame, find_format));
    open_ = nullptr;
    RETURN_IF_ERROR(set_focus(chain, images, false));
    const HostFrame& frame = images.frame;
    const auto list = [&](const Plan& plan) {
        return host_programs(*chain.chain, frame, plan, plans_.device());
    };
    RETURN_IF_ERROR(plans_.compile_programs(chain, frame, wait, list));
    Plans::Entry* entry = nullptr;
    // If it fails, the frame is still prepared.
    if (const auto other = plans_.other_cut(frame)) (void)find_or_make(chain, other->frame, entry);
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
    const Objects objects{device_,          *pool_,   *programs_,
                          runs_in_flight(), *unused_, focus_->buffer()};
    auto compiled = CompiledPlan::make(std::move(plan), objects, max_size, plans_.frames);
    if (!compiled.ok()) pool_->trim(plans_.frames, plans_.frames, *retired_);
    return compiled;
}

void Instance::retire(std::unique_ptr<CompiledPlan> plan) {
    plan->release();
    retired_->add(plans_.frames, std::move(plan));
}

Failure Instance::begin_run(const ChainVersion& chain, HostImages& images, Plans::Entry*& entry) {
    RETURN_IF_ERROR(set_focus(chain, images, true));
    RETURN_IF_ERROR(find_or_make(chain, images.frame, entry));
    open_ = nullptr;
    ++plans_.frames;
    if (images.frame.focus_slot >= 0) focus_->begin(plans_.frames);
    retired_->begin(plans_.frames);
    plans_.run(*entry, chain, images.frame);
    import_frame(entry->host, images.frame, *entry->compiled);
    entry->compiled->begin_run(plans_.frames, images.views);
    return {};
}

void Instance::end_run() {
    plans_.forget_unused();
    if (last_kept() > 0) pool_->trim(last_kept(), plans_.frames, *retired_);
}

Failure Instance::run(const ChainVersion& chain, const pc_vk_frame& given,
                      VkCommandBuffer commands) {
    if (!commands) return {PC_ERROR_ARGUMENT, "command_buffer is NULL"};
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    Plans::Entry* entry = nullptr;
    RETURN_IF_ERROR(begin_run(chain, images, entry));
    CompiledPlan& plan = *entry->compiled;
    const Status timed =
        clock_->begin(commands, uint32_t(plans_.frames % runs_in_flight()),
                      images.values.frame_number, plan.steps(), timing_ > 0 && plan.steps() > 0);
    if (!timed.ok()) log(PC_LOG_WARNING, timed.message());
    plan.record(commands, *clock_, timing_ > 1);
    end_run();
    return {};
}

// The step's uses go to uses_, with their resources.
void Instance::list_uses(int step, const HostImages& images) {
    static constexpr const char* kHost[] = {
        "host.color",   "host.depth",     "host.motion",     "host.exposure", "before.color",
        "before.depth", "before.motion",  "before.exposure", "after.color",   "after.depth",
        "after.motion", "after.exposure", "host.mask",       "host.output"};
    static_assert(std::size(kHost) == std::tuple_size_v<HostViews>);
    found_.clear();
    open_->find_uses(step, found_);
    for (const CompiledPlan::Use& use : found_) {
        pc_vk_resource resource = {};
        if (use.image) {
            resource.image = use.image->image;
            resource.buffer = use.image->list.handle();
            set_name(resource.name, open_->plan().textures[size_t(use.texture)].name);
        } else {
            resource.view = images.views[use.name - 1].view;
            set_name(resource.name, kHost[use.name - 1]);
        }
        const auto known = std::ranges::find_if(resources_, [&](const pc_vk_resource& other) {
            return other.image == resource.image && other.buffer == resource.buffer &&
                   other.view == resource.view;
        });
        const auto index = uint32_t(known - resources_.begin());
        if (known == resources_.end()) resources_.push_back(resource);
        uses_.push_back({index, use.stages, use.access});
    }
}

Failure Instance::begin(const ChainVersion& chain, const pc_vk_frame& given, pc_vk_steps& steps) {
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    Plans::Entry* entry = nullptr;
    RETURN_IF_ERROR(begin_run(chain, images, entry));
    open_ = entry->compiled.get();
    resources_.clear();
    uses_.clear();
    dispatches_.clear();
    std::vector<size_t> first;
    const auto add = [&](const std::string& name, int step, uint32_t level) {
        pc_vk_dispatch made = {};
        set_name(made.name, name);
        made.level = level;
        first.push_back(uses_.size());
        list_uses(step, images);
        made.use_count = uint32_t(uses_.size() - first.back());
        dispatches_.push_back(made);
    };
    uint32_t level = 0;
    if (open_->steps() > 0) add("begin", -1, level++);
    for (size_t i = 0; i < open_->steps(); ++i) {
        if (open_->waits(i)) ++level;
        add(open_->plan().name_of(open_->plan().steps[i]), int(i), level);
    }
    for (size_t i = 0; i < dispatches_.size(); ++i) dispatches_[i].uses = uses_.data() + first[i];
    steps.resource_count = uint32_t(resources_.size());
    steps.dispatch_count = uint32_t(dispatches_.size());
    steps.resources = resources_.data();
    steps.dispatches = dispatches_.data();
    end_run();
    return {};
}

Failure Instance::record(uint32_t dispatch, VkCommandBuffer commands) {
    if (!commands) return {PC_ERROR_ARGUMENT, "command_buffer is NULL"};
    if (!open_)
        return {PC_ERROR_ARGUMENT, "pc_vk_begin() was not the last call that began or prepared"};
    if (dispatch >= dispatches_.size())
        return {PC_ERROR_ARGUMENT, concat("dispatch: ", dispatch, " of ", dispatches_.size())};
    device_.begin_label(commands, dispatches_[dispatch].name);
    if (dispatch == 0)
        open_->record_begin(commands);
    else
        open_->record_step(commands, dispatch - 1);
    device_.end_label(commands);
    return {};
}

void Instance::give_up() {
    pool_->forget_layouts();
    unused_->fresh = true;
    clock_->forget_runs();
    focus_->forget_runs();
}

Failure Instance::set_timing(int level) {
    if (level > 0 && device_.timestamp_bits() == 0)
        return {PC_ERROR_GL, "queue_family has no timestamps (timestampValidBits is 0)"};
    timing_ = level;
    return {};
}

Failure Instance::needs_of(const ChainVersion& chain, const pc_vk_frame& given,
                           pc_frame_needs& out) const {
    HostImages images;
    RETURN_IF_ERROR(check(given, images));
    guest::Depths places;
    RETURN_IF_ERROR(guest::find_places(*chain.chain, places));
    if (!places.empty()) {
        images.frame.focus = &places;
        images.frame.focus_slot = images.frame.depth.name ? 0 : -1;
    }
    ASSIGN_OR_RETURN(auto host, make_host_plan(*chain.chain, images.frame, plans_.device()));
    plans_.count_needs(host.plan, max_size(images.frame),
                       host_programs(*chain.chain, images.frame, host.plan, plans_.device()), out);
    return {};
}

}  // namespace postchain::vk
