// Low-discrepancy points of the unit 4-cube: lens (x, y), pixel (x, y).
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace postchain::scenes {

// Points 0..count-1 of the Sobol sequence (direction numbers of Joe and Kuo 2008), dimensions 1-2
// for the lens and 3-4 for the pixel, all moved by half of 1/count so that a picture without lens
// and shutter is centred. Together with time = (i+0.5)/count a Hammersley set. One point is the
// middle: the pixel's centre.
std::vector<glm::vec4> sample_points(int count);

}  // namespace postchain::scenes
