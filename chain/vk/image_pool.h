// Images and work lists that compiled plans share; one that no plan uses is freed when the runs
// that may still use it are over.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/storage.h"
#include "chain/vk/device.h"

namespace postchain::vk {

// Objects that runs in flight may still use.
class Retired {
  public:
    explicit Retired(uint64_t runs_in_flight) : runs_in_flight_(runs_in_flight) {}
    // The runs up to this one may use it.
    template <class Object>
    void add(uint64_t run, std::unique_ptr<Object> object) {
        objects_.emplace_back(run + runs_in_flight_, std::shared_ptr<void>(std::move(object)));
    }
    // This run begins: those before the last `runs_in_flight` are over.
    void begin(uint64_t run) {
        std::erase_if(objects_, [&](const auto& one) { return one.first <= run; });
    }

  private:
    const uint64_t runs_in_flight_;
    std::vector<std::pair<uint64_t, std::shared_ptr<void>>> objects_;
};

// An image with its view, or a buffer of blocks.
struct Image {
    explicit Image(const Device& of) : device(of) {}
    ~Image();
    Image(const Image&) = delete;
    Image& operator=(const Image&) = delete;

    const Device& device;
    Storage storage;
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    MemoryPart memory;
    bool fresh = true;  // in no layout yet: the next run moves it to GENERAL, where it stays
    Buffer list;
    int plans = 0;  // that use it
    uint64_t last_used = 0;
};

// StatusCode::memory; StatusCode::gl: a limit of the device.
Result<std::unique_ptr<Image>> make_image(const Device& device, const Storage& storage);

class ImagePool {
  public:
    ImagePool(const Device& device, uint64_t budget) : device_(device), budget_(budget) {}
    // For each of them an image of its own, with undefined content, counted as used by one plan
    // more. Errors: StatusCode::memory if the budget does not suffice, and those of make_image().
    Result<std::vector<Image*>> acquire(const std::vector<Storage>& all, uint64_t run);
    // A recorded run was never submitted: what it moved to GENERAL is in no layout.
    void forget_layouts() {
        for (const auto& image : images_) image->fresh = true;
    }
    // Retires the images that no plan uses and that were not used after that run.
    void trim(uint64_t last_used, uint64_t run, Retired& retired);

    uint64_t allocations() const { return allocations_; }
    uint64_t alive() const { return images_.size(); }
    uint64_t bytes() const { return bytes_; }
    uint64_t bytes_peak() const { return bytes_peak_; }

  private:
    const Device& device_;
    const uint64_t budget_;
    std::vector<std::unique_ptr<Image>> images_;
    uint64_t allocations_ = 0, bytes_ = 0, bytes_peak_ = 0;
};

}  // namespace postchain::vk
