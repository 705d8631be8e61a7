// Errors visible only over frames, seeds or positions. Formulas: docs/metrics.md.
#pragma once

#include <optional>

#include "tools/measure/metrics/pair.h"

namespace postchain::metrics {

// TDE: mean over pixels, RGB and steps of |(O_t - O_t-1) - (R_t - R_t-1)|, linear values. A
// constant error adds nothing; a flickering one does.
class TemporalError {
  public:
    // Adds the next frame; the first one only initializes. Errors (input): another size.
    Status add(const Pair& pair);
    int steps() const { return steps_; }
    std::optional<double> last() const { return last_; }  // value of the last step
    std::optional<double> mean() const;                   // empty before the second frame

  private:
    ImageF before_;  // test - reference of the previous frame
    double sum_ = 0;
    int steps_ = 0;
    std::optional<double> last_;
};

// Flicker: mean over pixels and RGB of the sample standard deviation (n - 1) over renderings of one
// still input that differ only in their seed.
class Flicker {
  public:
    // Errors (input): another size.
    Status add(const RgbImage& image);
    int seeds() const { return seeds_; }
    std::optional<double> mean() const;  // empty before the second image

  private:
    ImageD mean_;  // running mean and sum of squared deviations (Welford)
    ImageD squares_;
    int seeds_ = 0;
};

// Moves the content by (dx, dy) pixels, +x right, +y down; edges are replicated.
ImageF shifted(const ImageF& image, int dx, int dy);

// Grid: mean over pixels, RGB and shifts of |F(shift(I)) - shift(F(I))|. It is 0 for a filter
// without a grid; for one with tiles, use shifts of 1..tile-1 pixels.
class GridError {
  public:
    // Ignores `margin` pixels along every edge and pixels without content after the shift, because
    // edge effects are not grid effects.
    explicit GridError(int margin) : margin_(margin) {}

    // Adds F(shift(I)), F(I) and the shift. Errors (input): different sizes, no pixels left.
    Status add(const RgbImage& filtered_of_shifted, const RgbImage& filtered, int dx, int dy);
    int shifts() const { return shifts_; }
    std::optional<double> mean() const;  // empty before the first shift

  private:
    int margin_;
    double sum_ = 0;  // sum of the means of the shifts
    int shifts_ = 0;
};

}  // namespace postchain::metrics
