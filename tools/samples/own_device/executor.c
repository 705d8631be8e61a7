#include "executor.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A plan beyond these ends the process. */
enum { MAX_FLIGHTS = 4, MAX_PROGRAMS = 512, MAX_SLOTS = 256, MAX_STEPS = 128 };
enum { UNIFORM_BYTES = 1 << 18, PROGRAM_WORDS = 1 << 18 };

/* One set layout for all programs: each kind's units from 0 (docs/programs.md). */
enum { TEXTURES = 16, IMAGES = 8, LISTS = 4, KINDS = 4, BINDINGS = TEXTURES + IMAGES + LISTS + 1 };
static const struct {
    uint32_t first, count; /* bindings */
    VkDescriptorType type;
} kinds[KINDS] = {{0, TEXTURES, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER},
                  {16, IMAGES, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE},
                  {32, LISTS, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
                  {48, 1, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER}};

typedef struct { /* a slot's texture or buffer; plans that need an equal one share it */
    pc_plan_slot is;
    VkImage image;
    VkImageView view;
    VkBuffer buffer;
    VkDeviceMemory memory;
    int fresh; /* the image is in VK_IMAGE_LAYOUT_UNDEFINED */
} Slot;
typedef struct { /* of a frame in flight */
    VkDescriptorSet sets[MAX_STEPS];
    VkBuffer uniforms;
    VkDeviceMemory memory;
    void* mapped;
} Flight;
struct Executor {
    ExecutorInfo info;
    VkSampler sampler;
    VkDescriptorSetLayout set_layout;
    VkDescriptorPool pool;
    VkPipelineLayout layout;
    uint64_t keys[MAX_PROGRAMS];
    VkPipeline pipelines[MAX_PROGRAMS];
    Slot slots[MAX_SLOTS];
    Flight flights[MAX_FLIGHTS];
    uint32_t program_count, slot_count;
    uint64_t shape;           /* of the plan that `of` is for */
    uint32_t of[MAX_SLOTS];   /* the index of each slot of that plan in `slots` */
    Slot unused, unused_list; /* bound to units that a step has no texture for */
};

static void check(VkResult result, const char* what) {
    if (result == VK_SUCCESS) return;
    fprintf(stderr, "%s: VkResult %d\n", what, (int)result);
    exit(1);
}
static void check_room(uint64_t needed, uint64_t room, const char* what) {
    if (needed > room) check(VK_ERROR_OUT_OF_POOL_MEMORY, what);
}

static VkDeviceMemory allocate(const Executor* e, VkMemoryRequirements needs, uint32_t properties) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(e->info.physical, &memory);
    uint32_t type = 0;
    while (!(needs.memoryTypeBits >> type & 1) ||
           (memory.memoryTypes[type].propertyFlags & properties) != properties)
        ++type;
    VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                 .allocationSize = needs.size,
                                 .memoryTypeIndex = type};
    VkDeviceMemory made;
    check(vkAllocateMemory(e->info.device, &info, NULL, &made), "vkAllocateMemory");
    return made;
}
static VkBuffer make_buffer(const Executor* e, uint64_t size, VkBufferUsageFlags usage,
                            uint32_t properties, VkDeviceMemory* memory) {
    VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = usage};
    VkBuffer made;
    check(vkCreateBuffer(e->info.device, &info, NULL, &made), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(e->info.device, made, &needs);
    *memory = allocate(e, needs, properties);
    check(vkBindBufferMemory(e->info.device, made, *memory, 0), "vkBindBufferMemory");
    return made;
}

static VkFormat format_of(pc_format format) {
    static const VkFormat of[] = {
        [PC_FORMAT_RGBA32F] = VK_FORMAT_R32G32B32A32_SFLOAT,
        [PC_FORMAT_RGBA16F] = VK_FORMAT_R16G16B16A16_SFLOAT,
        [PC_FORMAT_RG32F] = VK_FORMAT_R32G32_SFLOAT,
        [PC_FORMAT_RG16F] = VK_FORMAT_R16G16_SFLOAT,
        [PC_FORMAT_R32F] = VK_FORMAT_R32_SFLOAT,
        [PC_FORMAT_R16F] = VK_FORMAT_R16_SFLOAT,
        [PC_FORMAT_RGBA8] = VK_FORMAT_R8G8B8A8_UNORM,
        [PC_FORMAT_RG8] = VK_FORMAT_R8G8_UNORM,
        [PC_FORMAT_R8] = VK_FORMAT_R8_UNORM,
        [PC_FORMAT_RGBA32UI] = VK_FORMAT_R32G32B32A32_UINT,
        [PC_FORMAT_R32UI] = VK_FORMAT_R32_UINT,
    };
    return of[format];
}

static Slot make_slot(const Executor* e, const pc_plan_slot* is) {
    Slot made = {.is = *is};
    if (is->format == PC_FORMAT_LIST) {
        made.buffer =
            make_buffer(e, is->bytes,
                        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                            VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                        0, &made.memory);
        return made;
    }
    const uint32_t slices = is->slices ? is->slices : 1;
    VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                              .imageType = VK_IMAGE_TYPE_2D,
                              .format = format_of(is->format),
                              .extent = {is->width, is->height, 1},
                              .mipLevels = 1,
                              .arrayLayers = slices,
                              .samples = VK_SAMPLE_COUNT_1_BIT,
                              .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT};
    check(vkCreateImage(e->info.device, &info, NULL, &made.image), "vkCreateImage");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(e->info.device, made.image, &needs);
    made.memory = allocate(e, needs, 0);
    check(vkBindImageMemory(e->info.device, made.image, made.memory, 0), "vkBindImageMemory");
    VkImageViewCreateInfo view = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
        .image = made.image,
        .viewType = is->slices ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D,
        .format = info.format,
        .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, slices}};
    check(vkCreateImageView(e->info.device, &view, NULL, &made.view), "vkCreateImageView");
    made.fresh = 1;
    return made;
}
static void free_slot(const Executor* e, const Slot* slot) {
    vkDestroyImageView(e->info.device, slot->view, NULL);
    vkDestroyImage(e->info.device, slot->image, NULL);
    vkDestroyBuffer(e->info.device, slot->buffer, NULL);
    vkFreeMemory(e->info.device, slot->memory, NULL);
}

/* A plan of a new shape takes equal textures of earlier ones, because one runs after the other. */
static void take_slots(Executor* e, const pc_plan* plan) {
    if (e->shape == plan->shape) return;
    e->shape = plan->shape;
    check_room(e->slot_count + plan->slot_count, MAX_SLOTS, "MAX_SLOTS");
    for (uint32_t s = 0; s < plan->slot_count; ++s) {
        uint32_t at = 0, earlier;
        for (;; ++at) {
            if (at < e->slot_count &&
                memcmp(&e->slots[at].is, &plan->slots[s], sizeof(pc_plan_slot)))
                continue;
            for (earlier = 0; earlier < s && e->of[earlier] != at;) ++earlier;
            if (earlier == s) break; /* no earlier slot of this plan has it */
        }
        if (at == e->slot_count) e->slots[e->slot_count++] = make_slot(e, &plan->slots[s]);
        e->of[s] = at;
    }
}

static void make_flight(const Executor* e, Flight* f) {
    f->uniforms = make_buffer(
        e, UNIFORM_BYTES, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, &f->memory);
    check(vkMapMemory(e->info.device, f->memory, 0, VK_WHOLE_SIZE, 0, &f->mapped), "vkMapMemory");
    VkDescriptorSetAllocateInfo set = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                       .descriptorPool = e->pool,
                                       .descriptorSetCount = 1,
                                       .pSetLayouts = &e->set_layout};
    for (uint32_t s = 0; s < MAX_STEPS; ++s)
        check(vkAllocateDescriptorSets(e->info.device, &set, &f->sets[s]), "a descriptor set");
}

Executor* executor_create(const ExecutorInfo* info) {
    Executor* e = calloc(1, sizeof(*e));
    if (!e) check(VK_ERROR_OUT_OF_HOST_MEMORY, "calloc");
    e->info = *info;
    check_room(info->frames_in_flight, MAX_FLIGHTS, "MAX_FLIGHTS");
    /* Nearest, and clamped to the edge. */
    VkSamplerCreateInfo sampler = {.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                   .addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                   .addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                   .addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                   .maxLod = VK_LOD_CLAMP_NONE};
    check(vkCreateSampler(info->device, &sampler, NULL, &e->sampler), "vkCreateSampler");
    const uint32_t sets = info->frames_in_flight * MAX_STEPS;
    VkDescriptorSetLayoutBinding bindings[BINDINGS], *next = bindings;
    VkDescriptorPoolSize sizes[KINDS];
    for (int k = 0; k < KINDS; ++k) {
        sizes[k] = (VkDescriptorPoolSize){kinds[k].type, sets * kinds[k].count};
        for (uint32_t unit = 0; unit < kinds[k].count; ++unit)
            *next++ = (VkDescriptorSetLayoutBinding){kinds[k].first + unit, kinds[k].type, 1,
                                                     VK_SHADER_STAGE_COMPUTE_BIT, NULL};
    }
    VkDescriptorSetLayoutCreateInfo set = {
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = BINDINGS,
        .pBindings = bindings};
    check(vkCreateDescriptorSetLayout(info->device, &set, NULL, &e->set_layout), "a set's layout");
    VkDescriptorPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                       .maxSets = sets,
                                       .poolSizeCount = KINDS,
                                       .pPoolSizes = sizes};
    check(vkCreateDescriptorPool(info->device, &pool, NULL, &e->pool), "vkCreateDescriptorPool");
    VkPushConstantRange first_group = {VK_SHADER_STAGE_COMPUTE_BIT, 0, 8};
    VkPipelineLayoutCreateInfo layout = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                         .setLayoutCount = 1,
                                         .pSetLayouts = &e->set_layout,
                                         .pushConstantRangeCount = 1,
                                         .pPushConstantRanges = &first_group};
    check(vkCreatePipelineLayout(info->device, &layout, NULL, &e->layout), "a pipeline's layout");
    for (uint32_t i = 0; i < info->frames_in_flight; ++i) make_flight(e, &e->flights[i]);
    e->unused = make_slot(e, &(pc_plan_slot){PC_FORMAT_RGBA32F, 1, 1, 0, 16, 0, 0});
    e->unused_list = make_slot(e, &(pc_plan_slot){PC_FORMAT_LIST, 1, 1, 0, 16, 0, 0});
    return e;
}

static VkShaderModule read_module(const Executor* e, uint64_t key) {
    static uint32_t words[PROGRAM_WORDS];
    char path[4096];
    snprintf(path, sizeof(path), "%s/%016" PRIx64 ".spv", e->info.programs, key);
    FILE* file = fopen(path, "rb");
    const size_t count = file ? fread(words, 4, PROGRAM_WORDS, file) : 0;
    if (count == 0) {
        fprintf(stderr, "%s cannot be read; write it by postchain-programs for this chain\n", path);
        exit(1);
    }
    fclose(file);
    check_room(count + 1, PROGRAM_WORDS, "PROGRAM_WORDS");
    VkShaderModuleCreateInfo info = {.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                     .codeSize = 4 * count,
                                     .pCode = words};
    VkShaderModule made;
    check(vkCreateShaderModule(e->info.device, &info, NULL, &made), path);
    return made;
}

static VkPipeline find(const Executor* e, uint64_t key) {
    for (uint32_t p = 0; p < e->program_count; ++p)
        if (e->keys[p] == key) return e->pipelines[p];
    return VK_NULL_HANDLE;
}

void executor_prepare(Executor* e, const uint64_t* keys, uint32_t count) {
    for (uint32_t k = 0; k < count; ++k) {
        if (find(e, keys[k])) continue;
        const uint32_t at = e->program_count++;
        check_room(e->program_count, MAX_PROGRAMS, "MAX_PROGRAMS");
        VkShaderModule module = read_module(e, keys[k]);
        VkComputePipelineCreateInfo info = {
            .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
            .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                      .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                      .module = module,
                      .pName = "main"},
            .layout = e->layout};
        e->keys[at] = keys[k];
        check(vkCreateComputePipelines(e->info.device, VK_NULL_HANDLE, 1, &info, NULL,
                                       &e->pipelines[at]),
              "vkCreateComputePipelines");
        vkDestroyShaderModule(e->info.device, module, NULL);
    }
}

static void write_set(const Executor* e, const Flight* f, const pc_plan* plan, uint32_t s,
                      const HostView* views) {
    const pc_plan_step* step = &plan->steps[s];
    VkDescriptorImageInfo images[TEXTURES + IMAGES];
    VkDescriptorBufferInfo buffers[LISTS + 1];
    for (int i = 0; i < TEXTURES + IMAGES; ++i)
        images[i] = (VkDescriptorImageInfo){e->sampler, e->unused.view, VK_IMAGE_LAYOUT_GENERAL};
    for (int i = 0; i < LISTS; ++i)
        buffers[i] = (VkDescriptorBufferInfo){e->unused_list.buffer, 0, VK_WHOLE_SIZE};
    buffers[LISTS] = (VkDescriptorBufferInfo){f->uniforms, step->uniform_offset,
                                              step->uniform_bytes ? step->uniform_bytes : 16};
    for (uint32_t i = 0; i < step->binding_count; ++i) {
        const pc_plan_binding* binding = &step->bindings[i];
        const pc_plan_texture* texture = &plan->textures[binding->texture];
        VkDescriptorImageInfo* image =
            &images[binding->kind == PC_PLAN_UNIT_IMAGE ? TEXTURES + binding->unit : binding->unit];
        if (binding->kind == PC_PLAN_UNIT_LIST) {
            buffers[binding->unit].buffer = e->slots[e->of[texture->slot]].buffer;
        } else if (texture->host) {
            image->imageView = views[texture->host - 1].view;
            image->imageLayout = views[texture->host - 1].layout;
        } else {
            image->imageView = e->slots[e->of[texture->slot]].view;
        }
    }
    VkWriteDescriptorSet writes[KINDS];
    for (int k = 0; k < KINDS; ++k)
        writes[k] = (VkWriteDescriptorSet){.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                           .dstSet = f->sets[s],
                                           .dstBinding = kinds[k].first,
                                           .descriptorCount = kinds[k].count,
                                           .descriptorType = kinds[k].type,
                                           .pImageInfo = k == 0 ? images : images + TEXTURES,
                                           .pBufferInfo = k == 2 ? buffers : buffers + LISTS};
    vkUpdateDescriptorSets(e->info.device, KINDS, writes, 0, NULL);
}

/* After everything that this queue did before: the storage is that of earlier frames. */
static void begin(Executor* e, VkCommandBuffer commands, const pc_plan* plan) {
    const VkPipelineStageFlags before = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT |
                                        VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT |
                                        VK_PIPELINE_STAGE_TRANSFER_BIT;
    const VkPipelineStageFlags after =
        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    const VkAccessFlags shader = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
    VkMemoryBarrier memory = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
        .srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT,
        .dstAccessMask = shader | VK_ACCESS_TRANSFER_WRITE_BIT};
    vkCmdPipelineBarrier(commands, before, after, 0, 1, &memory, 0, NULL, 0, NULL);
    for (uint32_t s = 0; s <= e->slot_count; ++s) {
        Slot* slot = s < e->slot_count ? &e->slots[s] : &e->unused;
        if (!slot->fresh) continue;
        slot->fresh = 0;
        VkImageMemoryBarrier image = {
            .sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
            .dstAccessMask = shader,
            .oldLayout = VK_IMAGE_LAYOUT_UNDEFINED,
            .newLayout = VK_IMAGE_LAYOUT_GENERAL,
            .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .image = slot->image,
            .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS}};
        vkCmdPipelineBarrier(commands, before, after, 0, 0, NULL, 0, NULL, 1, &image);
    }
    for (uint32_t s = 0; s < plan->slot_count; ++s)
        if (plan->slots[s].zero_bytes)
            vkCmdFillBuffer(commands, e->slots[e->of[s]].buffer, 0, plan->slots[s].zero_bytes, 0);
}

/* The words of a barrier as Vulkan's. */
static void add(pc_plan_uses uses, VkPipelineStageFlags* stages, VkAccessFlags* access) {
    if (uses & ~(pc_plan_uses)PC_PLAN_ZEROED) *stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    if (uses & PC_PLAN_INDIRECT) *stages |= VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
    if (uses & PC_PLAN_ZEROED) *stages |= VK_PIPELINE_STAGE_TRANSFER_BIT;
    if (uses & (PC_PLAN_SAMPLED | PC_PLAN_IMAGE_READ | PC_PLAN_LIST_READ | PC_PLAN_LIST_WRITE))
        *access |= VK_ACCESS_SHADER_READ_BIT;
    if (uses & (PC_PLAN_IMAGE_WRITE | PC_PLAN_LIST_WRITE)) *access |= VK_ACCESS_SHADER_WRITE_BIT;
    if (uses & PC_PLAN_INDIRECT) *access |= VK_ACCESS_INDIRECT_COMMAND_READ_BIT;
    if (uses & PC_PLAN_ZEROED) *access |= VK_ACCESS_TRANSFER_WRITE_BIT;
}
static void wait(VkCommandBuffer commands, pc_plan_uses from, pc_plan_uses to) {
    VkPipelineStageFlags before = 0, after = 0;
    VkMemoryBarrier memory = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    add(from, &before, &memory.srcAccessMask);
    add(to, &after, &memory.dstAccessMask);
    vkCmdPipelineBarrier(commands, before, after, 0, 1, &memory, 0, NULL, 0, NULL);
}

void executor_record(Executor* e, VkCommandBuffer commands, uint32_t in_flight, const pc_plan* plan,
                     const HostView* views) {
    if (plan->step_count == 0) return;
    Flight* f = &e->flights[in_flight];
    take_slots(e, plan);
    check_room(plan->step_count, MAX_STEPS, "MAX_STEPS");
    check_room(plan->uniform_bytes + 16, UNIFORM_BYTES, "UNIFORM_BYTES");
    memcpy(f->mapped, plan->uniforms, plan->uniform_bytes);
    begin(e, commands, plan);
    for (uint32_t i = 0; i < plan->step_count; ++i) {
        const pc_plan_step* step = &plan->steps[i];
        /* Images stay in VK_IMAGE_LAYOUT_GENERAL: one barrier of memory for all textures. begin()
         * has waited for earlier frames (from = 0). */
        pc_plan_uses from = 0, to = 0;
        for (uint32_t b = 0; b < step->barrier_count; ++b) {
            from |= step->barriers[b].from;
            if (step->barriers[b].from) to |= step->barriers[b].to;
        }
        if (from) wait(commands, from, to);
        write_set(e, f, plan, i, views);
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, find(e, step->program));
        vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, e->layout, 0, 1,
                                &f->sets[i], 0, NULL);
        if (step->list != PC_PLAN_NONE) {
            static const uint32_t none[2] = {0, 0};
            const uint32_t slot = plan->textures[step->list].slot;
            vkCmdPushConstants(commands, e->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, 8, none);
            vkCmdDispatchIndirect(commands, e->slots[e->of[slot]].buffer, 0);
        }
        for (uint32_t d = 0; d < step->dispatch_count; ++d) {
            const pc_plan_dispatch* one = &step->dispatches[d];
            if (d > 0 && step->bands_wait)
                wait(commands, PC_PLAN_IMAGE_WRITE, PC_PLAN_SAMPLED | PC_PLAN_IMAGE_WRITE);
            vkCmdPushConstants(commands, e->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, 8,
                               one->first_group);
            vkCmdDispatch(commands, one->groups[0], one->groups[1], one->groups[2]);
        }
    }
}

void executor_forget_storage(Executor* e) {
    for (uint32_t s = 0; s < e->slot_count; ++s) free_slot(e, &e->slots[s]);
    e->slot_count = 0;
    e->shape = 0;
}

void executor_destroy(Executor* e) {
    const VkDevice device = e->info.device;
    executor_forget_storage(e);
    free_slot(e, &e->unused);
    free_slot(e, &e->unused_list);
    for (uint32_t p = 0; p < e->program_count; ++p)
        vkDestroyPipeline(device, e->pipelines[p], NULL);
    for (uint32_t i = 0; i < e->info.frames_in_flight; ++i) {
        vkDestroyBuffer(device, e->flights[i].uniforms, NULL);
        vkFreeMemory(device, e->flights[i].memory, NULL);
    }
    vkDestroyDescriptorPool(device, e->pool, NULL);
    vkDestroyPipelineLayout(device, e->layout, NULL);
    vkDestroyDescriptorSetLayout(device, e->set_layout, NULL);
    vkDestroySampler(device, e->sampler, NULL);
    free(e);
}
