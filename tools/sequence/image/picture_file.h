// Color in a file of another format than EXR: the stored values decoded to light, as the channels
// R, G, B and A of one part.
//
//   file --OpenImageIO--> stored values --Transfer--> float, linear --ExrFile--> as any EXR's
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/image/picture_calls.h"
#include "tools/sequence/image/picture_format.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

class PictureFile {
  public:
    // `transfer`: what the values mean; not given: what the file says, else sRGB of integers and
    // linear of float. Errors (input), with the path: not there, damaged, of another format than
    // its name says, gray, a volume, more than 16 bits of an integer, a side above the limit, a
    // curve that is not known; also where the module cannot be loaded; those of
    // PictureCalls::from_space.
    static Result<PictureFile> open(const std::string& path, const ReadLimits& limits,
                                    std::optional<Transfer> transfer);

    const PictureFormat& format() const { return *format_; }
    const PictureInfo& info() const { return info_; }
    Transfer transfer() const { return transfer_; }
    ExrPart part() const;

    // Fills planes of some of the rows, tightly packed float each, by the names of part(). A second
    // call for other rows does not decode the file again. Errors (input): damaged or truncated.
    Status read(PartPixels& pixels);

  private:
    std::string path_;
    const PictureFormat* format_ = nullptr;
    PictureInfo info_;
    Transfer transfer_;
    std::shared_ptr<const ImageF> stored_;  // of a color space: as the frames have it
};

}  // namespace postchain::io
