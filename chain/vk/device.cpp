#include "chain/vk/device.h"

#include <utility>
#include <vector>

namespace postchain::vk {
namespace {

const char* name_of(VkResult result) {
    switch (result) {
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            return "VK_ERROR_OUT_OF_HOST_MEMORY";
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
            return "VK_ERROR_OUT_OF_DEVICE_MEMORY";
        case VK_ERROR_DEVICE_LOST:
            return "VK_ERROR_DEVICE_LOST";
        case VK_ERROR_TOO_MANY_OBJECTS:
            return "VK_ERROR_TOO_MANY_OBJECTS";
        case VK_ERROR_OUT_OF_POOL_MEMORY:
            return "VK_ERROR_OUT_OF_POOL_MEMORY";
        case VK_ERROR_MEMORY_MAP_FAILED:
            return "VK_ERROR_MEMORY_MAP_FAILED";
        default:
            return "VkResult";
    }
}

// Limits of the programs that a device of Vulkan 1.2 need not have.
Status check_limits(const VkPhysicalDeviceLimits& limits) {
    const struct {
        const char* name;
        uint32_t found, needed;
    } all[] = {
        {"maxComputeWorkGroupInvocations", limits.maxComputeWorkGroupInvocations, 256},
        {"maxComputeSharedMemorySize", limits.maxComputeSharedMemorySize, 32768},  // as in GL 4.5
        {"maxPerStageDescriptorStorageImages", limits.maxPerStageDescriptorStorageImages, 8}};
    for (const auto& [name, found, needed] : all)
        if (found < needed)
            return Status(StatusCode::gl, concat("physical_device has ", name, " ", found, ", and ",
                                                 needed, " are needed; choose another device"));
    return Status();
}

}  // namespace

Status status_of(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return Status();
    const bool memory =
        result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY;
    return Status(memory ? StatusCode::memory : StatusCode::gl,
                  concat(call, "(): ", name_of(result), " (", int(result), ")"));
}

Status Device::open(const Handles& handles) {
    handles_ = handles;
    const struct {
        const char* name;
        bool given;
    } all[] = {{"get_instance_proc_addr", handles.get_instance_proc_addr != nullptr},
               {"instance", handles.instance != VK_NULL_HANDLE},
               {"physical_device", handles.physical != VK_NULL_HANDLE},
               {"device", handles.device != VK_NULL_HANDLE}};
    for (const auto& [name, given] : all)
        if (!given) return Status(StatusCode::usage, concat(name, " is NULL"));
    const auto of_instance = [&](const char* name) {
        return handles.get_instance_proc_addr(handles.instance, name);
    };
    const char* missing = nullptr;
#define POSTCHAIN_VK_LOAD(name)                                                \
    const auto name = reinterpret_cast<PFN_vk##name>(of_instance("vk" #name)); \
    if (!name) missing = "vk" #name;
    POSTCHAIN_VK_LOAD(GetDeviceProcAddr)
    POSTCHAIN_VK_LOAD(GetPhysicalDeviceProperties)
    POSTCHAIN_VK_LOAD(GetPhysicalDeviceFeatures)
    POSTCHAIN_VK_LOAD(GetPhysicalDeviceMemoryProperties)
    POSTCHAIN_VK_LOAD(GetPhysicalDeviceFormatProperties)
    POSTCHAIN_VK_LOAD(GetPhysicalDeviceQueueFamilyProperties)
#undef POSTCHAIN_VK_LOAD
    if (missing)
        return Status(StatusCode::usage, concat("get_instance_proc_addr knows no ", missing));
#define POSTCHAIN_VK_LOAD(name)                                                               \
    fn_.name = reinterpret_cast<PFN_vk##name>(GetDeviceProcAddr(handles.device, "vk" #name)); \
    if (!fn_.name) missing = "vk" #name;
    POSTCHAIN_VK_FUNCTIONS(POSTCHAIN_VK_LOAD)
#undef POSTCHAIN_VK_LOAD
    if (missing) return Status(StatusCode::gl, concat("the device knows no ", missing, "()"));

    VkPhysicalDeviceProperties properties = {};
    GetPhysicalDeviceProperties(handles.physical, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_2)
        return Status(
            StatusCode::gl,
            concat("physical_device has Vulkan ", VK_API_VERSION_MAJOR(properties.apiVersion), ".",
                   VK_API_VERSION_MINOR(properties.apiVersion), "; 1.2 is needed"));
    limits_ = properties.limits;
    RETURN_IF_ERROR(check_limits(limits_));
    VkPhysicalDeviceFeatures features = {};
    GetPhysicalDeviceFeatures(handles.physical, &features);
    if (!features.shaderStorageImageWriteWithoutFormat)
        return Status(StatusCode::gl,
                      "physical_device has no shaderStorageImageWriteWithoutFormat");
    GetPhysicalDeviceMemoryProperties(handles.physical, &memory_);
    format_properties_ = GetPhysicalDeviceFormatProperties;
    uint32_t count = 0;
    GetPhysicalDeviceQueueFamilyProperties(handles.physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    GetPhysicalDeviceQueueFamilyProperties(handles.physical, &count, families.data());
    if (handles.queue_family >= count ||
        !(families[handles.queue_family].queueFlags & VK_QUEUE_COMPUTE_BIT))
        return Status(StatusCode::usage, concat("queue_family: ", handles.queue_family,
                                                " is no queue family with VK_QUEUE_COMPUTE_BIT"));
    timestamp_bits_ = families[handles.queue_family].timestampValidBits;
    memory_blocks_ = std::make_unique<Memory>(
        BlockFunctions{[this](const VkMemoryRequirements& needs, VkMemoryPropertyFlags wanted,
                              MemoryPart& made,
                              uint32_t& type) { return allocate_block(needs, wanted, made, type); },
                       [this](VkDeviceMemory memory) {
                           fn_.FreeMemory(handles_.device, memory, allocator());
                       }},
        handles.memory);
    if (!handles.labels) return Status();
    // Null unless the host has enabled VK_EXT_debug_utils.
    set_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        of_instance("vkSetDebugUtilsObjectNameEXT"));
    begin_label_ = reinterpret_cast<PFN_vkCmdBeginDebugUtilsLabelEXT>(
        of_instance("vkCmdBeginDebugUtilsLabelEXT"));
    end_label_ =
        reinterpret_cast<PFN_vkCmdEndDebugUtilsLabelEXT>(of_instance("vkCmdEndDebugUtilsLabelEXT"));
    return Status();
}

bool Device::supports(VkFormat format, VkFormatFeatureFlags features) const {
    VkFormatProperties found = {};
    format_properties_(handles_.physical, format, &found);
    return (found.optimalTilingFeatures & features) == features;
}

Status Device::allocate_block(const VkMemoryRequirements& needs, VkMemoryPropertyFlags properties,
                              MemoryPart& made, uint32_t& type) const {
    const VkMemoryPropertyFlags needed =
        properties & ~VkMemoryPropertyFlags(VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    // The first type that fits is the best, and there is one for every object.
    for (const VkMemoryPropertyFlags wanted : {properties, needed}) {
        for (type = 0; type < memory_.memoryTypeCount; ++type) {
            if (!(needs.memoryTypeBits >> type & 1) ||
                (memory_.memoryTypes[type].propertyFlags & wanted) != wanted)
                continue;
            auto info = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
            info.allocationSize = made.bytes = needs.size;
            info.memoryTypeIndex = type;
            RETURN_IF_ERROR(
                status_of(fn_.AllocateMemory(handles_.device, &info, allocator(), &made.memory),
                          "vkAllocateMemory"));
            name(VK_OBJECT_TYPE_DEVICE_MEMORY, number_of(made.memory), "postchain block");
            if (!(properties & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT)) return Status();
            void* mapped = nullptr;
            const VkResult result =
                fn_.MapMemory(handles_.device, made.memory, 0, VK_WHOLE_SIZE, 0, &mapped);
            made.mapped = static_cast<std::byte*>(mapped);
            if (result != VK_SUCCESS) fn_.FreeMemory(handles_.device, made.memory, allocator());
            return status_of(result, "vkMapMemory");
        }
    }
    return Status(StatusCode::gl, "the device has no memory of the type that a buffer needs");
}

void Device::name(VkObjectType type, uint64_t handle, const std::string& name) const {
    if (!set_name_ || !handle) return;
    auto info =
        info_of<VkDebugUtilsObjectNameInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT);
    info.objectType = type;
    info.objectHandle = handle;
    info.pObjectName = name.c_str();
    set_name_(handles_.device, &info);
}

void Device::begin_label(VkCommandBuffer commands, const std::string& name) const {
    if (!begin_label_) return;
    auto info = info_of<VkDebugUtilsLabelEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT);
    info.pLabelName = name.c_str();
    begin_label_(commands, &info);
}

void Device::end_label(VkCommandBuffer commands) const {
    if (end_label_) end_label_(commands);
}

Sampler::~Sampler() {
    if (device_) device_->fn().DestroySampler(device_->handle(), sampler_, device_->allocator());
}

Status Sampler::make(const Device& device) {
    device_ = &device;
    auto info = info_of<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
    info.addressModeU = info.addressModeV = info.addressModeW =
        VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    return status_of(
        device.fn().CreateSampler(device.handle(), &info, device.allocator(), &sampler_),
        "vkCreateSampler");
}

Result<Buffer> Buffer::make(const Device& device, VkDeviceSize bytes, VkBufferUsageFlags usage,
                            VkMemoryPropertyFlags properties, const std::string& name) {
    Buffer made;
    made.device_ = &device;
    auto info = info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = bytes;
    info.usage = usage;
    const Functions& fn = device.fn();
    RETURN_IF_ERROR(
        status_of(fn.CreateBuffer(device.handle(), &info, device.allocator(), &made.buffer_),
                  "vkCreateBuffer"));
    VkMemoryRequirements needs = {};
    fn.GetBufferMemoryRequirements(device.handle(), made.buffer_, &needs);
    ASSIGN_OR_RETURN(made.memory_, device.memory().allocate(needs, properties, Contents::buffers));
    RETURN_IF_ERROR(status_of(fn.BindBufferMemory(device.handle(), made.buffer_,
                                                  made.memory_.memory, made.memory_.offset),
                              "vkBindBufferMemory"));
    device.name(VK_OBJECT_TYPE_BUFFER, number_of(made.buffer_), name);
    return made;
}

Buffer::Buffer(Buffer&& other) noexcept {
    *this = std::move(other);
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(buffer_, other.buffer_);
    std::swap(memory_, other.memory_);
    return *this;
}

Buffer::~Buffer() {
    if (!device_) return;
    device_->fn().DestroyBuffer(device_->handle(), buffer_, device_->allocator());
    device_->memory().free(memory_);
}

}  // namespace postchain::vk
