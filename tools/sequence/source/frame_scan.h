// Analyzes frames strip by strip, so that memory does not grow with their height.
#pragma once

#include <functional>

#include "chain/sign_check.h"
#include "tools/sequence/source/source_strip.h"

namespace postchain::sequence {

// Rows per strip: about 64 MiB, rounded to whole blocks of lines or tiles.
int strip_rows(const FrameHeader& header);

// Receives the planes of each strip, starting at row `first`.
using StripObserver = std::function<void(const FramePlanes& planes, int first)>;

// The findings of read_source_frame() without planes; `rows` rows are in memory at a time.
Result<SourceFrame> scan_source_frame(const SourceSettings& settings, const FrameHeader& header,
                                      RoleSet wanted, int rows, const StripObserver& observer = {});

// Checks the sign of a frame's motion vectors against the next frame. `longest_px`: the largest
// speed in the frame; vectors that reach more than 128 MiB of rows up or down are skipped.
Result<SignCheck> scan_signs(const SourceSettings& settings, const FrameHeader& header,
                             const FrameHeader& next, double longest_px, int rows);

}  // namespace postchain::sequence
