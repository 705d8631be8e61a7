// How an output's file may differ from its input's: compression, type of color, which channels.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/sequence/exr/exr_compression.h"

namespace postchain::io {

struct ExrSettings {
    std::optional<ExrCompression> compression;  // of color's part; none: the input's
    bool half = false;                          // float channels of color become half
    std::vector<std::string> channels;          // in which * stands for any text; empty: all

    // Whether a channel is written.
    bool takes(std::string_view channel) const;
};

// Whether `name` is one that `pattern` stands for.
bool matches(std::string_view pattern, std::string_view name);

}  // namespace postchain::io
