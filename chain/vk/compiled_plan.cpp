#include "chain/vk/compiled_plan.h"

#include <algorithm>
#include <cstring>

#include "chain/plan/bands.h"
#include "chain/plan/hazards.h"
#include "chain/vk/format.h"

namespace postchain::vk {
namespace {

constexpr VkPipelineStageFlags kCompute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
constexpr VkPipelineStageFlags kLaunch = VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
constexpr VkPipelineStageFlags kTransfer = VK_PIPELINE_STAGE_TRANSFER_BIT;
constexpr VkAccessFlags kShader = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;

VkMemoryBarrier barrier(VkAccessFlags from, VkAccessFlags to) {
    auto made = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
    made.srcAccessMask = from;
    made.dstAccessMask = to;
    return made;
}

Kind kind_of(Access access) {
    switch (access) {
        case Access::list:
            return Kind::list;
        case Access::read:
        case Access::write:
            return Kind::image;
        case Access::sample_nearest:
            break;
    }
    return Kind::texture;
}

// The binding of a program's unit; -1: the step has none.
TextureId texture_at(const Step& step, const Unit& unit) {
    for (const Binding& binding : step.bindings)
        if (kind_of(binding.access) == unit.kind && uint32_t(binding.unit) == unit.number)
            return binding.texture;
    return unit.kind == Kind::list && unit.number == 0 ? step.work_list : -1;
}

Status check_units(const Step& step, const Program& program) {
    for (const Unit& unit : program.units) {
        if (unit.kind == Kind::uniforms ? !step.uniforms.empty()
                                        : unit.plain || texture_at(step, unit) >= 0)
            continue;
        return Status(StatusCode::internal, concat("unit ", unit.number, " is not bound"));
    }
    return Status();
}

}  // namespace

Result<std::unique_ptr<CompiledPlan>> CompiledPlan::make(Plan plan, const Objects& objects,
                                                         const MaxFrameSize& max_size,
                                                         uint64_t run) {
    std::unique_ptr<CompiledPlan> made(new CompiledPlan(std::move(plan), objects));
    RETURN_IF_ERROR(made->take_programs());
    RETURN_IF_ERROR(made->take_images(max_size, run));
    RETURN_IF_ERROR(made->make_uniforms());
    RETURN_IF_ERROR(made->make_sets());
    return made;
}

CompiledPlan::CompiledPlan(Plan plan, const Objects& objects)
    : PlanValues(std::move(plan),
                 std::max<size_t>(objects.device.limits().minUniformBufferOffsetAlignment, 16)),
      objects_(objects) {}

CompiledPlan::~CompiledPlan() {
    release();
    const Device& device = objects_.device;
    device.fn().DestroyDescriptorPool(device.handle(), sets_pool_, device.allocator());
}

void CompiledPlan::release() {
    for (Image* image : images_) --image->plans;
    images_.clear();
}

Status CompiledPlan::take_programs() {
    for (const Step& step : plan().steps) {
        if (step.first_layer != 0)
            return Status(StatusCode::internal,
                          plan().name_of(step) + ": a host's frame has one layer at most");
        ASSIGN_OR_RETURN(const auto program, objects_.programs.get(step.program));
        Command command;
        command.program = program;
        for (const Binding& binding : step.bindings) {
            command.imports |= plan().textures[size_t(binding.texture)].imported;
            command.to_host |= is_to_host(binding.texture);
        }
        if (Status s = check_units(step, *program); !s.ok()) return s.at(plan().name_of(step));
        commands_.push_back(command);
    }
    return Status();
}

Status CompiledPlan::take_images(const MaxFrameSize& max_size, uint64_t run) {
    const size_t count = plan().textures.size();
    const StoragePlan shared = share_storage(plan(), max_size);
    ASSIGN_OR_RETURN(images_, objects_.pool.acquire(shared.all, run));
    names_.assign(count, 0);
    image_of_.assign(count, nullptr);
    storage_ = shared.numbers();
    for (size_t t = 0; t < count; ++t) {
        if (shared.of[t] >= 0) image_of_[t] = images_[size_t(shared.of[t])];
        if (is_to_host(TextureId(t))) image_of_[t] = &objects_.to_host;
    }
    find_barriers();
    return Status();
}

Status CompiledPlan::make_uniforms() {
    if (bytes().empty()) return Status();
    ASSIGN_OR_RETURN(
        uniforms_,
        Buffer::make(objects_.device, bytes().size() * objects_.runs_in_flight,
                     VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                     VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
                     "postchain uniform blocks"));
    return Status();
}

Status CompiledPlan::make_sets() {
    if (commands_.empty()) return Status();
    const Device& device = objects_.device;
    const uint32_t runs = objects_.runs_in_flight;
    std::array<uint32_t, 4> units = {};
    for (const Command& command : commands_)
        for (const Unit& unit : command.program->units) units[size_t(unit.kind)] += runs;
    const VkDescriptorType types[] = {
        VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
        VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC};
    std::vector<VkDescriptorPoolSize> sizes;
    for (size_t kind = 0; kind < units.size(); ++kind)
        if (units[kind] > 0) sizes.push_back({types[kind], units[kind]});
    auto info = info_of<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    info.maxSets = uint32_t(commands_.size()) * runs;
    info.poolSizeCount = uint32_t(sizes.size());
    info.pPoolSizes = sizes.data();
    RETURN_IF_ERROR(status_of(
        device.fn().CreateDescriptorPool(device.handle(), &info, device.allocator(), &sets_pool_),
        "vkCreateDescriptorPool"));
    std::vector<VkDescriptorSetLayout> layouts;
    for (uint32_t run = 0; run < runs; ++run)
        for (const Command& command : commands_) layouts.push_back(command.program->set);
    sets_.resize(layouts.size());
    auto sets =
        info_of<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    sets.descriptorPool = sets_pool_;
    sets.descriptorSetCount = uint32_t(layouts.size());
    sets.pSetLayouts = layouts.data();
    RETURN_IF_ERROR(
        status_of(device.fn().AllocateDescriptorSets(device.handle(), &sets, sets_.data()),
                  "vkAllocateDescriptorSets"));
    for (size_t i = 0; i < sets_.size(); ++i) {
        const size_t step = i % commands_.size();
        if (!commands_[step].imports) write_set(step, sets_[i], HostViews());
    }
    return Status();
}

bool CompiledPlan::holds_unused(uint64_t last_used) const {
    return std::any_of(images_.begin(), images_.end(),
                       [&](const Image* image) { return image->last_used <= last_used; });
}

void CompiledPlan::find_barriers() {
    const std::vector<uint32_t> waits = waits_of(plan(), storage_);
    barriers_ = 0;
    for (size_t i = 0; i < waits.size(); ++i) {
        commands_[i].waits = waits[i];
        barriers_ += (waits[i] != 0) + commands_[i].to_host;
    }
}

void CompiledPlan::write_set(size_t index, VkDescriptorSet set, const HostViews& views) const {
    const Step& step = plan().steps[index];
    constexpr size_t kMaxWrites = 4 * kUnitsOfAKind;
    std::array<VkWriteDescriptorSet, kMaxWrites> writes;
    std::array<VkDescriptorImageInfo, kMaxWrites> images;
    std::array<VkDescriptorBufferInfo, kMaxWrites> buffers;
    uint32_t count = 0;
    for (const Unit& unit : commands_[index].program->units) {
        auto& write = writes[count];
        auto& image = images[count] = {};
        auto& buffer = buffers[count] = {};
        ++count;
        write = info_of<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
        write.dstSet = set;
        write.dstBinding = binding_of(unit.kind, unit.number);
        write.descriptorCount = 1;
        if (unit.kind == Kind::uniforms) {
            write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC;
            buffer = {uniforms_.handle(), 0, block(index).bytes};
            write.pBufferInfo = &buffer;
            continue;
        }
        const TextureId texture = texture_at(step, unit);
        const Image* own = texture < 0 ? &objects_.unused : image_of_[size_t(texture)];
        if (unit.kind == Kind::list) {
            write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
            buffer = {own->list.handle(), 0, VK_WHOLE_SIZE};
            write.pBufferInfo = &buffer;
            continue;
        }
        write.descriptorType = unit.kind == Kind::image ? VK_DESCRIPTOR_TYPE_STORAGE_IMAGE
                                                        : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
        write.pImageInfo = &image;
        image.imageView = own ? own->view : views[names_[size_t(texture)] - 1].view;
        image.imageLayout =
            own ? VK_IMAGE_LAYOUT_GENERAL : views[names_[size_t(texture)] - 1].layout;
    }
    objects_.device.fn().UpdateDescriptorSets(objects_.device.handle(), count, writes.data(), 0,
                                              nullptr);
}

// The sets of a slot whose last run is over.
void CompiledPlan::write_sets(uint32_t slot, const HostViews& views) {
    // Even if the handles are those of the last run: a host may have destroyed a view, and a driver
    // may give its handle to another.
    for (size_t i = 0; i < commands_.size(); ++i)
        if (commands_[i].imports) write_set(i, sets_[slot * commands_.size() + i], views);
}

// After the runs before, which are the same images' last users. New images get the layout in which
// they stay. Without `waits` the host has synchronized with the runs before.
void CompiledPlan::begin(VkCommandBuffer commands, bool waits) const {
    const Functions& fn = objects_.device.fn();
    constexpr VkPipelineStageFlags kBefore = kCompute | kLaunch | kTransfer;
    const VkMemoryBarrier memory =
        barrier(VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT,
                kShader | VK_ACCESS_TRANSFER_WRITE_BIT);
    constexpr size_t kAtOnce = 16;
    std::array<VkImageMemoryBarrier, kAtOnce> images;
    uint32_t count = 0;
    const auto send = [&] {
        fn.CmdPipelineBarrier(commands, kBefore, kCompute | kTransfer, 0, 1, &memory, 0, nullptr,
                              count, images.data());
        count = 0;
        waits = false;
    };
    const auto make_general = [&](Image& image) {
        if (!image.fresh || image.storage.format == Format::work_list) return;
        if (count == kAtOnce) send();
        auto& one = images[count++];
        one = info_of<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
        one.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
        one.dstAccessMask = kShader;
        one.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
        one.newLayout = VK_IMAGE_LAYOUT_GENERAL;
        one.srcQueueFamilyIndex = one.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        one.image = image.image;
        one.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS};
        image.fresh = false;
    };
    make_general(objects_.unused);
    for (Image* image : images_) make_general(*image);
    if (waits || count > 0) send();
}

// False if the plan has none.
bool CompiledPlan::empty_lists(VkCommandBuffer commands) const {
    bool lists = false;
    for (const Image* image : images_) {
        if (image->storage.format != Format::work_list) continue;
        objects_.device.fn().CmdFillBuffer(commands, image->list.handle(), 0, kWorkListHeaderBytes,
                                           0);
        lists = true;
    }
    return lists;
}

void CompiledPlan::wait(VkCommandBuffer commands, uint32_t waits) const {
    const bool launch = (waits & kWaitLaunch) != 0;
    const VkMemoryBarrier memory =
        barrier(VK_ACCESS_SHADER_WRITE_BIT,
                launch ? kShader | VK_ACCESS_INDIRECT_COMMAND_READ_BIT : kShader);
    objects_.device.fn().CmdPipelineBarrier(commands, kCompute,
                                            launch ? kCompute | kLaunch : kCompute, 0, 1, &memory,
                                            0, nullptr, 0, nullptr);
}

void CompiledPlan::dispatch(VkCommandBuffer commands, const Step& step,
                            const Program& program) const {
    const Functions& fn = objects_.device.fn();
    const auto push = [&](const std::array<unsigned, 2>& first_group) {
        fn.CmdPushConstants(commands, program.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushedBytes,
                            first_group.data());
    };
    Launch launch = launch_of(plan(), step);
    if (launch.by_list) {
        push({0, 0});
        fn.CmdDispatchIndirect(commands, image_of_[size_t(step.work_list)]->list.handle(), 0);
        return;
    }
    const bool waits = bands_wait(step);
    while (launch.bands.more()) {
        const Band band = launch.next();
        if (waits && band.first != std::array{0u, 0u}) wait(commands, 0);
        push(band.first);
        fn.CmdDispatch(commands, band.count[0], band.count[1], uint32_t(step.groups[2]));
    }
}

void CompiledPlan::begin_run(uint64_t run, const HostViews& views) {
    if (commands_.empty()) return;
    if (share_imports(plan(), names_, storage_)) find_barriers();
    for (Image* image : images_) image->last_used = run;
    const auto slot = uint32_t(run % objects_.runs_in_flight);
    write_sets(slot, views);
    const size_t offset = slot * bytes().size();
    if (!bytes().empty()) std::memcpy(uniforms_.mapped() + offset, bytes().data(), bytes().size());
    slot_ = slot;
    offset_ = offset;
}

void CompiledPlan::record_begin(VkCommandBuffer commands) {
    if (commands_.empty()) return;
    begin(commands, false);
    empty_lists(commands);
}

void CompiledPlan::record_step(VkCommandBuffer commands, size_t step) {
    const Functions& fn = objects_.device.fn();
    const Program& program = *commands_[step].program;
    fn.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.pipeline);
    const bool has_block =
        std::any_of(program.units.begin(), program.units.end(),
                    [](const Unit& unit) { return unit.kind == Kind::uniforms; });
    const auto place = uint32_t(offset_ + block(step).offset);
    fn.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, program.layout, 0, 1,
                             &sets_[slot_ * commands_.size() + step], has_block ? 1 : 0, &place);
    dispatch(commands, plan().steps[step], program);
    if (!commands_[step].to_host) return;
    const VkMemoryBarrier memory = barrier(VK_ACCESS_SHADER_WRITE_BIT, VK_ACCESS_HOST_READ_BIT);
    fn.CmdPipelineBarrier(commands, kCompute, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &memory, 0, nullptr,
                          0, nullptr);
}

void CompiledPlan::record(VkCommandBuffer commands, Clock& clock, bool by_step) {
    if (commands_.empty()) return;
    const Device& device = objects_.device;
    const auto begin_lists = [&] {
        if (!empty_lists(commands)) return;
        const VkMemoryBarrier filled =
            barrier(VK_ACCESS_TRANSFER_WRITE_BIT, kShader | VK_ACCESS_INDIRECT_COMMAND_READ_BIT);
        device.fn().CmdPipelineBarrier(commands, kTransfer, kCompute | kLaunch, 0, 1, &filled, 0,
                                       nullptr, 0, nullptr);
    };
    begin(commands, true);
    begin_lists();
    for (size_t i = 0; i < commands_.size(); ++i) {
        const Command& command = commands_[i];
        const Step& step = plan().steps[i];
        if (command.waits) wait(commands, command.waits);
        if (device.has_labels()) device.begin_label(commands, plan().name_of(step));
        record_step(commands, i);
        if (device.has_labels()) device.end_label(commands);
        if (by_step)
            clock.mark(commands, step.pass, plan().name_of(step));
        else if (i + 1 == commands_.size() || plan().steps[i + 1].pass != step.pass)
            clock.mark(commands, step.pass, plan().passes[size_t(step.pass)].type);
    }
}

void CompiledPlan::find_uses(int index, std::vector<Use>& uses) const {
    const auto add = [&](TextureId texture, VkPipelineStageFlags stages, VkAccessFlags access) {
        const Image* image = image_of_[size_t(texture)];
        const unsigned name = image ? 0 : names_[size_t(texture)];
        const auto known = std::find_if(uses.begin(), uses.end(), [&](const Use& use) {
            return use.image == image && use.name == name;
        });
        if (known == uses.end())
            uses.push_back({image, name, texture, stages, access});
        else
            known->stages |= stages, known->access |= access;
    };
    if (index < 0) {
        for (size_t t = 0; t < image_of_.size(); ++t)
            if (image_of_[t] && image_of_[t]->storage.format == Format::work_list &&
                !is_to_host(TextureId(t)))
                add(TextureId(t), kTransfer, VK_ACCESS_TRANSFER_WRITE_BIT);
        return;
    }
    const Step& step = plan().steps[size_t(index)];
    for (const Binding& binding : step.bindings) {
        const uint32_t how = uses_of(step, binding);
        VkAccessFlags access = 0;
        if (how & ~kUseImageWrite) access |= VK_ACCESS_SHADER_READ_BIT;
        if (how & kUseWrites) access |= VK_ACCESS_SHADER_WRITE_BIT;
        if (how & kUseLaunch) access |= VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
        add(binding.texture, how & kUseLaunch ? kCompute | kLaunch : kCompute, access);
    }
}

}  // namespace postchain::vk
