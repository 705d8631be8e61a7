// Edges of surfaces: detects depth and motion that were averaged there, and gives partly covered
// pixels before a clear background the surface's.
//
// A pixel lies between two surfaces if its neighbors, left and right or above and below, differ:
// depths by more than 5 %, motion vectors by more than 1 px; and each neighbor hardly differs from
// the next pixel on its side, so that slopes do not count. Its value is mixed if it is at least a
// quarter of the difference away from both. If samples were averaged, about half of the border
// pixels are mixed; if one sample was stored, almost none.
//
// Before a clear background color is antialiased, but depth is one sample: a pixel that a surface
// covers partly may have the background's infinite depth and would be blurred with it. Since the
// background is clear, all light and alpha of the pixel belong to the surface.
#pragma once

#include <cstdint>

#include "chain/base/image.h"
#include "chain/frame/frame.h"

namespace postchain::sequence {

// Fraction of mixed pixels between two surfaces; 0 if there are none or the plane is missing.
struct MixedEdges {
    double depth = 0;
    double motion = 0;
};

// Number of pixels between two surfaces, and how many of them are mixed.
struct MixedEdgeCounts {
    struct Count {
        uint64_t edges = 0, mixed = 0;
        double part() const { return edges > 0 ? double(mixed) / double(edges) : 0; }
    };
    Count depth, motion;
    MixedEdges parts() const { return {depth.part(), motion.part()}; }
};

// Counts in canonical planes; reads every fourth row and two rows on either side of it.
MixedEdgeCounts count_mixed_edges(const FramePlanes& planes);

// Gives partly covered (0 < alpha < 1), infinitely far pixels of a canonical frame the depth and
// motion vectors of a nearby surface: from the smallest square around the pixel, at most 3 pixels
// away, that contains a surface pixel, the one with the largest alpha. Bounds stay valid. Returns
// how many pixels it changed.
uint64_t fill_clear_edges(FramePlanes& planes);

}  // namespace postchain::sequence
