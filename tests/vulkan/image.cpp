#include "tests/vulkan/image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "chain/gl/half.h"
#include "chain/vk/device.h"

namespace postchain::test {
namespace {

enum class Type { float32, half, unorm8, depth16 };

struct Layout {
    int channels;
    Type type;
    int bytes() const { return type == Type::float32 ? 4 : type == Type::unorm8 ? 1 : 2; }
};

Layout layout_of(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R32G32B32A32_SFLOAT:
            return {4, Type::float32};
        case VK_FORMAT_R16G16B16A16_SFLOAT:
            return {4, Type::half};
        case VK_FORMAT_R8G8B8A8_UNORM:
        case VK_FORMAT_B8G8R8A8_UNORM:
        case VK_FORMAT_R8G8B8A8_SRGB:
            return {4, Type::unorm8};
        case VK_FORMAT_R32G32_SFLOAT:
            return {2, Type::float32};
        case VK_FORMAT_R16G16_SFLOAT:
            return {2, Type::half};
        case VK_FORMAT_R32_SFLOAT:
        case VK_FORMAT_D32_SFLOAT:
            return {1, Type::float32};
        case VK_FORMAT_D16_UNORM:
            return {1, Type::depth16};
        default:
            ADD_FAILURE() << "tests know no layout of VkFormat " << format;
            return {4, Type::float32};
    }
}

bool is_depth(VkFormat format) {
    return format == VK_FORMAT_D32_SFLOAT || format == VK_FORMAT_D16_UNORM;
}

VkImageAspectFlags aspect_of(VkFormat format) {
    return is_depth(format) ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

// Memory for a copy; `fill` gets it before, `take` afterwards.
void with_buffer(size_t bytes, const std::function<void(VkBuffer, void*)>& work) {
    Vulkan& host = Vulkan::get();
    auto info = vk::info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    VkBuffer buffer = VK_NULL_HANDLE;
    vkCreateBuffer(host.device, &info, nullptr, &buffer);
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(host.device, buffer, &needs);
    auto allocate = vk::info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    allocate.allocationSize = needs.size;
    allocate.memoryTypeIndex =
        host.memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                                   VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    VkDeviceMemory memory = VK_NULL_HANDLE;
    vkAllocateMemory(host.device, &allocate, nullptr, &memory);
    vkBindBufferMemory(host.device, buffer, memory, 0);
    void* mapped = nullptr;
    vkMapMemory(host.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped);
    work(buffer, mapped);
    vkDestroyBuffer(host.device, buffer, nullptr);
    vkFreeMemory(host.device, memory, nullptr);
}

void change_layout(VkCommandBuffer commands, VkImage image, VkImageAspectFlags aspect,
                   VkImageLayout from, VkImageLayout to) {
    auto barrier = vk::info_of<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {aspect, 0, 1, 0, 1};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1,
                         &barrier);
}

}  // namespace

HostImage::HostImage(VkFormat format, int width, int height, VkImageLayout layout) {
    Vulkan& host = Vulkan::get();
    image_.format = format;
    image_.width = width;
    image_.height = height;
    image_.layout = layout;
    VkFormatProperties properties;
    vkGetPhysicalDeviceFormatProperties(host.physical, format, &properties);
    auto info = vk::info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {uint32_t(width), uint32_t(height), 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                 VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    if (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT)
        info.usage |= VK_IMAGE_USAGE_STORAGE_BIT;
    if (is_depth(format)) info.usage |= VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT;
    vkCreateImage(host.device, &info, nullptr, &handle_);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(host.device, handle_, &needs);
    auto allocate = vk::info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    allocate.allocationSize = needs.size;
    allocate.memoryTypeIndex =
        host.memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    vkAllocateMemory(host.device, &allocate, nullptr, &memory_);
    vkBindImageMemory(host.device, handle_, memory_, 0);
    auto view = vk::info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view.image = handle_;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format;
    view.subresourceRange = {aspect_of(format), 0, 1, 0, 1};
    vkCreateImageView(host.device, &view, nullptr, &image_.view);
    host.run([&](VkCommandBuffer commands) {
        change_layout(commands, handle_, aspect_of(format), VK_IMAGE_LAYOUT_UNDEFINED,
                      VK_IMAGE_LAYOUT_GENERAL);
        if (layout != VK_IMAGE_LAYOUT_GENERAL)
            change_layout(commands, handle_, aspect_of(format), VK_IMAGE_LAYOUT_GENERAL, layout);
    });
    write(ImageF(width, height, layout_of(format).channels));
}

HostImage::HostImage(VkFormat format, const ImageF& pixels, VkImageLayout layout)
    : HostImage(format, pixels.width, pixels.height, layout) {
    write(pixels);
}

HostImage::HostImage(HostImage&& other) noexcept
    : image_(std::exchange(other.image_, {})),
      handle_(std::exchange(other.handle_, nullptr)),
      memory_(std::exchange(other.memory_, nullptr)) {}

HostImage::~HostImage() {
    const VkDevice device = Vulkan::get().device;
    vkDestroyImageView(device, image_.view, nullptr);
    vkDestroyImage(device, handle_, nullptr);
    vkFreeMemory(device, memory_, nullptr);
}

HostImage HostImage::inside(VkFormat format, const ImageF& pixels, int width, int height, int x,
                            int y) {
    ImageF around(width, height, pixels.channels, 77.0f);
    for (int row = 0; row < pixels.height; ++row)
        std::copy_n(pixels.pixel(0, row), size_t(pixels.width) * size_t(pixels.channels),
                    around.pixel(x, y + row));
    HostImage image(format, around);
    image.image_.x = x;
    image.image_.y = y;
    return image;
}

void HostImage::copy(VkBuffer buffer, bool to_image) const {
    const VkImageAspectFlags aspect = aspect_of(image_.format);
    Vulkan::get().run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        if (image_.layout != VK_IMAGE_LAYOUT_GENERAL)
            change_layout(commands, handle_, aspect, image_.layout, VK_IMAGE_LAYOUT_GENERAL);
        VkBufferImageCopy region = {};
        region.imageSubresource = {aspect, 0, 0, 1};
        region.imageExtent = {uint32_t(image_.width), uint32_t(image_.height), 1};
        if (to_image)
            vkCmdCopyBufferToImage(commands, buffer, handle_, VK_IMAGE_LAYOUT_GENERAL, 1, &region);
        else
            vkCmdCopyImageToBuffer(commands, handle_, VK_IMAGE_LAYOUT_GENERAL, buffer, 1, &region);
        full_barrier(commands);
        if (image_.layout != VK_IMAGE_LAYOUT_GENERAL)
            change_layout(commands, handle_, aspect, VK_IMAGE_LAYOUT_GENERAL, image_.layout);
    });
}

void HostImage::write(const ImageF& pixels) {
    const Layout layout = layout_of(image_.format);
    ASSERT_EQ(pixels.channels, layout.channels);
    const size_t count = pixels.data.size();
    with_buffer(count * size_t(layout.bytes()), [&](VkBuffer buffer, void* mapped) {
        if (layout.type == Type::float32)
            std::memcpy(mapped, pixels.data.data(), 4 * count);
        else if (layout.type == Type::half)
            gl::to_halves(pixels.data.data(), static_cast<uint16_t*>(mapped), count);
        for (size_t i = 0; i < count; ++i) {
            const float value = std::clamp(pixels.data[i], 0.0f, 1.0f);
            if (layout.type == Type::unorm8)
                static_cast<uint8_t*>(mapped)[i] = uint8_t(std::lround(255 * value));
            if (layout.type == Type::depth16)
                static_cast<uint16_t*>(mapped)[i] = uint16_t(std::lround(65535 * value));
        }
        copy(buffer, true);
    });
}

ImageF HostImage::read() const {
    const Layout layout = layout_of(image_.format);
    ImageF pixels(image_.width, image_.height, layout.channels);
    const size_t count = pixels.data.size();
    with_buffer(count * size_t(layout.bytes()), [&](VkBuffer buffer, void* mapped) {
        copy(buffer, false);
        if (layout.type == Type::float32)
            std::memcpy(pixels.data.data(), mapped, 4 * count);
        else if (layout.type == Type::half)
            gl::from_halves(static_cast<const uint16_t*>(mapped), pixels.data.data(), count);
        else if (layout.type == Type::unorm8)
            for (size_t i = 0; i < count; ++i)
                pixels.data[i] = static_cast<const uint8_t*>(mapped)[i] / 255.0f;
    });
    return pixels;
}

}  // namespace postchain::test
