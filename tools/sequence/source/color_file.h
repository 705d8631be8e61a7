// Reads the color of one file for comparison and display.
#pragma once

#include <string>

#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Color as the file has it, non-finite values included; premultiplied.
struct ColorFile {
    io::InputFrame input;
    std::string profile;
    ImageF& rgba() { return input.planes.at(Role::color); }
};

// Found by profile. Errors (input): no color, unreadable; (memory) two such images exceed the limit
// of `settings`.
Result<ColorFile> read_color(const SourceSettings& settings, const std::string& path, int frame);

}  // namespace postchain::sequence
