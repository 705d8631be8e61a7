// Reads color from formats other than EXR: stored values are decoded to light and presented as the
// channels R, G, B and A of one part.
//
//   file --OpenImageIO--> stored values --Transfer--> float, linear --PixelFile--> as an EXR's
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/image/image_calls.h"
#include "tools/sequence/image/image_format.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

class ImageFile final : public PixelFile {
  public:
    // `transfer`: of the stored values; default: stated by the file, otherwise sRGB for integers
    // and linear for float. Errors (input), with the path: missing, damaged, format contradicts its
    // name, gray, a volume, integers above 16 bits, above `limits`, unknown curve, the module
    // cannot be loaded; those of ImageCalls::from_space.
    static Result<ImageFile> open(const std::string& path, const ReadLimits& limits = {},
                                  std::optional<Transfer> transfer = {});

    const ImageFormat& format() const { return *format_; }
    const ImageInfo& info() const { return info_; }
    Transfer transfer() const { return transfer_; }
    int rows_at_once(int) const override { return info_.height; }

  private:
    ExrPart part() const;
    // A second call for other rows does not decode the file again.
    Status read_planes(PartPixels& pixels) override;

    const ImageFormat* format_ = nullptr;
    ImageInfo info_;
    Transfer transfer_;
    std::shared_ptr<const ImageF> stored_;  // with a color space: converted to the frames' space
};

// Null if the file is an EXR.
inline const ImageFile* picture_of(const PixelFile& file) {
    return dynamic_cast<const ImageFile*>(&file);
}

}  // namespace postchain::io
