// Reduced frames as images: of a file, and of a frame through a chain.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "chain/egl/context.h"
#include "chain/gl/executor.h"
#include "chain/pass/pass.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::service {

struct ImageForm {
    std::string type = "image/png";  // or kExrType, page::kPictureType: scene-linear
    int side = 320;                  // largest width and height; of a file
};

// The color of a file, reduced. `enter` gets the bytes of its frame and of the reply before they
// are allocated, and returns when there is room. Errors: (input), (output); (memory): over
// settings.max_memory.
Result<std::string> image_of(const std::string& path, int frame,
                             const sequence::SourceSettings& settings, const ImageForm& form,
                             const std::function<void(uint64_t bytes)>& enter);

struct PreviewRequest {
    Chain chain;
    sequence::RunSettings run;
    int frame = 0;
    double scale = 1;          // of the frame's width and height, at most 1
    bool shows_depth = false;  // the distance of each surface, unfiltered, in place of color
    std::string type = "image/png";
};

// Makes previews, on one thread: its context is current there.
class PreviewMaker {
  public:
    PreviewMaker(const egl::ContextOptions& device, const PassRegistry& registry)
        : device_(device), registry_(registry) {}

    // `over`: whether nobody waits for it any more. Errors: those of reading, of planning and of
    // the device; (canceled): it was over.
    Result<std::string> preview(PreviewRequest& request, const std::function<bool()>& over);
    // Makes the device if there is none, and filters a small image with a known result; after a
    // fault of it with a new device. Errors (gl).
    Status test();
    bool software() const { return context_ && context_->device().software; }
    std::string renderer() const;

  private:
    Result<ImageF> filter(PreviewRequest& request, const std::function<bool()>& over);
    Status make_device();
    Status run_test();

    const egl::ContextOptions device_;
    const PassRegistry& registry_;
    std::unique_ptr<egl::Context> context_;
    std::unique_ptr<Executor> executor_;  // destroyed before its context
};

}  // namespace postchain::service
