// What of a file is written, and how it is packed, where that is to differ from the input's file.
#pragma once

#include <ImfHeader.h>

#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"

namespace postchain::io {

// Whether `settings` can be used on these parts, whose color is in the channels `color` of part
// `color_part`. What is worth saying is the result, one line each. Errors (usage), without the
// path: a name of ExrSettings::channels that no channel has, no channel of color left, a part other
// than color's of which only some channels are named, compression that would change float or
// integer channels besides color.
Result<std::vector<std::string>> check_settings(const std::vector<ExrPart>& parts, int color_part,
                                                const std::vector<std::string>& color,
                                                const ExrSettings& settings);

// Leaves the channels that are written in the header of color's part, color's float ones as half
// where that is asked for, and sets its compression.
void apply_settings(const ExrSettings& settings, const std::vector<std::string>& color,
                    Imf::Header& header);

// The parts that are written: those of which a channel is.
std::vector<int> written_parts(const std::vector<ExrPart>& parts, const ExrSettings& settings);

}  // namespace postchain::io
