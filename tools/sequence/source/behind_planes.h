// Joins a frame with the layer behind (chain/behind.h), a second render of the same camera.
#pragma once

#include <string>

#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

// Opens the file of a frame's layer behind. Errors (input), naming the file: those of
// open_source_frame(); another display window than the frame's; no depth, motion vectors or layer
// that the frame has and its chain reads.
Result<OpenedFrame> open_behind(const SourceSettings& settings, const std::string& path,
                                const OpenedFrame& frame);

// Memory to read it and to keep it, stacked.
uint64_t behind_bytes(const OpenedFrame& behind);

// Reads it and adds it to the frame, whose neighbors are already added. Some frames are filtered
// without it, with a warning: it holds no cryptomattes, and all its layers go with color. Errors:
// those of read_source_frame().
Status add_behind(const SourceSettings& settings, const OpenedFrame& behind,
                  const FrameHeader& header, SourceFrame& frame);

}  // namespace postchain::sequence
