// Are depth and motion at the border of two surfaces those of one of them, or averaged?
//
// A pixel is between two surfaces where those on either side of it, left and right or above and
// below, differ: depths by more than 5 %, vectors by more than 1 px; and each of them hardly
// differs from the next pixel on its side, so that slopes do not count. Its value is mixed where it
// lies between theirs, at least a quarter of the way from each. Averages over the samples of
// antialiased pixels are mixed in about half of them, values of one sample in next to none.
#pragma once

#include <cstdint>

#include "chain/frame.h"
#include "chain/strip.h"

namespace postchain::sequence {

// Parts of the pixels between two surfaces; 0 where there is none, or no such plane.
struct MixedEdges {
    double depth = 0;
    double motion = 0;
};

// Pixels between two surfaces, and those of them that are mixed.
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

// Of the canonical planes; looks at every fourth row, and at two rows on either side of it.
MixedEdgeCounts count_mixed_edges(const FramePlanes& planes, const Strip& strip);

}  // namespace postchain::sequence
