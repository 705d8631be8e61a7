// Writing an EXR of one part from planes of our own: stages, scenes, pictures of reports.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "chain/image.h"
#include "chain/status.h"
#include "tools/sequence/exr/write_options.h"

namespace postchain::io {

using AttributeValue = std::variant<std::string, float, int>;

// A single-part file made of planes: stages, scenes.
struct PlaneChannel {
    std::string name;  // in the file
    PixelType type = PixelType::float32;
    const ImageF* image = nullptr;
    int index = 0;  // channel of the image
};
struct PlanesFile {
    std::vector<PlaneChannel> channels;  // images of one size
    std::map<std::string, AttributeValue> attributes;
    int origin_x = 0;  // of the data window
    int origin_y = 0;
    std::optional<Window> display_window;  // the data window when not given
};
// ZIP or WriteOptions::exr's compression, scanlines. Half channels follow `overflow`; Inf and NaN
// of a half channel are written as they are where the plane has them. Errors (output); (internal):
// sizes that differ, no channels.
Result<WriteReport> write_planes_exr(const std::string& path, const PlanesFile& file,
                                     const WriteOptions& options = {});
// All channels of one image as float.
Result<WriteReport> write_planes_exr(const std::string& path, const ImageF& image,
                                     const std::vector<std::string>& names,
                                     OnExisting on_existing = OnExisting::fail);

// The bytes of such a file.
Result<std::string> planes_exr_bytes(const ImageF& image, const std::vector<std::string>& names);

}  // namespace postchain::io
