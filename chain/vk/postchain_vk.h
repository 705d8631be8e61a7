/* The chain in a host's own Vulkan 1.2 device. C11 and C++20. Introduction: docs/vulkan.md. */
/*                                                                                                  */
/*   pc_vk_create()  pc_chain_create()  pc_vk_prepare()      once */
/*   pc_vk_run()                                             every frame, into a command buffer */
/*                                                                                                  */
/* Chains, results, pc_error(), pc_frame and the rules about structs, flags, handles and threads are
 * those of postchain.h, which this header includes. PC_ERROR_GL says that a call of Vulkan failed
 * or that a program does not compile; the text names it. */

/* Device: Vulkan 1.2, with the feature shaderStorageImageWriteWithoutFormat enabled by the host,
 * maxComputeWorkGroupInvocations >= 256, maxComputeSharedMemorySize >= 32768,
 * maxPerStageDescriptorStorageImages >= 8, and a queue family with VK_QUEUE_COMPUTE_BIT;
 * pc_vk_create() refuses other devices with PC_ERROR_GL. No extension is used. The library calls no
 * function of a queue: it creates its objects, and records. */

/* Frames in flight: runs_in_flight is the number of pc_vk_run() calls whose command buffers may be
 * unfinished at once. Before it makes call number n, the host has waited until the command buffer
 * of call n - runs_in_flight has finished, or has given it up: it is never submitted, and
 * pc_vk_give_up() was called. A host
 * with two frames in flight and one run a frame states 2 and waits, as always, for the fence of the
 * frame before the last; one with two runs a frame (two eyes) states 4. A call that fails counts as
 * none. A recorded run is submitted at most once, to queues of queue_family, in the order of the
 * calls: on one queue, or with semaphores between queues. Objects that a run may still use are
 * destroyed runs_in_flight calls later. */

/* Synchronization: pc_vk_run() records barriers between its own steps and against the runs before,
 * and none for the host's images. Before it, in the command buffer or by a semaphore, the host
 * makes color, depth, motion, mask and exposure available to VK_ACCESS_SHADER_READ_BIT in
 * VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, in the layout that pc_vk_image.layout names, and output to
 * VK_ACCESS_SHADER_WRITE_BIT in that stage, in VK_IMAGE_LAYOUT_GENERAL. After it, output was
 * written by VK_ACCESS_SHADER_WRITE_BIT in VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT and is still in
 * GENERAL; the inputs were read in that stage. Layouts of the host's images do not change. */

/* Focus at a place (`focus_at`): a step of each run finds the depth there, and the library reads it
 * when a later run takes that run's place among the runs in flight. So focus is runs_in_flight runs
 * behind, and no call waits. While no depth is known, at first and from PC_CAMERA_CUT on, focus is
 * at values->focus_distance, or at that of the chain's camera. If neither is set it is infinitely
 * far at first, and stays where it was after a cut. Then it jumps to the depth. */

/* Memory: images and buffers are parts of a few blocks of vkAllocateMemory(), about one for each
 * plan and 256 MiB, or of the host's own memory (allocate_memory). Images go from UNDEFINED to
 * GENERAL once, in the first run after they are made, and stay there. */

/* State: pc_vk_run() and pc_vk_record() are called outside a render pass, and changes the compute
 * pipeline, the descriptor set 0 of the compute bind point (by vkCmdBindDescriptorSets();
 * docs/vulkan.md says what a host with descriptor buffers does), and the first 8 bytes of the push
 * constants. */
#ifndef POSTCHAIN_POSTCHAIN_VK_H
#define POSTCHAIN_POSTCHAIN_VK_H
#include <postchain/postchain.h>
#include <vulkan/vulkan_core.h>
#ifdef __cplusplus
extern "C" {
#endif

typedef struct pc_vk_instance pc_vk_instance; /* programs, images and plans of one device */

typedef struct pc_vk_memory { /* a part of the host's memory */
    VkDeviceMemory memory;
    VkDeviceSize offset;
    void* mapped;     /* its first byte, if it was asked for as HOST_VISIBLE; stays mapped */
    void* allocation; /* the host's own; given back with the part */
} pc_vk_memory;

typedef struct pc_vk_create_info {
    uint32_t struct_size;
    uint32_t api_version;    /* PC_API_VERSION */
    pc_create_flags flags;   /* PC_VALIDATE: bounds, lens, singular matrices, an output over another
                                plane than color; for all else use Vulkan's validation layers.
                                PC_LABELS: names of steps and objects by VK_EXT_debug_utils, if the
                                host's instance has it */
    uint32_t runs_in_flight; /* 1 to 64; 0 = 2 */
    void* user;              /* first argument of the callbacks */
    PFN_vkGetInstanceProcAddr get_instance_proc_addr;
    VkInstance instance;
    VkPhysicalDevice physical_device;
    VkDevice device;
    VkPipelineCache pipeline_cache; /* of the host; VK_NULL_HANDLE = none */
    uint32_t queue_family;
    uint32_t keep_frames; /* an image is freed after this many pc_vk_run() without use; 0 = 8 */
    /* The largest frame: images are made for it, and a frame of any size up to it costs values
     * alone. A larger one is PC_ERROR_INPUT. */
    uint32_t max_width, max_height;
    uint64_t texture_budget;                                 /* bytes; 0 = no limit */
    void (*log)(void* user, int level, const char* message); /* PC_LOG_*; may be NULL */
    /* A cache of programs as SPIR-V, as in pc_create_info; each may be NULL. What the driver makes
     * of them goes into pipeline_cache. */
    size_t (*load_program)(void* user, const char* key, void* bytes, size_t room);
    void (*store_program)(void* user, const char* key, const void* bytes, size_t size);
    /* A set of programs as SPIR-V, made by postchain-programs of this version for the host's
     * chains; stays valid until pc_vk_destroy(). Programs in it are not compiled. NULL = none. A
     * library without a compiler (POSTCHAIN_VULKAN_COMPILER=OFF) has no others: PC_ERROR_GL names
     * one that is missing. PC_ERROR_ARGUMENT: damaged, or of another version. */
    const void* programs;
    size_t programs_size;
    const VkAllocationCallbacks* allocator; /* of all objects; outlives the instance; NULL = none */
    /* The host's memory instead of the library's blocks; both or neither. allocate_memory() gives
     * a part of a memory type of needs->memoryTypeBits, with `properties`, of which
     * VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT alone is a wish. Images, of optimal tiling, are asked for
     * with DEVICE_LOCAL; so are some buffers: a host that mixes both in one block keeps
     * bufferImageGranularity. Another result than VK_SUCCESS is PC_ERROR_MEMORY or PC_ERROR_GL.
     * Called within the calls of this library; free_memory() also within pc_vk_destroy(). */
    VkResult (*allocate_memory)(void* user, const VkMemoryRequirements* needs,
                                VkMemoryPropertyFlags properties, pc_vk_memory* part);
    void (*free_memory)(void* user, const pc_vk_memory* part);
} pc_vk_create_info;
/* On failure *instance is NULL, and the text is in pc_error(). The host's handles outlive the
 * instance. */
PC_API pc_result pc_vk_create(const pc_vk_create_info* info, pc_vk_instance** instance);
/* Every command buffer of pc_vk_run() has finished, or is never submitted. */
PC_API void pc_vk_destroy(pc_vk_instance*);
/* As pc_last_error(). */
PC_API const char* pc_vk_last_error(const pc_vk_instance*);

typedef struct pc_vk_image { /* the host's; stays valid until the run's command buffer has finished
                              */
    VkImageView view;        /* VK_IMAGE_VIEW_TYPE_2D, one level, one layer, no swizzle; of a depth
                                format the depth aspect alone; VK_NULL_HANDLE = no image. The image
                                has VK_IMAGE_USAGE_SAMPLED_BIT, output VK_IMAGE_USAGE_STORAGE_BIT */
    VkFormat format;         /* of the view */
    VkImageLayout layout;    /* in which it is read: VK_IMAGE_LAYOUT_GENERAL, a read-only layout of
                                color or depth; of output, GENERAL. UNDEFINED (0) is refused */
    int32_t width, height;   /* of the view */
    int32_t x, y;            /* first texel of the frame's rectangle, as stored */
} pc_vk_image;

typedef struct pc_vk_frame {
    uint32_t struct_size;
    uint32_t flags; /* 0; those of pc_frame, such as PC_HALF_PLANES, are in values->flags */
    /* Everything but the images: its textures have the name 0, its pc_slices and barriers are 0.
     * Row 0 of the images is the top, unless PC_BOTTOM_LEFT is set. */
    const pc_frame* values;
    pc_vk_image color;    /* scene-linear, premultiplied */
    pc_vk_image depth;    /* its first component */
    pc_vk_image motion;   /* its first two components */
    pc_vk_image mask;     /* optional, as in pc_frame; its first component */
    pc_vk_image exposure; /* optional, as in pc_frame */
    /* Required. It may be color: then both have the same view, in VK_IMAGE_LAYOUT_GENERAL. */
    pc_vk_image output;
    /* The frames before and after, as in pc_frame: their values, color, depth, motion and exposure.
     * Their output is ignored. In `values` before and after are NULL. */
    const struct pc_vk_frame *before, *after;
} pc_vk_frame;

/* Compiles the programs of every frame of this kind, and makes the images of this one: as
 * pc_prepare(). Nothing is recorded. wait = 0: compiles one program at most, and returns PC_PENDING
 * until none is left. Views are not looked at, except whether they are given and equal. */
PC_API pc_result pc_vk_prepare(pc_vk_instance*, pc_chain*, const pc_vk_frame*, int wait);
/* Records one frame. Compiles nothing, and allocates nothing for a frame like the last ones. After
 * a failure nothing is recorded, and output is not written: show your own color. */
PC_API pc_result pc_vk_run(pc_vk_instance*, pc_chain*, const pc_vk_frame*, VkCommandBuffer);
/* Command buffers of runs were recorded and are never submitted. Call it before the next run. */
PC_API pc_result pc_vk_give_up(pc_vk_instance*);

/* ------------------------------------------------------------------- a frame in two phases */
/* For hosts that place barriers themselves, such as a render graph: pc_vk_begin() instead of
 * pc_vk_run() lists the frame's dispatches with what each reads and writes, and pc_vk_record()
 * records one of them, without a barrier, except that for the host's read of the depths in focus.
 * pc_vk_begin() counts as a run (frames in flight). The host
 *   - records dispatch 0 first ("begin": it empties work lists, and brings new images to GENERAL),
 *     and each other dispatch once, in the order of the list or in another one that keeps the order
 *     of every two that use one resource, unless both only read it;
 *   - records all of them before the next call that begins a run or prepares, into one or several
 *     command buffers that are submitted in this order;
 *   - makes each use of a resource wait, with its stages and accesses, for the uses before that
 *     conflict with it, those of earlier runs too: a resource is one if its handle is.
 * Dispatches of one level do not conflict. No layout changes: images of the library are in GENERAL,
 * those of the host as pc_vk_frame says. */
typedef struct pc_vk_resource {
    char name[48];   /* "host.color", or the first texture of the plan in it: "motion_blur.tiles" */
    VkImage image;   /* of the library, all of it; or VK_NULL_HANDLE */
    VkBuffer buffer; /* likewise */
    VkImageView view; /* of the host, likewise */
} pc_vk_resource;
typedef struct pc_vk_use {
    uint32_t resource; /* index into pc_vk_steps.resources */
    VkPipelineStageFlags stages;
    VkAccessFlags access;
} pc_vk_use;
typedef struct pc_vk_dispatch {
    char name[48]; /* "motion_blur.gather" */
    uint32_t level;
    uint32_t use_count;
    const pc_vk_use* uses;
} pc_vk_dispatch;
typedef struct pc_vk_steps { /* valid until the next call that begins a run or prepares */
    uint32_t struct_size;
    uint32_t resource_count, dispatch_count, reserved; /* 0 dispatches: there is nothing to do */
    const pc_vk_resource* resources;
    const pc_vk_dispatch* dispatches;
} pc_vk_steps;
/* Errors: those of pc_vk_run(). */
PC_API pc_result pc_vk_begin(pc_vk_instance*, pc_chain*, const pc_vk_frame*, pc_vk_steps*);
/* `dispatch`: index into pc_vk_steps.dispatches of the last pc_vk_begin(). */
PC_API pc_result pc_vk_record(pc_vk_instance*, uint32_t dispatch, VkCommandBuffer);

/* ----------------------------------------------------------------------------- what it did */
/* As pc_set_timing(), by timestamps in the command buffer, of pc_vk_run(). Steps of one level
 * overlap, so an interval begins when the one before has ended. PC_ERROR_GL: the queue family has
 * no timestamps. */
PC_API pc_result pc_vk_set_timing(pc_vk_instance*, int level);
/* As pc_timings(): of the newest run that is over, which is known from the run that takes its place
 * among the runs in flight. */
PC_API pc_result pc_vk_timings(pc_vk_instance*, pc_time* times, uint32_t* count,
                               uint64_t* frame_number);
/* As pc_query_frame(), of a frame of max_width x max_height. */
PC_API pc_result pc_vk_query_frame(pc_vk_instance*, pc_chain*, const pc_vk_frame*, pc_frame_needs*);
/* As pc_count(), where textures are images and buffers of blocks. */
PC_API pc_result pc_vk_count(const pc_vk_instance*, pc_counters*);
/* As pc_explain(). */
PC_API pc_result pc_vk_explain(const pc_vk_instance*, char* text, size_t* size);
#ifdef __cplusplus
}
#endif
#endif
