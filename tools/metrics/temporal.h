// Errors visible only over frames, seeds or positions. Formulas: docs/metrics.md.
#pragma once

#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "tools/metrics/compare.h"
#include "tools/metrics/pair.h"

namespace postchain::metrics {

// The last class that applies to a pixel (tools/measure/experiment/pixel_classes.h).
enum class PixelClass : uint8_t { still, moving, defocused, outline };
inline constexpr const char* kPixelClassNames[] = {"still", "moving", "defocused", "outline"};
inline constexpr size_t kPixelClasses = std::size(kPixelClassNames);

// A change of the ground truth below one step of an 8-bit display counts as this step.
inline constexpr double kLeastChange = 1.0 / 255;

// tde and temporal_error; then temporal_error_still and so on, of each class of pixels.
const std::vector<MetricRow>& temporal_rows();
const std::vector<MetricRow>& temporal_class_rows();
bool is_temporal(const std::string& name);  // in temporal_rows()

// The change of the error from frame to frame, e_t - e_t-1.
//   tde             mean |change| over pixels and RGB, linear
//   temporal_error  rms of the displayed change over the rms of the ground truth's own change
// A constant error adds nothing; a flickering one does.
class TemporalError {
  public:
    // Adds the next frame; the first one only initializes. `classes`: of its pixels; may be empty.
    // Errors (input): another size.
    Status add(const Pair& pair, Image<PixelClass> classes = {});
    // Of the last step, by both lists of rows. A class without pixels has no value, and none has
    // one before the second frame.
    const Values& last() const { return last_; }

  private:
    std::optional<Pair> before_;
    Image<PixelClass> classes_before_;
    Values last_;
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
