// How the samples of a deep pixel become one value for each channel.
#pragma once

#include <optional>
#include <set>
#include <string>

namespace postchain::io {

struct Flattening {
    bool behind = false;      // only the samples behind the pixel's surface (deep_pixel.h)
    std::string depth = "Z";  // the channel that orders samples; "ZBack" is a volume's far end
    std::string alpha = "A";  // without it every sample is opaque
    // Composited channels. In all others a pixel has the value of its surface. Empty: those named
    // R, G, B or A in their layer.
    std::optional<std::set<std::string>> color = {};

    bool is_color(const std::string& channel) const {
        if (color || channel == alpha) return channel == alpha || color->contains(channel);
        const std::string last = channel.substr(channel.rfind('.') + 1);
        return last == "R" || last == "G" || last == "B" || last == "A";
    }
};

}  // namespace postchain::io
