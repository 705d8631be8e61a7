// Frames that are only looked at, strip by strip: memory does not grow with their height.
#pragma once

#include <functional>

#include "chain/sign_check.h"
#include "tools/sequence/run/source_strip.h"

namespace postchain::sequence {

// Rows of a strip: as many as take about 64 MiB, whole blocks of lines or tiles.
int strip_rows(const FrameHeader& header);

// Is shown the planes of each strip, from its row `first` on.
using StripObserver = std::function<void(const FramePlanes& planes, int first)>;

// What read_source_frame() finds, without any plane; `rows` of it are in memory at a time.
Result<SourceFrame> scan_source_frame(const SourceSettings& settings, const FrameHeader& header,
                                      RoleSet wanted, int rows, const StripObserver& observer = {});

// The sign self-check of a frame against the next one. `longest_px`: the largest speed in it;
// vectors that lead further up or down than 128 MiB of rows are left out.
Result<SignCheck> scan_signs(const SourceSettings& settings, const FrameHeader& header,
                             const FrameHeader& next, double longest_px, int rows);

}  // namespace postchain::sequence
