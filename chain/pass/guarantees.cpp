#include "chain/pass/guarantees.h"

#include <algorithm>
#include <numeric>

namespace postchain {

Guarantees Guarantees::then(const Guarantees& next) const {
    Guarantees both;
    both.keeps_constants = keeps_constants && next.keeps_constants;
    if (convex && next.convex) both.convex = *convex + *next.convex;
    both.lattice_px = std::lcm(lattice_px, next.lattice_px);  // 0 when one of them is
    std::set_intersection(symmetries.begin(), symmetries.end(), next.symmetries.begin(),
                          next.symmetries.end(),
                          std::inserter(both.symmetries, both.symmetries.end()));
    both.light = std::min(light, next.light);
    // Both must be quiet, and a pass that always acts makes a chain that does.
    if (!driven_by.empty() && !next.driven_by.empty()) both.driven_by = driven_by | next.driven_by;
    return both;
}

}  // namespace postchain
