// Channels and compression of an output file, if they differ from those of the input file.
#pragma once

#include <ImfHeader.h>

#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {

// Checks whether `settings` fit these parts, whose color is in the channels `color` of part
// `color_part`. Returns notes for the user, one line each. Errors (usage), without the path: a name
// in ExrSettings::channels that matches no channel, no color channel left, only some channels of
// another part selected, compression that would change float or integer channels other than color.
Result<std::vector<std::string>> check_settings(const std::vector<ExrPart>& parts, int color_part,
                                                const std::vector<std::string>& color,
                                                const ExrSettings& settings);

// Changes the header of the color part: keeps the channels to write, makes float color channels
// half if ExrSettings::half is set, and sets the compression.
void apply_settings(const ExrSettings& settings, const std::vector<std::string>& color,
                    Imf::Header& header);

// Indices of the parts with at least one channel to write.
std::vector<int> written_parts(const std::vector<ExrPart>& parts, const ExrSettings& settings);

}  // namespace postchain::io
