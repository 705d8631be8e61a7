#include "chain/vk/host_images.h"

#include "chain/guest/frame_check.h"
#include "chain/vk/format.h"

namespace postchain::vk {
namespace {

using guest::Failure;

struct Member {
    const char* name;
    const pc_vk_image& image;
    pc_texture& texture;
};

// Its format, layout and view; sizes and rectangles are checked as those of textures.
Failure check_image(const Member& member, bool output) {
    const auto& [name, image, texture] = member;
    const guest::HostFormat* format = find_format(unsigned(image.format));
    if (!format)
        return {PC_ERROR_INPUT, concat(name, ".format: VkFormat ", int(image.format),
                                       " is not one of float, normalized or depth values")};
    if (output && !format->image)
        return {PC_ERROR_INPUT, concat("output: ", format->text,
                                       " cannot be written by a compute shader; give "
                                       "VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R16G16B16A16_SFLOAT or "
                                       "another of those in docs/vulkan.md")};
    if (output && image.layout != VK_IMAGE_LAYOUT_GENERAL)
        return {PC_ERROR_INPUT, concat("output.layout: VkImageLayout ", int(image.layout),
                                       "; it is written in VK_IMAGE_LAYOUT_GENERAL")};
    if (!is_readable_in(image.layout, *format))
        return {PC_ERROR_INPUT, concat(name, ".layout: an image of ", format->text,
                                       " cannot be read in VkImageLayout ", int(image.layout),
                                       "; give VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL or "
                                       "VK_IMAGE_LAYOUT_GENERAL")};
    return {};
}

// The values of a frame or a neighbor, without textures.
Failure read_values(const pc_vk_frame& given, const char* name, pc_frame& values) {
    if (given.flags != 0)
        return {PC_ERROR_VERSION,
                concat(name, ".flags: ", given.flags,
                       guest::knows_flags(given.flags)
                           ? "; set PC_HALF_PLANES and others of pc_frame in values"
                           : " has a bit that this library does not know")};
    const pc_frame* read = nullptr;
    RETURN_IF_ERROR(
        guest::read_struct(given.values, concat(name, ".values").c_str(), values, read));
    values = *read;
    values.struct_size = sizeof(pc_frame);
    if ((values.flags & PC_BOTTOM_LEFT) == 0) values.flags |= PC_TOP_LEFT;
    if (values.barriers != 0)
        return {PC_ERROR_ARGUMENT, "values: barriers is not 0; in Vulkan the host records them"};
    if (values.before || values.after)
        return {PC_ERROR_ARGUMENT, "values: before or after is not NULL; give it in pc_vk_frame"};
    for (const pc_slice* slice : {&values.color_slice, &values.depth_slice, &values.motion_slice,
                                  &values.mask_slice, &values.output_slice})
        if (slice->target != 0 || slice->layer != 0 || slice->level != 0)
            return {PC_ERROR_ARGUMENT, "values: a pc_slice is not 0; in Vulkan a view selects it"};
    const std::pair<const char*, uint32_t> names[] = {
        {"color", values.color.name},       {"depth", values.depth.name},
        {"motion", values.motion.name},     {"mask", values.mask.name},
        {"exposure", values.exposure.name}, {"output", values.output.name}};
    for (const auto& [member, texture] : names)
        if (texture != 0)
            return {PC_ERROR_ARGUMENT,
                    concat("values: ", member, " is a GL texture; give an image of pc_vk_frame")};
    values.color = values.depth = values.motion = values.mask = values.exposure =
        values.output = {};
    return {};
}

}  // namespace

Failure check_images(const pc_vk_frame& given, HostImages& images) {
    images.views = {};
    RETURN_IF_ERROR(read_values(given, "pc_vk_frame", images.values));
    pc_vk_frame whole[kNeighbors.size()] = {};
    const pc_vk_frame* neighbors[] = {given.before, given.after};
    constexpr const char* kNames[] = {"pc_vk_frame.before", "pc_vk_frame.after"};
    for (size_t i = 0; i < kNeighbors.size(); ++i) {
        if (!neighbors[i]) continue;
        RETURN_IF_ERROR(guest::read_struct(neighbors[i], kNames[i], whole[i], neighbors[i]));
        RETURN_IF_ERROR(read_values(*neighbors[i], kNames[i], images.neighbors[i]));
    }
    const pc_vk_frame empty = {};
    const pc_vk_frame& before = neighbors[0] ? *neighbors[0] : empty;
    const pc_vk_frame& after = neighbors[1] ? *neighbors[1] : empty;
    auto& [values_before, values_after] = images.neighbors;
    const Member members[] = {{"color", given.color, images.values.color},
                              {"depth", given.depth, images.values.depth},
                              {"motion", given.motion, images.values.motion},
                              {"exposure", given.exposure, images.values.exposure},
                              {"before.color", before.color, values_before.color},
                              {"before.depth", before.depth, values_before.depth},
                              {"before.motion", before.motion, values_before.motion},
                              {"before.exposure", before.exposure, values_before.exposure},
                              {"after.color", after.color, values_after.color},
                              {"after.depth", after.depth, values_after.depth},
                              {"after.motion", after.motion, values_after.motion},
                              {"after.exposure", after.exposure, values_after.exposure},
                              {"mask", given.mask, images.values.mask},
                              {"output", given.output, images.values.output}};
    static_assert(std::size(members) == std::tuple_size_v<HostViews>);
    if (!given.color.view)
        return {PC_ERROR_INPUT, "color: view is VK_NULL_HANDLE; give the image to filter"};
    if (!given.output.view)
        return {PC_ERROR_INPUT, "output: view is VK_NULL_HANDLE; give the image to write"};
    for (uint32_t i = 0; i < std::size(members); ++i) {
        const auto& [name, image, texture] = members[i];
        if (!image.view) continue;
        RETURN_IF_ERROR(check_image(members[i], &image == &given.output));
        images.views[i] = {image.view, image.layout};
        uint32_t first = 0;
        while (images.views[first].view != image.view) ++first;
        if (images.views[first].layout != image.layout)
            return {PC_ERROR_INPUT, concat(name, ".layout: it is not that of ", members[first].name,
                                           ", which has the same view")};
        texture = {first + 1, uint32_t(image.format), image.width, image.height, image.x, image.y};
    }
    guest::set_neighbors(
        images.values,
        {neighbors[0] ? &values_before : nullptr, neighbors[1] ? &values_after : nullptr},
        images.neighbors);
    return guest::check_frame(&images.values, images.frame, find_format);
}

}  // namespace postchain::vk
