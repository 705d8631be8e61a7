// PNG previews: a tone curve, 8 bits, one atomic file.
#pragma once

#include <optional>
#include <string>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/image/transfer.h"

namespace postchain::io {

// `display`: x/(1+x), then the power 1/2.2. `gamma`: only the power, for display-referred linear
// values. `none`: unchanged. Then clamped to 0..1.
enum class ToneCurve { display, gamma, none };
struct PreviewOptions {
    double exposure_stops = 0;
    ToneCurve curve = ToneCurve::display;
    OnExisting on_existing = OnExisting::fail;
    std::optional<DisplayView> view = {};  // replaces the curve
    std::string provenance = {};           // stored in the file; empty: none
    bool operator==(const PreviewOptions&) const = default;
};
// The first three channels for display, 8 bits (gray for one channel without a view), composited
// over black. Errors: those of ImageCalls::to_view, and if its module cannot be loaded.
Result<Image<uint8_t>> shown_image(const ImageF& color, const PreviewOptions& options = {});
// The preview as a PNG. Errors (output): the encoder's.
Result<std::string> encode_png_preview(const ImageF& color, const PreviewOptions& options = {});
// Writes the preview to a file.
Status write_png_preview(const std::string& path, const ImageF& color,
                         const PreviewOptions& options = {});

// PreviewOptions::provenance of a file; empty if it is missing, incomplete, or has none.
std::string preview_provenance(const std::string& path);

// OUT.png beside OUT.exr.
std::string preview_path(const std::string& output);

}  // namespace postchain::io
