// Low-discrepancy points of the unit 4-cube: lens (x, y), pixel (x, y).
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace postchain::scenes {

// The better pair, dimensions 1-2 of the Sobol sequence (a (0,2)-sequence), goes to the lens where
// there is one, else to the pixel; the other pair is Roberts' R2 sequence (2018: multiples of 1/g
// and 1/g^2, g the plastic number), which has no structure in common with it. All are moved by half
// of 1/count, so that the Sobol points are centered; together with time = (i+0.5)/count they are a
// Hammersley set. One point is the middle: the pixel's center.
std::vector<glm::vec4> sample_points(int count, bool lens);

}  // namespace postchain::scenes
