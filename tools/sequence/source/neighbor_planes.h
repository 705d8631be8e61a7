// Joins a frame with the planes of the frames before and after that its chain reads.
#pragma once

#include <map>
#include <memory>

#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// A neighbor that was read.
struct NeighborFrame {
    const FrameHeader* header = nullptr;
    const SharedPlanes* planes = nullptr;
    std::shared_ptr<const FrameCryptomattes> cryptomattes;
};

// Moves a plane, or stacked planes, from the window `from` to the window `to`.
ImageF moved(const ImageF& plane, const io::Window& from, const io::Window& to);

// `planes`: planes_to_read() of the frame; `window`: that of its planes. Layers that a neighbor
// lacks are set apart (layers_apart.h).
void add_neighbors(const std::map<Neighbor, NeighborFrame>& neighbors, RoleSet planes,
                   const io::Window& window, SourceFrame& frame);

}  // namespace postchain::sequence
