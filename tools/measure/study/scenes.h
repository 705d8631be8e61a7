// The scenes of a study's file.
#pragma once

#include "tools/measure/study/reading.h"

namespace postchain::study {

// Keys `settings` and `scenes`. `version`: the command's, for metadata.
void read_scenes(const TextNode& root, Reading& reading, const std::string& version);

}  // namespace postchain::study
