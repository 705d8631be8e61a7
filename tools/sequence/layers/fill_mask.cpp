#include "tools/sequence/layers/fill_mask.h"

#include <algorithm>
#include <cstddef>

#include "chain/base/text.h"
#include "chain/frame/behind.h"
#include "chain/frame/layers.h"

namespace postchain::sequence {
namespace {

constexpr size_t kLongestName = 200;  // with a channel's own, EXR's limit is 255

}  // namespace

std::vector<std::string> fill_mask_channels(const std::string& name) {
    return {name + ".frame", name + ".neighbor", name + ".background"};
}

Status check_fill_mask(const std::string& name) {
    const auto is_plain = [](unsigned char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_' || c == '-' || c == '.';
    };
    if (std::all_of(name.begin(), name.end(), is_plain) && !name.starts_with('.') &&
        !name.ends_with('.') && name.size() <= kLongestName)
        return Status();
    return Status(StatusCode::usage,
                  concat(quoted(name),
                         " cannot name channels; use letters, digits, _, - and . "
                         "between them, at most ",
                         kLongestName, " in all"));
}

FrameDescription with_fill_mask(FrameDescription frame) {
    const bool layered = frame.planes.has(Role::layers);
    if (!layered) frame.bounds.layers_are_half = true;
    frame.fill_layer = 0;
    ++frame.layers;
    frame.planes.add(Role::layers);
    for (const Neighbor neighbor : kNeighbors)
        if (!layered && frame.planes.has(role_of(neighbor, Role::color)))
            frame.planes.add(role_of(neighbor, Role::layers));
    return frame;
}

SharedPlanes planes_with_fill_mask(SharedPlanes planes, const FrameDescription& frame) {
    ImageF mask(frame.width, frame.height, 4);
    for (size_t pixel = 0; pixel < mask.pixels(); ++pixel) mask.data[4 * pixel] = 1;
    const auto shared = std::make_shared<const ImageF>(mask);
    const RoleSet made = with_fill_mask(frame).planes;
    for (const Role role : {Role::layers, Role::layers_before, Role::layers_after}) {
        if (!made.has(role)) continue;
        std::shared_ptr<const ImageF>& plane = planes[role];
        plane = plane ? std::make_shared<const ImageF>(stack_planes({mask, *plane})) : shared;
    }
    if (const auto behind = planes.find(Role::behind);
        behind != planes.end() && made.has(Role::behind)) {
        ImageF before = *behind->second;
        const size_t values = size_t(kBehindPlanes) * mask.data.size();
        before.data.insert(before.data.begin() + std::ptrdiff_t(values), mask.data.begin(),
                           mask.data.end());
        before.height += frame.height;
        behind->second = std::make_shared<const ImageF>(std::move(before));
    }
    return planes;
}

ImageF take_fill_mask(ImageF& layers, int height) {
    ImageF mask = plane_of_stack(layers, 0, height);
    for (size_t pixel = 0; pixel < mask.pixels(); ++pixel) {
        float* shares = mask.data.data() + 4 * pixel;
        float sum = 0;
        for (int i = 0; i < 3; ++i) sum += shares[i] = std::max(shares[i], 0.0f);
        for (int i = 0; i < 3; ++i) shares[i] = sum > 0 ? shares[i] / sum : 0;
    }
    layers.data.erase(layers.data.begin(), layers.data.begin() + std::ptrdiff_t(mask.data.size()));
    layers.height -= height;
    if (layers.height == 0) layers = ImageF();
    return mask;
}

}  // namespace postchain::sequence
