// Handles layers that one neighbor lacks. Color is filtered with both neighbors, as it is without
// layers; these layers are filtered separately, without that neighbor.
//
//   SourceFrame, layers of the neighbors --set_apart--> SourceFrame::layers_apart
//   the rest, filtered --filter_apart--> all layers, filtered
#pragma once

#include <map>
#include <string>

#include "chain/gl/executor.h"
#include "chain/planner.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// A neighbor in use: its header and its layer plane in the frame's window, if it has layers.
struct NeighborLayers {
    const FrameLayers* found = nullptr;
    std::shared_ptr<const ImageF> plane;
};

// Names of the layers and cryptomattes that are filtered in `frame` but not in `other`.
std::vector<std::string> layers_lacking(const FrameLayers& frame, const FrameLayers& other);

// A stack of the layers filtered in `of`, as `wanted` orders them, which lacks none of them.
std::shared_ptr<const ImageF> layers_in_order(const ImageF& stack, const FrameLayers& of,
                                              const FrameLayers& wanted);

// Adds to `frame` the neighbors' layers that it has too, in its order. Layers that a neighbor lacks
// move from the planes to SourceFrame::layers_apart.
void set_apart(const std::map<Neighbor, NeighborLayers>& neighbors, SourceFrame& frame);

// All filtered layers of the frame, stacked in the order of FrameLayers::filtered. `together`:
// those filtered with color. Errors: those of planning and filtering.
Result<ImageF> filter_apart(const Chain& chain, const SourceFrame& frame,
                            const PlanOptions& options, Executor& executor, const ImageF& together);

}  // namespace postchain::sequence
