// A host's image, destroyed with this object.
#pragma once

#include "chain/base/image.h"
#include "chain/vk/postchain_vk.h"
#include "tests/vulkan/device.h"

namespace postchain::test {

class HostImage {
  public:
    // Filled with zeros. In VK_IMAGE_LAYOUT_GENERAL, or with `layout` in another one.
    HostImage(VkFormat format, int width, int height,
              VkImageLayout layout = VK_IMAGE_LAYOUT_GENERAL);
    // With the image's pixels.
    HostImage(VkFormat format, const ImageF& pixels,
              VkImageLayout layout = VK_IMAGE_LAYOUT_GENERAL);
    HostImage(HostImage&& other) noexcept;
    HostImage& operator=(HostImage&&) = delete;
    ~HostImage();
    // The image at x, y of a larger one, whose other texels are 77.
    static HostImage inside(VkFormat format, const ImageF& pixels, int width, int height, int x,
                            int y);

    operator pc_vk_image() const { return image_; }
    const pc_vk_image& image() const { return image_; }
    VkImage handle() const { return handle_; }
    void write(const ImageF& pixels);
    ImageF read() const;  // of the whole image

  private:
    void copy(VkBuffer buffer, bool to_image) const;

    pc_vk_image image_ = {};
    VkImage handle_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
};

}  // namespace postchain::test
