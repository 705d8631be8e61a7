// Joins a frame with planes of other renders that its chain reads: those of the frames before and
// after, and the layer behind (chain/frame/behind.h), a second render of the same camera.
//
// Layers that one neighbor lacks are filtered separately, without it (filter/filter_view.h). Color
// is filtered with both neighbors, as it is without layers.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

// A neighbor that was read.
struct NeighborFrame {
    const FrameHeader* header = nullptr;
    const SharedPlanes* planes = nullptr;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
};

// The planes of FrameHeader::to_read. Layers that a neighbor lacks become
// SourceFrame::separate_layers.
void add_neighbors(const std::map<Neighbor, NeighborFrame>& neighbors, SourceFrame& frame);

// Names of the layers and cryptomattes that are filtered in `frame` but not in `other`.
std::vector<std::string> layers_lacking(const FrameLayers& frame, const FrameLayers& other);

// Opens the file of a frame's layer behind. Errors (input), naming the file: those of
// open_source_frame(); another display window than the frame's; no depth, motion vectors or layer
// that the frame has and its chain reads.
Result<FrameHeader> open_behind(const SourceSettings& settings, const std::string& path,
                                const FrameHeader& frame);
// As open_behind(), of a file that is open. Errors: as open_behind(), without a failure to open it.
Result<FrameHeader> behind_of(FrameHeader behind, const FrameHeader& frame);

// Memory to read it and to keep it, stacked.
uint64_t behind_bytes(const FrameHeader& behind);

// Reads it and adds it to the frame, whose neighbors are already added. Some frames are filtered
// without it, with a warning: it holds no cryptomattes, and all its layers go with color. Errors:
// those of read_source_frame().
Status add_behind(const SourceSettings& settings, const FrameHeader& behind, SourceFrame& frame);

}  // namespace postchain::sequence
