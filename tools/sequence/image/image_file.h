// Reads color from formats other than EXR: stored values are decoded to light and presented as the
// channels R, G, B and A of one part.
//
//   file --OpenImageIO--> stored values --Transfer--> float, linear --PixelFile--> as an EXR's
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/pixel_file.h"
#include "tools/sequence/image/image_calls.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// A format other than EXR for color, and its capabilities.
struct ImageFormat {
    const char* name;  // OpenImageIO's name
    std::vector<const char*> extensions;
    std::vector<int> bits;  // bits of a value; the first is the default for inputs of other formats
    bool alpha;
    bool lossy;
    std::vector<Curve> stated;  // curves that its files can state, in addition to the default one

    // 32: float, any value. HDR's has no sign.
    static bool is_float(int bits) { return bits == 32; }
    bool has_sign() const;
    bool can_have(int bits_of_value) const;
    // Whether values of this curve are read back with it: the file states it, or it is the default
    // (integers srgb, float linear).
    bool tells(Curve curve, int bits_of_value) const;
};

const std::vector<ImageFormat>& image_formats();
// By the extension, case-insensitive; null for EXR and unknown ones.
const ImageFormat* image_format_of(std::string_view path);
// ".png, .tif, ...", for messages.
std::string image_extensions();

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

// The functions of the module of image_calls.h, which is loaded at its first use and stays loaded.
// The loader searches for it like the program's libraries:
// in the build tree, or in lib/postchain of the installation. Thread-safe. Errors (`code`), at
// every call: the module or a library that it needs is missing, or it has another version; with the
// file and a remedy.
Result<const ImageCalls*> image_module(StatusCode code);

}  // namespace postchain::io
