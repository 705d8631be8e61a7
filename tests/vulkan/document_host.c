/* The code of docs/vulkan.md, as written, compiles. */
#include <postchain/postchain_vk.h>
#include <stdint.h>

typedef struct graph graph_type;
void report(const char* text);
void use_your_own_color(const char* text);
void declare(graph_type*, const pc_vk_resource*, VkPipelineStageFlags, VkAccessFlags);
void barriers(graph_type*, VkCommandBuffer);

void document_host(VkInstance, VkPhysicalDevice, VkDevice, uint32_t, pc_chain*, VkImageView,
                   int32_t, int32_t, const void*, size_t, VkCommandBuffer, graph_type*, uint64_t,
                   int);
void document_host(VkInstance instance, VkPhysicalDevice physical, VkDevice device, uint32_t family,
                   pc_chain* chain, VkImageView color_view, int32_t width, int32_t height,
                   const void* bytes, size_t size, VkCommandBuffer commands, graph_type* graph,
                   uint64_t n, int cut) {
#include "vulkan_1.inc"
#include "vulkan_2.inc"
#include "vulkan_3.inc"
#include "vulkan_4.inc"
}
