// Formats of Vulkan: of a plan's textures, and of a host's images.
#pragma once

#include <vulkan/vulkan_core.h>

#include "chain/guest/host_frame.h"
#include "chain/plan/plan.h"

namespace postchain::vk {

VkFormat format_of(Format format);  // not of a work list

// As guest::find_format(), of a VkFormat.
const guest::HostFormat* find_format(unsigned format);

// A layout in which an image of this format can be sampled.
bool is_readable_in(VkImageLayout layout, const guest::HostFormat& format);

}  // namespace postchain::vk
