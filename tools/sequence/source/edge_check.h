// Detects depth and motion that were averaged at the borders of surfaces.
//
// A pixel lies between two surfaces if its neighbors, left and right or above and below, differ:
// depths by more than 5 %, motion vectors by more than 1 px; and each neighbor hardly differs from
// the next pixel on its side, so that slopes do not count. Its value is mixed if it is at least a
// quarter of the difference away from both. If samples were averaged, about half of the border
// pixels are mixed; if one sample was stored, almost none.
#pragma once

#include <cstdint>

#include "chain/frame.h"
#include "chain/image.h"

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
        void add(const Count& more) {
            edges += more.edges;
            mixed += more.mixed;
        }
        double part() const { return edges > 0 ? double(mixed) / double(edges) : 0; }
    };
    Count depth, motion;
    MixedEdges parts() const { return {depth.part(), motion.part()}; }
};

// Counts in canonical planes; reads every fourth row and two rows on either side of it.
MixedEdgeCounts count_mixed_edges(const FramePlanes& planes, const Strip& strip);

}  // namespace postchain::sequence
