// Color in a file of another format than EXR: the stored values decoded to light, as the channels
// R, G, B and A of one part.
//
//   file --OpenImageIO--> stored values --Transfer--> float, linear --PixelFile--> as an EXR's
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/image/picture_calls.h"
#include "tools/sequence/image/picture_format.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

class PictureFile final : public PixelFile {
  public:
    // `transfer`: what the values mean; not given: what the file says, else sRGB of integers and
    // linear of float. Errors (input), with the path: not there, damaged, of another format than
    // its name says, gray, a volume, more than 16 bits of an integer, a side above the limit, a
    // curve that is not known; also where the module cannot be loaded; those of
    // PictureCalls::from_space.
    static Result<PictureFile> open(const std::string& path, const ReadLimits& limits = {},
                                    std::optional<Transfer> transfer = {});

    const PictureFormat& format() const { return *format_; }
    const PictureInfo& info() const { return info_; }
    Transfer transfer() const { return transfer_; }
    int rows_at_once(int) const override { return info_.height; }

  private:
    ExrPart part() const;
    // A second call for other rows does not decode the file again.
    Status read_planes(PartPixels& pixels) override;

    const PictureFormat* format_ = nullptr;
    PictureInfo info_;
    Transfer transfer_;
    std::shared_ptr<const ImageF> stored_;  // of a color space: as the frames have it
};

// Null if the file is an EXR.
inline const PictureFile* picture_of(const PixelFile& file) {
    return dynamic_cast<const PictureFile*>(&file);
}

}  // namespace postchain::io
