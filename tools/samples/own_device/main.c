/* A sample host that executes a frame's plan itself, without a window: a scene in three images, the
 * plan of postchain_plan.h in this program's own commands, and a picture.
 *
 *   scene -> color, depth, motion -> pc_plan_frame() -> executor_record() -> output -> file
 *
 * own_device_host PROGRAMS [FRAMES [IMAGE.ppm]]: filters FRAMES frames (4), two of them in flight,
 * with a resolution that changes from frame to frame, and writes the last one. PROGRAMS: a folder
 * of postchain-programs --format spirv --output PROGRAMS motion_blur,depth_of_field,fxaa. The scene
 * is computed on the CPU and copied; a renderer draws it. Also builds on its own: CMakeLists.txt.
 */
#include <stdio.h>
#include <stdlib.h>

#include "executor.h"

enum { WIDTH = 640, HEIGHT = 360, IN_FLIGHT = 2, MAX_PROGRAMS = 512 };
enum { COLOR = 0, DEPTH = 1, MOTION = 2, OUTPUT = 3, IMAGES = 4 };

static const VkFormat FORMATS[IMAGES] = {VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R32_SFLOAT,
                                         VK_FORMAT_R32G32_SFLOAT, VK_FORMAT_R8G8B8A8_UNORM};
static const pc_format NEUTRAL[IMAGES] = {PC_FORMAT_RGBA32F, PC_FORMAT_R32F, PC_FORMAT_RG32F,
                                          PC_FORMAT_RGBA8};
static const int CHANNELS[IMAGES] = {4, 1, 2, 1}; /* of 4 bytes */

static VkPhysicalDevice physical;
static VkDevice device;
static uint32_t family;
static VkQueue queue;

typedef struct { /* what a frame in flight needs for itself */
    VkImage images[IMAGES];
    HostView views[IMAGES];
    VkBuffer buffers[IMAGES]; /* their pixels on the CPU */
    void* pixels[IMAGES];
    VkCommandBuffer commands;
    VkFence finished;
} Frame;

static void check(VkResult result, const char* what) {
    if (result == VK_SUCCESS) return;
    fprintf(stderr, "%s: VkResult %d\n", what, (int)result);
    exit(1);
}
static void report(const char* what) {
    fprintf(stderr, "%s: %s\n", what, pc_error());
    exit(1);
}

static void make_device(void) {
    VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                     .apiVersion = VK_API_VERSION_1_2};
    VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                 .pApplicationInfo = &application};
    VkInstance instance;
    check(vkCreateInstance(&info, NULL, &instance), "vkCreateInstance");
    uint32_t count = 1;
    vkEnumeratePhysicalDevices(instance, &count, &physical);
    if (count == 0) check(VK_ERROR_INITIALIZATION_FAILED, "no Vulkan device");
    VkQueueFamilyProperties families[16];
    count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    while (family < count && !(families[family].queueFlags & VK_QUEUE_COMPUTE_BIT)) ++family;
    const float priority = 1;
    VkDeviceQueueCreateInfo queues = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                      .queueFamilyIndex = family,
                                      .queueCount = 1,
                                      .pQueuePriorities = &priority};
    VkPhysicalDeviceFeatures features = {.shaderStorageImageWriteWithoutFormat = VK_TRUE};
    VkDeviceCreateInfo create = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                 .queueCreateInfoCount = 1,
                                 .pQueueCreateInfos = &queues,
                                 .pEnabledFeatures = &features};
    check(vkCreateDevice(physical, &create, NULL, &device), "vkCreateDevice");
    vkGetDeviceQueue(device, family, 0, &queue);
}

static VkDeviceMemory allocate(VkMemoryRequirements needs, VkMemoryPropertyFlags properties) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    uint32_t type = 0;
    while (!(needs.memoryTypeBits >> type & 1) ||
           (memory.memoryTypes[type].propertyFlags & properties) != properties)
        ++type;
    VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                 .allocationSize = needs.size,
                                 .memoryTypeIndex = type};
    VkDeviceMemory made;
    check(vkAllocateMemory(device, &info, NULL, &made), "vkAllocateMemory");
    return made;
}

static void make_image(Frame* frame, int i) {
    VkImageCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
        .imageType = VK_IMAGE_TYPE_2D,
        .format = FORMATS[i],
        .extent = {WIDTH, HEIGHT, 1},
        .mipLevels = 1,
        .arrayLayers = 1,
        .samples = VK_SAMPLE_COUNT_1_BIT,
        .usage = i == OUTPUT ? VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT
                             : VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT};
    check(vkCreateImage(device, &info, NULL, &frame->images[i]), "vkCreateImage");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, frame->images[i], &needs);
    check(vkBindImageMemory(device, frame->images[i], allocate(needs, 0), 0), "vkBindImageMemory");
    VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                  .image = frame->images[i],
                                  .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                  .format = FORMATS[i],
                                  .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    check(vkCreateImageView(device, &view, NULL, &frame->views[i].view), "vkCreateImageView");
    frame->views[i].layout =
        i == OUTPUT ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;

    VkBufferCreateInfo buffer = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = 4u * WIDTH * HEIGHT * (unsigned)CHANNELS[i],
        .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    check(vkCreateBuffer(device, &buffer, NULL, &frame->buffers[i]), "vkCreateBuffer");
    vkGetBufferMemoryRequirements(device, frame->buffers[i], &needs);
    VkDeviceMemory memory =
        allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    check(vkBindBufferMemory(device, frame->buffers[i], memory, 0), "vkBindBufferMemory");
    check(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &frame->pixels[i]), "vkMapMemory");
}

/* A striped disc that flies in front of a checkered wall, in the first width x height texels. */
static void draw(const Frame* frame, int number, int width, int height) {
    const float speed = 14, at_x = 120 + speed * (float)(number % 24), at_y = 180;
    const float scale = (float)WIDTH / (float)width;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int texel = y * WIDTH + x;
            float *color = (float*)frame->pixels[COLOR] + 4 * texel,
                  *motion = (float*)frame->pixels[MOTION] + 2 * texel;
            const float dx = (float)x * scale - at_x, dy = (float)y * scale - at_y;
            const int disc = dx * dx + dy * dy < 90 * 90;
            const int wall = (int)((float)x * scale / 40) + (int)((float)y * scale / 40);
            const int light = disc ? ((int)(dy + 1000) / 12) % 2 : wall % 2;
            color[0] = disc ? 0.9f : 0.05f + 0.1f * (float)light;
            color[1] = disc ? 0.3f + 0.5f * (float)light : 0.1f + 0.1f * (float)light;
            color[2] = disc ? 0.1f + 0.4f * (float)light : 0.15f + 0.1f * (float)light;
            color[3] = 1;
            ((float*)frame->pixels[DEPTH])[texel] = disc ? 3.0f : 12.0f; /* distance */
            motion[0] = disc ? speed / scale : 0; /* pixels to the next frame, y down */
            motion[1] = 0;
        }
}

static void barrier(const Frame* frame, int i, VkPipelineStageFlags from_stage, VkAccessFlags from,
                    VkImageLayout old_layout, VkPipelineStageFlags to_stage, VkAccessFlags to,
                    VkImageLayout new_layout) {
    VkImageMemoryBarrier one = {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
                                .srcAccessMask = from,
                                .dstAccessMask = to,
                                .oldLayout = old_layout,
                                .newLayout = new_layout,
                                .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                .image = frame->images[i],
                                .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    vkCmdPipelineBarrier(frame->commands, from_stage, to_stage, 0, 0, NULL, 0, NULL, 1, &one);
}

static void record(const Frame* frame, Executor* executor, uint32_t in_flight,
                   const pc_plan* plan) {
    const VkBufferImageCopy whole = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                                     .imageExtent = {WIDTH, HEIGHT, 1}};
    for (int i = 0; i < OUTPUT; ++i) {
        barrier(frame, i, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_IMAGE_LAYOUT_UNDEFINED,
                VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        vkCmdCopyBufferToImage(frame->commands, frame->buffers[i], frame->images[i],
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &whole);
        barrier(frame, i, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                VK_ACCESS_SHADER_READ_BIT, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
    }
    barrier(frame, OUTPUT, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_IMAGE_LAYOUT_UNDEFINED,
            VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_IMAGE_LAYOUT_GENERAL);
    executor_record(executor, frame->commands, in_flight, plan, frame->views);
    barrier(frame, OUTPUT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT,
            VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    vkCmdCopyImageToBuffer(frame->commands, frame->images[OUTPUT],
                           VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, frame->buffers[OUTPUT], 1, &whole);
    VkMemoryBarrier to_host = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                               .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(frame->commands, VK_PIPELINE_STAGE_TRANSFER_BIT,
                         VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0, NULL, 0, NULL);
}

static void write_image(const char* path, const unsigned char* pixels, int width, int height) {
    FILE* file = fopen(path, "wb");
    if (!file) {
        perror(path);
        exit(1);
    }
    fprintf(file, "P6\n%d %d\n255\n", width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) fwrite(pixels + 4 * (y * WIDTH + x), 1, 3, file);
    fclose(file);
}

int main(int argc, char** argv) {
    if (argc < 2) {
        fprintf(stderr, "own_device_host PROGRAMS [FRAMES [IMAGE.ppm]]\n");
        return 2;
    }
    const int frames = argc > 2 ? atoi(argv[2]) : 4;
    make_device();
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                         .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                         .queueFamilyIndex = family};
    VkCommandPool pool;
    check(vkCreateCommandPool(device, &pool_info, NULL, &pool), "vkCreateCommandPool");
    Frame in_flight[IN_FLIGHT] = {0};
    for (int f = 0; f < IN_FLIGHT; ++f) {
        for (int i = 0; i < IMAGES; ++i) make_image(&in_flight[f], i);
        VkCommandBufferAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                            .commandPool = pool,
                                            .commandBufferCount = 1};
        check(vkAllocateCommandBuffers(device, &info, &in_flight[f].commands), "command buffer");
        VkFenceCreateInfo fence = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO,
                                   .flags = VK_FENCE_CREATE_SIGNALED_BIT};
        check(vkCreateFence(device, &fence, NULL, &in_flight[f].finished), "vkCreateFence");
    }

    pc_plan_create_info info = {.struct_size = sizeof(info),
                                .api_version = PC_API_VERSION,
                                .max_width = WIDTH,
                                .max_height = HEIGHT};
    pc_planner* planner;
    if (pc_plan_create(&info, &planner) != PC_OK) report("pc_plan_create");
    pc_chain* chain;
    if (pc_chain_create("motion_blur,depth_of_field,fxaa", &chain) != PC_OK)
        report("pc_chain_create");
    pc_frame values = {.struct_size = sizeof(values),
                       .flags = PC_MOTION_TO_NEXT,
                       .depth_encoding = PC_DEPTH_LINEAR,
                       .focal_length_mm = 50,
                       .sensor_width_mm = 36,
                       .f_stop = 1.4f,
                       .focus_distance = 3};
    /* The name of a texture: its index in `views`, plus 1. */
    pc_texture* textures[IMAGES] = {&values.color, &values.depth, &values.motion, &values.output};
    for (int i = 0; i < IMAGES; ++i)
        *textures[i] = (pc_texture){(uint32_t)i + 1, NEUTRAL[i], WIDTH, HEIGHT, 0, 0};
    ExecutorInfo executor_info = {physical, device, IN_FLIGHT, argv[1]};
    Executor* executor = executor_create(&executor_info);
    uint64_t keys[MAX_PROGRAMS];
    uint32_t count = MAX_PROGRAMS;
    if (pc_plan_programs(planner, chain, &values, keys, &count) != PC_OK)
        report("pc_plan_programs");
    if (count > MAX_PROGRAMS) check(VK_ERROR_OUT_OF_HOST_MEMORY, "MAX_PROGRAMS");
    executor_prepare(executor, keys, count);

    const Frame* frame = NULL;
    for (int number = 0; number < frames; ++number) {
        frame = &in_flight[number % IN_FLIGHT];
        check(vkWaitForFences(device, 1, &frame->finished, VK_TRUE, UINT64_MAX), "a frame");
        check(vkResetFences(device, 1, &frame->finished), "vkResetFences");
        values.width = WIDTH - 32 * ((frames - 1 - number) % 8);
        values.height = HEIGHT - 18 * ((frames - 1 - number) % 8);
        values.frame_number = (uint64_t)number;
        draw(frame, number, values.width, values.height);
        pc_plan plan = {.struct_size = sizeof(plan)};
        if (pc_plan_frame(planner, chain, &values, &plan) != PC_OK) report("pc_plan_frame");
        VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                          .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
        check(vkBeginCommandBuffer(frame->commands, &begin), "vkBeginCommandBuffer");
        record(frame, executor, (uint32_t)(number % IN_FLIGHT), &plan);
        check(vkEndCommandBuffer(frame->commands), "vkEndCommandBuffer");
        VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                               .commandBufferCount = 1,
                               .pCommandBuffers = &frame->commands};
        check(vkQueueSubmit(queue, 1, &submit, frame->finished), "vkQueueSubmit");
    }
    check(vkDeviceWaitIdle(device), "vkDeviceWaitIdle");
    if (argc > 3 && frame) write_image(argv[3], frame->pixels[OUTPUT], values.width, values.height);
    printf("%d frames, the last of %dx%d\n", frames, values.width, values.height);
    executor_destroy(executor);
    pc_chain_destroy(chain);
    pc_plan_destroy(planner);
    return 0; /* the process ends: the other objects go with it */
}
