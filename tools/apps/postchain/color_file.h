// The color of one file, as it is compared and shown.
#pragma once

#include <string>

#include "tools/sequence/run/frame_source.h"

namespace postchain {

// Color as the file has it, non-finite values included; premultiplied.
struct ColorFile {
    io::InputFrame input;
    ImageF& rgba() { return input.planes.at(Role::color); }
};

// Found by profile. Errors (input): no color, unreadable; (memory) two such pictures take more than
// `settings` allow.
Result<ColorFile> read_color(const sequence::SourceSettings& settings, const std::string& path,
                             int frame);

}  // namespace postchain
