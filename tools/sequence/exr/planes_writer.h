// Writes an EXR of one part from planes in memory: stages, scenes, images of reports.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "tools/sequence/exr/write_options.h"

namespace postchain::io {

using AttributeValue = std::variant<std::string, float, int>;

struct PlaneChannel {
    std::string name;  // in the file
    PixelType type = PixelType::float32;
    const ImageF* image = nullptr;
    int index = 0;  // channel of the image
};
struct PlanesFile {
    std::vector<PlaneChannel> channels;  // images of one size
    std::map<std::string, AttributeValue> attributes;
    int origin_x = 0;  // corner of the data window
    int origin_y = 0;
    std::optional<Window> display_window;  // default: the data window
};
// Writes scan lines with ZIP or WriteOptions::exr's compression. Half channels follow `overflow`.
// Errors (output); (internal): sizes that differ, no channels.
Result<WriteReport> write_planes_exr(const std::string& path, const PlanesFile& file,
                                     const WriteOptions& options = {});
// Writes all channels of one image as float.
Result<WriteReport> write_planes_exr(const std::string& path, const ImageF& image,
                                     const std::vector<std::string>& names,
                                     OnExisting on_existing = OnExisting::fail);

// The bytes of a file with all channels of one image as float.
Result<std::string> planes_exr_bytes(const ImageF& image, const std::vector<std::string>& names);

}  // namespace postchain::io
