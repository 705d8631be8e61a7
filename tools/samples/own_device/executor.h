/* Executes plans of postchain_plan.h in a Vulkan 1.2 device: the part that an engine writes in its
 * own interface. Ends the process with a message if a call of Vulkan fails. */
#ifndef EXECUTOR_H
#define EXECUTOR_H
#include <postchain/postchain_plan.h>
#include <vulkan/vulkan.h>
#ifdef __cplusplus
extern "C" {
#endif

typedef struct Executor Executor;
typedef struct {
    VkPhysicalDevice physical;
    VkDevice device; /* with shaderStorageImageWriteWithoutFormat */
    uint32_t frames_in_flight;
    const char* programs; /* the folder that postchain-programs --format spirv wrote; stays valid */
} ExecutorInfo;
typedef struct { /* the host's texture that pc_texture.name n calls: views[n - 1] */
    VkImageView view;
    VkImageLayout layout;
} HostView;

Executor* executor_create(const ExecutorInfo* info);
/* The device is idle. */
void executor_destroy(Executor*);
/* Makes the pipelines of pc_plan_programs(). */
void executor_prepare(Executor*, const uint64_t* keys, uint32_t count);
/* Records a plan. The command buffer that was recorded for `in_flight` last has finished. Plans are
 * those of one planner, and are submitted in this order to one queue. The host's textures can be
 * read, and its output be written, by compute shaders. */
void executor_record(Executor*, VkCommandBuffer commands, uint32_t in_flight, const pc_plan* plan,
                     const HostView* views);
/* Frees the storage, for frames of another largest size. The device is idle. */
void executor_forget_storage(Executor*);

#ifdef __cplusplus
}
#endif
#endif
