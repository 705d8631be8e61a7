// A host's frame of images as the frame of textures that the guest's planner knows.
#pragma once

#include "chain/guest/host_frame.h"
#include "chain/guest/host_struct.h"
#include "chain/vk/compiled_plan.h"
#include "chain/vk/postchain_vk.h"

namespace postchain::guest {

template <>
inline constexpr size_t kMinSize<pc_vk_frame> = offsetof(pc_vk_frame, depth);

}  // namespace postchain::guest

namespace postchain::vk {

// Cannot be moved, because `frame` refers to `values`.
struct HostImages {
    HostImages() = default;
    HostImages(const HostImages&) = delete;
    HostImages& operator=(const HostImages&) = delete;

    pc_frame values = {};                                    // with textures that name the images
    std::array<pc_frame, kNeighbors.size()> neighbors = {};  // likewise
    guest::HostFrame frame;
    HostViews views;
};

// Checks the frame and describes it. Errors name the member, as guest::check_frame()'s.
guest::Failure check_images(const pc_vk_frame& given, HostImages& images);

}  // namespace postchain::vk
