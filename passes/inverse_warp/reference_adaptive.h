// Adaptive sampling in the inverse warp's double-precision reference. Written from
// docs/inverse_warp.md.
#pragma once

#include <array>
#include <vector>

namespace postchain::inverse_warp::reference {

// What a pixel's samples have seen, in two halves: those whose number has an even count of binary
// digits 1, and the others.
class Halves {
  public:
    // Sample `number` of its set; difference: to the pixel's own color, RGB first.
    void add(int number, const std::vector<double>& difference, double weight);
    // Squared difference of their means as shown, mean of red, green and blue; 0 where a half is
    // empty or not finite. own: the pixel's color
    double noise(const double* own) const;

  private:
    std::array<std::array<double, 3>, 2> sums_ = {};
    std::array<double, 2> weights_ = {};
};

// The weight of each sample beyond the first `samples` in a tile. noise: mean of its pixels
double share_of_more(double noise, int samples);

}  // namespace postchain::inverse_warp::reference
