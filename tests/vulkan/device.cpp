#include "tests/vulkan/device.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "chain/vk/device.h"

namespace postchain::test {
namespace {

void must(VkResult result, const char* doing) {
    if (result == VK_SUCCESS) return;
    std::fprintf(stderr, "%s: VkResult %d; run tools/install_packages.sh --tests\n", doing, result);
    std::exit(1);
}

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data,
                                            void* user) {
    // Only old layers repeat the identifier, such as SYNC-HAZARD-WRITE-AFTER-WRITE, in the message.
    const char* identifier = data->pMessageIdName ? data->pMessageIdName : "";
    static_cast<Vulkan*>(user)->messages.push_back(std::string(identifier) + ": " + data->pMessage);
    return VK_FALSE;
}

// Every test fails on a message of the layers.
class FailOnMessages : public ::testing::EmptyTestEventListener {
    void OnTestEnd(const ::testing::TestInfo&) override {
        for (const std::string& message : Vulkan::get().messages) ADD_FAILURE() << message;
        Vulkan::get().messages.clear();
    }
};

}  // namespace

Vulkan& Vulkan::get() {
    static auto* vulkan = new Vulkan;  // drivers unload at exit in any order
    return *vulkan;
}

Vulkan::Vulkan() {
    auto application = vk::info_of<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.apiVersion = VK_API_VERSION_1_2;
    const VkValidationFeatureEnableEXT enabled[] = {
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    auto features = vk::info_of<VkValidationFeaturesEXT>(VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT);
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enabled;
    auto messenger = vk::info_of<VkDebugUtilsMessengerCreateInfoEXT>(
        VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
    messenger.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                                VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = keep_message;
    messenger.pUserData = this;
    features.pNext = &messenger;
    const char* layer = "VK_LAYER_KHRONOS_validation";
    std::vector<const char*> extensions = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
#ifdef VK_EXT_layer_settings
    // The layers that came with this extension follow the accesses of shaders only on request.
    extensions.push_back(VK_EXT_LAYER_SETTINGS_EXTENSION_NAME);
    const VkBool32 yes = VK_TRUE;
    const VkLayerSettingEXT setting = {layer, "syncval_shader_accesses_heuristic",
                                       VK_LAYER_SETTING_TYPE_BOOL32_EXT, 1, &yes};
    auto settings =
        vk::info_of<VkLayerSettingsCreateInfoEXT>(VK_STRUCTURE_TYPE_LAYER_SETTINGS_CREATE_INFO_EXT);
    settings.settingCount = 1;
    settings.pSettings = &setting;
    messenger.pNext = &settings;
#endif
    auto info = vk::info_of<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &application;
    if (with_layers) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &layer;
        info.enabledExtensionCount = uint32_t(extensions.size());
        info.ppEnabledExtensionNames = extensions.data();
    }
    must(vkCreateInstance(&info, nullptr, &instance),
         with_layers ? "vkCreateInstance with the validation layer" : "vkCreateInstance");
    if (with_layers) {
        const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance, "vkCreateDebugUtilsMessengerEXT"));
        messenger.pNext = nullptr;
        VkDebugUtilsMessengerEXT made = VK_NULL_HANDLE;
        must(create(instance, &messenger, nullptr, &made), "vkCreateDebugUtilsMessengerEXT");
    }

    // The device of GL, whose bits the tests expect: a GPU if there is one, else lavapipe, which
    // has llvmpipe's compiler.
    uint32_t count = 16;
    VkPhysicalDevice devices[16];
    vkEnumeratePhysicalDevices(instance, &count, devices);
    for (uint32_t i = 0; i < count; ++i) {
        VkPhysicalDeviceProperties properties;
        vkGetPhysicalDeviceProperties(devices[i], &properties);
        const bool cpu = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
        if (physical && (cpu || !software)) continue;
        physical = devices[i];
        software = cpu;
    }
    must(physical ? VK_SUCCESS : VK_ERROR_INITIALIZATION_FAILED, "no Vulkan device");

    const float priority = 1;
    auto queues = vk::info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queues.queueFamilyIndex = kFamily;
    queues.queueCount = 1;
    queues.pQueuePriorities = &priority;
    VkPhysicalDeviceFeatures needed = {};
    needed.shaderStorageImageWriteWithoutFormat = VK_TRUE;
    auto create_info = vk::info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    create_info.queueCreateInfoCount = 1;
    create_info.pQueueCreateInfos = &queues;
    create_info.pEnabledFeatures = &needed;
    must(vkCreateDevice(physical, &create_info, nullptr, &device), "vkCreateDevice");
    vkGetDeviceQueue(device, kFamily, 0, &queue);
    auto pool = vk::info_of<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.queueFamilyIndex = kFamily;
    must(vkCreateCommandPool(device, &pool, nullptr, &pool_), "vkCreateCommandPool");
    ::testing::UnitTest::GetInstance()->listeners().Append(new FailOnMessages);
}

VkCommandBuffer Vulkan::begin() {
    auto info =
        vk::info_of<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    info.commandPool = pool_;
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    must(vkAllocateCommandBuffers(device, &info, &commands), "vkAllocateCommandBuffers");
    auto begin = vk::info_of<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    must(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    return commands;
}

VkFence Vulkan::submit(VkCommandBuffer commands) {
    must(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    auto info = vk::info_of<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    VkFence fence = VK_NULL_HANDLE;
    must(vkCreateFence(device, &info, nullptr, &fence), "vkCreateFence");
    auto submit = vk::info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    must(vkQueueSubmit(queue, 1, &submit, fence), "vkQueueSubmit");
    return fence;
}

void Vulkan::wait_for(VkFence fence, VkCommandBuffer commands) {
    must(vkWaitForFences(device, 1, &fence, VK_TRUE, UINT64_MAX), "vkWaitForFences");
    vkDestroyFence(device, fence, nullptr);
    vkFreeCommandBuffers(device, pool_, 1, &commands);
}

void Vulkan::run(const std::function<void(VkCommandBuffer)>& record) {
    const VkCommandBuffer commands = begin();
    record(commands);
    wait_for(submit(commands), commands);
}

uint32_t Vulkan::memory_type(uint32_t allowed, VkMemoryPropertyFlags properties) const {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    uint32_t type = 0;
    while (!(allowed >> type & 1) ||
           (memory.memoryTypes[type].propertyFlags & properties) != properties)
        ++type;
    return type;
}

void full_barrier(VkCommandBuffer commands) {
    auto barrier = vk::info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1, &barrier, 0, nullptr, 0,
                         nullptr);
}

}  // namespace postchain::test
