#include "chain/vk/image_pool.h"

#include <algorithm>

#include "chain/vk/format.h"

namespace postchain::vk {
namespace {

constexpr VkBufferUsageFlags kListUsage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                                          VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                                          VK_BUFFER_USAGE_TRANSFER_DST_BIT;

std::string text_of(const Storage& storage) {
    return "allocating an image of " + storage.text();
}

Status create(const Device& device, Image& made) {
    const Functions& fn = device.fn();
    const Storage& storage = made.storage;
    const auto slices = uint32_t(std::max(storage.slices, 1));
    auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format_of(storage.format);
    info.extent = {uint32_t(storage.width), uint32_t(storage.height), 1};
    info.mipLevels = 1;
    info.arrayLayers = slices;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT;
    RETURN_IF_ERROR(status_of(
        fn.CreateImage(device.handle(), &info, device.allocator(), &made.image), "vkCreateImage"));
    VkMemoryRequirements needs = {};
    fn.GetImageMemoryRequirements(device.handle(), made.image, &needs);
    ASSIGN_OR_RETURN(
        made.memory,
        device.memory().allocate(needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, Contents::images));
    RETURN_IF_ERROR(status_of(
        fn.BindImageMemory(device.handle(), made.image, made.memory.memory, made.memory.offset),
        "vkBindImageMemory"));
    device.name(VK_OBJECT_TYPE_IMAGE, number_of(made.image), "postchain " + storage.text());
    auto view = info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view.image = made.image;
    view.viewType = storage.slices > 0 ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
    view.format = info.format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, slices};
    return status_of(fn.CreateImageView(device.handle(), &view, device.allocator(), &made.view),
                     "vkCreateImageView");
}

}  // namespace

Image::~Image() {
    const Functions& fn = device.fn();
    fn.DestroyImageView(device.handle(), view, device.allocator());
    fn.DestroyImage(device.handle(), image, device.allocator());
    device.memory().free(memory);
}

Result<std::unique_ptr<Image>> make_image(const Device& device, const Storage& storage) {
    const std::string doing = text_of(storage);
    const VkPhysicalDeviceLimits& limits = device.limits();
    auto made = std::make_unique<Image>(device);
    made->storage = storage;
    if (storage.format == Format::work_list) {
        auto buffer = Buffer::make(device, storage.bytes(), kListUsage,
                                   VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, "postchain work list");
        if (!buffer.ok()) return buffer.status().at(doing);
        made->list = std::move(*buffer);
        return made;
    }
    if (uint32_t(std::max(storage.width, storage.height)) > limits.maxImageDimension2D)
        return Status(StatusCode::gl,
                      concat(doing, ": this device's limit is ", limits.maxImageDimension2D,
                             " a side; use smaller frames"));
    if (!device.supports(format_of(storage.format),
                         VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT))
        return Status(
            StatusCode::gl,
            concat(doing, ": this device cannot store to such images; use another device, or GL"));
    if (Status s = create(device, *made); !s.ok()) return s.at(doing);
    return made;
}

Result<std::vector<Image*>> ImagePool::acquire(const std::vector<Storage>& all, uint64_t run) {
    std::vector<Image*> taken;
    const auto find = [&](const Storage& storage) {
        return std::find_if(images_.begin(), images_.end(), [&](const auto& image) {
            return image->storage == storage &&
                   std::find(taken.begin(), taken.end(), image.get()) == taken.end();
        });
    };
    VkDeviceSize missing = 0;  // drivers add some bytes to each image
    for (const Storage& storage : all)
        if (storage.format != Format::work_list && find(storage) == images_.end())
            missing += storage.bytes() + storage.bytes() / 8 + 4096;
    device_.memory().expect(missing);
    for (const Storage& storage : all) {
        const auto known = find(storage);
        if (known != images_.end()) {
            taken.push_back(known->get());
            continue;
        }
        const uint64_t bytes = storage.bytes();
        if (budget_ > 0 && bytes_ + bytes > budget_)
            return Status(StatusCode::memory, concat(text_of(storage), ": ", bytes_,
                                                     " bytes are in use, and the budget is ",
                                                     budget_, "; raise it, or use smaller frames"));
        ASSIGN_OR_RETURN(auto made, make_image(device_, storage));
        ++allocations_;
        bytes_ += bytes;
        bytes_peak_ = std::max(bytes_peak_, bytes_);
        images_.push_back(std::move(made));
        taken.push_back(images_.back().get());
    }
    for (Image* image : taken) {
        ++image->plans;
        image->last_used = run;
    }
    return taken;
}

void ImagePool::trim(uint64_t last_used, uint64_t run, Retired& retired) {
    std::erase_if(images_, [&](auto& image) {
        if (image->plans > 0 || image->last_used > last_used) return false;
        bytes_ -= image->storage.bytes();
        retired.add(run, std::move(image));
        return true;
    });
}

}  // namespace postchain::vk
