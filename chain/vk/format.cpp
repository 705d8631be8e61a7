#include "chain/vk/format.h"

#include <iterator>

namespace postchain::vk {
namespace {

using guest::HostFormat;

#define FORMAT(name, ...) \
    { name, #name, __VA_ARGS__ }
// Format, channels, depth, image, half: as chain/guest/host_frame.cpp has them.
constexpr HostFormat kFormats[] = {
    FORMAT(VK_FORMAT_R32G32B32A32_SFLOAT, 4, false, true, false),
    FORMAT(VK_FORMAT_R16G16B16A16_SFLOAT, 4, false, true, true),
    FORMAT(VK_FORMAT_R32G32B32_SFLOAT, 3, false, false, false),
    FORMAT(VK_FORMAT_R16G16B16_SFLOAT, 3, false, false, true),
    FORMAT(VK_FORMAT_B10G11R11_UFLOAT_PACK32, 3, false, true, true),
    FORMAT(VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, 3, false, false, false),
    FORMAT(VK_FORMAT_R16G16B16A16_UNORM, 4, false, true, false),
    FORMAT(VK_FORMAT_R8G8B8A8_UNORM, 4, false, true, false),
    FORMAT(VK_FORMAT_B8G8R8A8_UNORM, 4, false, true, false),
    FORMAT(VK_FORMAT_A8B8G8R8_UNORM_PACK32, 4, false, true, false),
    FORMAT(VK_FORMAT_A2B10G10R10_UNORM_PACK32, 4, false, true, false),
    FORMAT(VK_FORMAT_A2R10G10B10_UNORM_PACK32, 4, false, true, false),
    FORMAT(VK_FORMAT_R8G8B8_UNORM, 3, false, false, false),
    FORMAT(VK_FORMAT_R8G8B8A8_SRGB, 4, false, false, false),
    FORMAT(VK_FORMAT_B8G8R8A8_SRGB, 4, false, false, false),
    FORMAT(VK_FORMAT_A8B8G8R8_SRGB_PACK32, 4, false, false, false),
    FORMAT(VK_FORMAT_R16G16B16A16_SNORM, 4, false, true, false),
    FORMAT(VK_FORMAT_R8G8B8A8_SNORM, 4, false, true, false),
    FORMAT(VK_FORMAT_R32G32_SFLOAT, 2, false, true, false),
    FORMAT(VK_FORMAT_R16G16_SFLOAT, 2, false, true, true),
    FORMAT(VK_FORMAT_R16G16_UNORM, 2, false, true, false),
    FORMAT(VK_FORMAT_R8G8_UNORM, 2, false, true, false),
    FORMAT(VK_FORMAT_R16G16_SNORM, 2, false, true, false),
    FORMAT(VK_FORMAT_R8G8_SNORM, 2, false, true, false),
    FORMAT(VK_FORMAT_R32_SFLOAT, 1, false, true, false),
    FORMAT(VK_FORMAT_R16_SFLOAT, 1, false, true, true),
    FORMAT(VK_FORMAT_R16_UNORM, 1, false, true, false),
    FORMAT(VK_FORMAT_R8_UNORM, 1, false, true, false),
    FORMAT(VK_FORMAT_D32_SFLOAT, 1, true, false, false),
    FORMAT(VK_FORMAT_X8_D24_UNORM_PACK32, 1, true, false, false),
    FORMAT(VK_FORMAT_D16_UNORM, 1, true, false, false),
    FORMAT(VK_FORMAT_D32_SFLOAT_S8_UINT, 1, true, false, false),
    FORMAT(VK_FORMAT_D24_UNORM_S8_UINT, 1, true, false, false),
    FORMAT(VK_FORMAT_D16_UNORM_S8_UINT, 1, true, false, false),
};
#undef FORMAT

}  // namespace

VkFormat format_of(Format format) {
    static constexpr VkFormat kOfPlanes[] = {VK_FORMAT_R32G32B32A32_SFLOAT,
                                             VK_FORMAT_R16G16B16A16_SFLOAT,
                                             VK_FORMAT_R32G32_SFLOAT,
                                             VK_FORMAT_R16G16_SFLOAT,
                                             VK_FORMAT_R32_SFLOAT,
                                             VK_FORMAT_R16_SFLOAT,
                                             VK_FORMAT_R8G8B8A8_UNORM,
                                             VK_FORMAT_R8G8_UNORM,
                                             VK_FORMAT_R8_UNORM,
                                             VK_FORMAT_R32G32B32A32_UINT,
                                             VK_FORMAT_R32_UINT};
    static_assert(std::size(kOfPlanes) == size_t(Format::work_list));
    return kOfPlanes[size_t(format)];
}

const HostFormat* find_format(unsigned format) {
    for (const auto& known : kFormats)
        if (known.name == format) return &known;
    return nullptr;
}

bool is_readable_in(VkImageLayout layout, const HostFormat& format) {
    switch (layout) {
        case VK_IMAGE_LAYOUT_GENERAL:
        case VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL:
            return true;
        case VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL:
        case VK_IMAGE_LAYOUT_DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL:
        case VK_IMAGE_LAYOUT_DEPTH_READ_ONLY_OPTIMAL:
            return format.depth;
        default:
            return false;
    }
}

}  // namespace postchain::vk
