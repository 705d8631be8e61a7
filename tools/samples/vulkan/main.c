/* A sample host in Vulkan, without a window: a scene in three images, the chain, and a picture.
 *
 *   scene -> color, depth, motion -> pc_vk_run() -> output -> file
 *
 * vulkan_host [FRAMES [IMAGE.ppm [PROGRAMS]]]: filters FRAMES frames (4), two of them in flight,
 * and writes the last one. PROGRAMS: a file of postchain-programs; without it the library compiles the
 * programs, if it has a compiler. The scene is computed on the CPU and copied; a renderer draws it.
 * Also builds on its own: CMakeLists.txt. */
#include <math.h>
#include <postchain/postchain_vk.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

enum {
    WIDTH = 640,
    HEIGHT = 360,
    IN_FLIGHT = 2,
    COLOR = 0,
    DEPTH = 1,
    MOTION = 2,
    OUTPUT = 3,
    IMAGES = 4
};

static const VkFormat FORMATS[IMAGES] = {VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R32_SFLOAT,
                                         VK_FORMAT_R32G32_SFLOAT, VK_FORMAT_R8G8B8A8_UNORM};
static const int CHANNELS[IMAGES] = {4, 1, 2, 1}; /* of 4 bytes */

static VkInstance instance;
static VkPhysicalDevice physical;
static VkDevice device;
static uint32_t family;
static VkQueue queue;

typedef struct {
    VkImage image;
    VkBuffer buffer; /* its pixels on the CPU */
    void* pixels;
    pc_vk_image view;
} Image;
typedef struct { /* what a frame in flight needs for itself */
    Image images[IMAGES];
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

static Image make_image(int number) {
    Image made = {0};
    VkImageCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
        .imageType = VK_IMAGE_TYPE_2D,
        .format = FORMATS[number],
        .extent = {WIDTH, HEIGHT, 1},
        .mipLevels = 1,
        .arrayLayers = 1,
        .samples = VK_SAMPLE_COUNT_1_BIT,
        .usage = number == OUTPUT ? VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT
                                  : VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT};
    check(vkCreateImage(device, &info, NULL, &made.image), "vkCreateImage");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, made.image, &needs);
    VkDeviceMemory memory = allocate(needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    check(vkBindImageMemory(device, made.image, memory, 0), "vkBindImageMemory");
    VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                  .image = made.image,
                                  .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                  .format = FORMATS[number],
                                  .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    check(vkCreateImageView(device, &view, NULL, &made.view.view), "vkCreateImageView");
    made.view.format = FORMATS[number];
    made.view.layout =
        number == OUTPUT ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    made.view.width = WIDTH;
    made.view.height = HEIGHT;

    VkBufferCreateInfo buffer = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = 4u * WIDTH * HEIGHT * (unsigned)CHANNELS[number],
        .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    check(vkCreateBuffer(device, &buffer, NULL, &made.buffer), "vkCreateBuffer");
    vkGetBufferMemoryRequirements(device, made.buffer, &needs);
    memory =
        allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    check(vkBindBufferMemory(device, made.buffer, memory, 0), "vkBindBufferMemory");
    check(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &made.pixels), "vkMapMemory");
    return made;
}

/* A striped disc that flies in front of a checkered wall. */
static void draw(const Frame* frame, int number) {
    float *color = frame->images[COLOR].pixels, *depth = frame->images[DEPTH].pixels,
          *motion = frame->images[MOTION].pixels;
    const float speed = 14, at_x = 120 + speed * (float)number, at_y = 180;
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x, color += 4, ++depth, motion += 2) {
            const float dx = (float)x - at_x, dy = (float)y - at_y;
            const int disc = dx * dx + dy * dy < 90 * 90;
            const int light = disc ? ((int)(dy + 1000) / 12) % 2 : (x / 40 + y / 40) % 2;
            color[0] = disc ? 0.9f : 0.05f + 0.1f * (float)light;
            color[1] = disc ? 0.3f + 0.5f * (float)light : 0.1f + 0.1f * (float)light;
            color[2] = disc ? 0.1f + 0.4f * (float)light : 0.15f + 0.1f * (float)light;
            color[3] = 1;
            *depth = disc ? 3.0f : 12.0f; /* distance */
            motion[0] = disc ? speed : 0; /* pixels to the next frame, y down */
            motion[1] = 0;
        }
}

static void barrier(const Frame* frame, int number, VkPipelineStageFlags from_stage,
                    VkAccessFlags from, VkImageLayout old_layout, VkPipelineStageFlags to_stage,
                    VkAccessFlags to, VkImageLayout new_layout) {
    VkImageMemoryBarrier one = {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
                                .srcAccessMask = from,
                                .dstAccessMask = to,
                                .oldLayout = old_layout,
                                .newLayout = new_layout,
                                .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                .image = frame->images[number].image,
                                .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
    vkCmdPipelineBarrier(frame->commands, from_stage, to_stage, 0, 0, NULL, 0, NULL, 1, &one);
}

static void record(const Frame* frame, pc_vk_instance* chain_instance, pc_chain* chain,
                   const pc_vk_frame* given) {
    const VkBufferImageCopy whole = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                                     .imageExtent = {WIDTH, HEIGHT, 1}};
    for (int i = 0; i < OUTPUT; ++i) {
        barrier(frame, i, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_IMAGE_LAYOUT_UNDEFINED,
                VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        vkCmdCopyBufferToImage(frame->commands, frame->images[i].buffer, frame->images[i].image,
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &whole);
        /* The chain reads in compute shaders, in the layout that its pc_vk_image names ... */
        barrier(frame, i, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                VK_ACCESS_SHADER_READ_BIT, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
    }
    /* ... and writes output in VK_IMAGE_LAYOUT_GENERAL. */
    barrier(frame, OUTPUT, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_IMAGE_LAYOUT_UNDEFINED,
            VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_IMAGE_LAYOUT_GENERAL);
    if (pc_vk_run(chain_instance, chain, given, frame->commands) != PC_OK) report("pc_vk_run");
    barrier(frame, OUTPUT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
            VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT,
            VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    vkCmdCopyImageToBuffer(frame->commands, frame->images[OUTPUT].image,
                           VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, frame->images[OUTPUT].buffer, 1,
                           &whole);
    VkMemoryBarrier to_host = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                               .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(frame->commands, VK_PIPELINE_STAGE_TRANSFER_BIT,
                         VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0, NULL, 0, NULL);
}

static void write_image(const char* path, const unsigned char* pixels) {
    FILE* file = fopen(path, "wb");
    if (!file) {
        perror(path);
        exit(1);
    }
    fprintf(file, "P6\n%d %d\n255\n", WIDTH, HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; ++i) fwrite(pixels + 4 * i, 1, 3, file);
    fclose(file);
}

/* The file stays in memory as long as the process. */
static void* read_file(const char* path, size_t* size) {
    FILE* file = fopen(path, "rb");
    char* bytes = NULL;
    *size = 0;
    for (size_t room = 1 << 20; file && !feof(file) && !ferror(file); room *= 2) {
        bytes = realloc(bytes, room);
        if (!bytes) break;
        *size += fread(bytes + *size, 1, room - *size, file);
    }
    if (!bytes || ferror(file)) {
        perror(path);
        exit(1);
    }
    fclose(file);
    return bytes;
}

int main(int argc, char** argv) {
    const int frames = argc > 1 ? atoi(argv[1]) : 4;
    make_device();
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                         .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                         .queueFamilyIndex = family};
    VkCommandPool pool;
    check(vkCreateCommandPool(device, &pool_info, NULL, &pool), "vkCreateCommandPool");
    Frame in_flight[IN_FLIGHT] = {0};
    for (int f = 0; f < IN_FLIGHT; ++f) {
        for (int i = 0; i < IMAGES; ++i) in_flight[f].images[i] = make_image(i);
        VkCommandBufferAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                            .commandPool = pool,
                                            .commandBufferCount = 1};
        check(vkAllocateCommandBuffers(device, &info, &in_flight[f].commands), "command buffer");
        VkFenceCreateInfo fence = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO,
                                   .flags = VK_FENCE_CREATE_SIGNALED_BIT};
        check(vkCreateFence(device, &fence, NULL, &in_flight[f].finished), "vkCreateFence");
    }

    pc_vk_create_info info = {.struct_size = sizeof(info),
                              .api_version = PC_API_VERSION,
                              .runs_in_flight = IN_FLIGHT,
                              .get_instance_proc_addr = vkGetInstanceProcAddr,
                              .instance = instance,
                              .physical_device = physical,
                              .device = device,
                              .queue_family = family,
                              .max_width = WIDTH,
                              .max_height = HEIGHT};
    if (argc > 3) info.programs = read_file(argv[3], &info.programs_size);
    pc_vk_instance* chain_instance;
    if (pc_vk_create(&info, &chain_instance) != PC_OK) report("pc_vk_create");
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
    pc_vk_frame given = {.struct_size = sizeof(given), .values = &values};

    const Frame* frame = NULL;
    for (int number = 0; number < frames; ++number) {
        frame = &in_flight[number % IN_FLIGHT];
        /* The images, the command buffer and the chain's values of the frame before the last. */
        check(vkWaitForFences(device, 1, &frame->finished, VK_TRUE, UINT64_MAX), "a frame");
        check(vkResetFences(device, 1, &frame->finished), "vkResetFences");
        draw(frame, number);
        given.color = frame->images[COLOR].view;
        given.depth = frame->images[DEPTH].view;
        given.motion = frame->images[MOTION].view;
        given.output = frame->images[OUTPUT].view;
        values.frame_number = (uint64_t)number;
        if (number == 0 && pc_vk_prepare(chain_instance, chain, &given, 1) != PC_OK)
            report("pc_vk_prepare");
        VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                          .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
        check(vkBeginCommandBuffer(frame->commands, &begin), "vkBeginCommandBuffer");
        record(frame, chain_instance, chain, &given);
        check(vkEndCommandBuffer(frame->commands), "vkEndCommandBuffer");
        VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                               .commandBufferCount = 1,
                               .pCommandBuffers = &frame->commands};
        check(vkQueueSubmit(queue, 1, &submit, frame->finished), "vkQueueSubmit");
    }
    check(vkDeviceWaitIdle(device), "vkDeviceWaitIdle");
    if (argc > 2 && frame) write_image(argv[2], frame->images[OUTPUT].pixels);
    printf("%d frames of %dx%d\n", frames, WIDTH, HEIGHT);
    pc_chain_destroy(chain);
    pc_vk_destroy(chain_instance);
    return 0; /* the process ends: Vulkan's objects go with it */
}
