// Low-discrepancy points in the unit 4-cube: lens (x, y), pixel (x, y).
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace postchain::scenes {

// Dimensions 1-2 of the Sobol sequence (a (0,2)-sequence), the better pair, go to the lens if there
// is one, otherwise to the pixel. The other pair is Roberts' R2 sequence (2018: multiples of 1/g
// and 1/g^2, g the plastic number), which shares no structure with it. All are shifted by half of
// 1/count, so that the Sobol points are centered; with time = (i+0.5)/count they form a Hammersley
// set. A single point is the pixel center.
std::vector<glm::vec4> sample_points(int count, bool lens);

}  // namespace postchain::scenes
