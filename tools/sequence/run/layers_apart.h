// Layers that a neighbor lacks, where others are there: color is filtered with both neighbors, as
// it is without layers, and these are filtered by steps of their own without that neighbor.
//
//   SourceFrame, layers of the neighbors --set_apart--> SourceFrame::layers_apart
//   the rest, filtered --filter_apart--> all layers, filtered
#pragma once

#include <map>
#include <string>

#include "chain/gl/executor.h"
#include "chain/planner.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// A neighbor that is handed in: what it has, and the plane of its layers as of the frame's window,
// none where it has none.
struct NeighborLayers {
    const FrameLayers* found = nullptr;
    std::shared_ptr<const ImageF> plane;
};

// The names of the layers and cryptomattes that are filtered of a frame and are not of the other.
std::vector<std::string> layers_lacking(const FrameLayers& frame, const FrameLayers& other);

// `frame` has its own layers in its planes, and gets those of the neighbors: of each that which
// `frame` has, in its order. Those that a neighbor lacks leave the planes for
// SourceFrame::layers_apart.
void set_apart(const std::map<Neighbor, NeighborLayers>& neighbors, SourceFrame& frame);

// All layers of the frame filtered, one below another, in the order of FrameLayers::filtered.
// `together`: those that were filtered with color. Errors: those of planning and filtering.
Result<ImageF> filter_apart(const Chain& chain, const SourceFrame& frame,
                            const PlanOptions& options, Executor& executor, const ImageF& together);

}  // namespace postchain::sequence
