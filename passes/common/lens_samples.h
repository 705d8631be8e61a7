// Lens samples: points at which light passes through the lens.
#pragma once

#include <array>
#include <vector>

#include "chain/pass/pass.h"
#include "passes/common/aperture.h"

namespace postchain::lens {

// Sets of points; each set, and all sets together, are spread evenly over the aperture. The number
// of sets of `count` points.
int sets_of(int count);

struct Points {
    int count = 0;  // points of a set
    int sets = 0;
    std::vector<std::array<int16_t, 2>> packed;  // set after set; x, y in steps of 1/32767

    std::array<double, 2> at(int point, int set) const;
};

// The largest count that a table holds.
inline constexpr int kMaxLensSamples = 1023;

// `count` in 1..kMaxLensSamples. The points of a set go outward on a Fermat spiral of the golden
// angle (H. Vogel, A better way to construct the sunflower head, 1979). The spiral is mapped to the
// outline of the aperture so that equal areas stay equal, or to its image so that equal shares of
// light do: by angle, and along each direction by radius. The sets turn the spiral, not the
// aperture. The barrel cuts no points. An image must be read.
Points lens_samples(const Aperture& aperture, int count);

// Adds the texture "lens_samples" with lens_samples(), points by sets, x and y in [-1, 1], and the
// order of their times (lens_samples.comp), and the step that fills it.
TextureId add_table(PassPlanner& planner, const Aperture& aperture, int count);

}  // namespace postchain::lens
