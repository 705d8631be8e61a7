// Settings by which an output file differs from its input: compression, type of color, channels.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sequence/exr/exr_compression.h"

namespace postchain::io {

struct ExrSettings {
    std::optional<ExrCompression> compression;  // of the color part; unset: as in the input
    bool half = false;                          // float channels of color become half
    std::vector<std::string> channels;          // patterns, * matches any text; empty: all

    // Whether the channel is written.
    bool takes(std::string_view channel) const;
};

// Whether `name` matches `pattern`, in which * matches any text.
bool matches(std::string_view pattern, std::string_view name);

}  // namespace postchain::io
