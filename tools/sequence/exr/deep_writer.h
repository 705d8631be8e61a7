// Writes a deep EXR of one part, with scan lines and ZIPS.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/write_options.h"

namespace postchain::io {

struct DeepChannel {
    std::string name;
    PixelType type = PixelType::float32;  // or half
    std::vector<float> values;            // one per sample, pixel by pixel
};
struct DeepSamples {
    int width = 0;
    int height = 0;
    std::vector<uint32_t> counts;  // samples of each pixel, rows top-down
    std::vector<DeepChannel> channels;
};

// Errors (output); (internal): numbers of values that differ, an integer channel.
Result<WriteReport> write_deep_exr(const std::string& path, const DeepSamples& samples,
                                   const WriteOptions& options = {});

}  // namespace postchain::io
