// Errors that only show over frames, seeds or positions. Formulas: docs/metrics.md.
#pragma once

#include <optional>

#include "tools/measure/metrics/pair.h"

namespace postchain::metrics {

// TDE: mean over pixels, RGB and steps of |(O_t - O_t-1) - (R_t - R_t-1)|, linear values. What an
// constant error does not add to, and one that flickers does.
class TemporalError {
  public:
    // The next frame; the first one only starts. Errors (input): another size than before.
    Status add(const Pair& pair);
    int steps() const { return steps_; }
    std::optional<double> last() const { return last_; }  // of the last step alone
    std::optional<double> mean() const;                   // nothing before the second frame

  private:
    ImageF before_;  // test - reference of the frame before
    double sum_ = 0;
    int steps_ = 0;
    std::optional<double> last_;
};

// Flicker: mean over pixels and RGB of the standard deviation over the renderings of one still
// input that differ in their seed alone. Of the sample (n - 1), so that more seeds estimate the
// same number more closely.
class Flicker {
  public:
    // Errors (input): another size than before.
    Status add(const Picture& picture);
    int seeds() const { return seeds_; }
    std::optional<double> mean() const;  // nothing before the second picture

  private:
    ImageD mean_;  // running mean and sum of squared deviations (Welford)
    ImageD squares_;
    int seeds_ = 0;
};

// The content moved by (dx, dy) pixels, +x right, +y down; edges are replicated.
ImageF shifted(const ImageF& image, int dx, int dy);

// Grid: mean over pixels, RGB and shifts of |F(shift(I)) - shift(F(I))|. A filter without a grid
// does not care where the picture lies; one with tiles is to be given shifts of 1..tile-1 pixels.
class GridError {
  public:
    // `margin` pixels along every edge, and those without content after the shift, are not looked
    // at: what a filter does at a picture's edge is no matter of grids.
    explicit GridError(int margin) : margin_(margin) {}

    // F(shift(I)) and F(I) and the shift. Errors (input): sizes that differ, nothing left inside.
    Status add(const Picture& filtered_of_shifted, const Picture& filtered, int dx, int dy);
    int shifts() const { return shifts_; }
    std::optional<double> mean() const;  // nothing before the first shift

  private:
    int margin_;
    double sum_ = 0;  // of the means of single shifts
    int shifts_ = 0;
};

}  // namespace postchain::metrics
