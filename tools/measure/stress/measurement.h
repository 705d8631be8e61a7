// Measures one cell with one chain at one precision; internal to this folder.
//
//   check.h         the chain and its numbers, the precision, measure()
//   measurement.h   running it, and the checks of one image
//   equivariance.h  turns, moves and the dot
#pragma once

#include <set>

#include "chain/planner.h"
#include "shaders/shared/color_limits.h"
#include "tools/measure/stress/check.h"
#include "tools/measure/stress/transform.h"

namespace postchain::stress {

// Bounds at one precision. fp16 stores velocities, which move taps, and colors with a relative
// error of 2^-11: it needs a larger tolerance, and input changes well above it.
struct Bounds {
    double tolerance = 0;    // relative, of one pixel
    double fraction = 0.01;  // of pixels above it: taps, steps and ties that round differently
    double mean = 0;         // mean error of the other pixels
    double grid = 0.05;
    double dot = 0;
    double eps = 0;     // relative change of an input
    double color = 4;   // factors
    double motion = 0;  // of r px: a streak of that length crosses many edges
    double depth = 4;
};
Bounds bounds_of(Precision precision, int tile);

using shared::kMaxHalf;
// A pixel jumps if it changes by more than this multiple of eps times the largest color.
inline constexpr double kJump = 20;
// A change of depth is small only if it changes the circle of confusion of a surface in focus by at
// most this.
inline constexpr double kMaxRadiusChangePx = 0.25;
// Lower limit of the divisor of relative errors, as a fraction of the largest value.
inline constexpr double kRelativeFloor = 1e-4;

class Measurement {
  public:
    Measurement(Executor& executor, const Subject& subject, const Cell& cell, Precision precision,
                std::vector<Exhibit>* exhibits, std::set<std::string> only);
    virtual ~Measurement() = default;
    Result<CellMeasures> all();  // or those in `only`, if it is not empty

  protected:
    const ImageF& color() const { return cell_.planes.at(Role::color); }
    bool wants(const char* check) const { return only_.empty() || only_.contains(check); }
    Result<Plan> plan(const Chain& chain, const FrameDescription& frame, bool elide) const;
    Result<ImageF> run(const Plan& plan, const FramePlanes& planes);
    // Plans and runs. The plan and the planes of `out_` are not run again.
    Result<ImageF> filter(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, bool elide = false);
    // The frame's description with the bounds of these planes.
    Result<FrameDescription> described(FramePlanes& planes) const;
    // Filters these planes without elision.
    Result<ImageF> filter_anew(const Chain& chain, FramePlanes planes);
    // The expected value as the storage of color can hold it.
    double held(double value) const;

    // NaN is never within a bound.
    void add(const char* check, double value, double bound, std::string note);
    void exhibit(const ImageF& input, const ImageF& result, const ImageF& compared, ImageF error,
                 const char* compared_is, const char* error_is);
    // Adds the number of pixels of `a` that differ from `b` in any bit.
    void add_equal(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                   const char* compared_is);
    // Adds the mean relative error of `a` against `b`, without the pixels above the tolerance if
    // they are few.
    void add_mean(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                  const char* compared_is);

    Status hold();  // fills what is held
    void finite();
    Status range();
    Status constant();
    Status elided();
    Status repeat();
    void identity();
    Status reference();
    Status continuity();

    // Checks that need more than one image (equivariance.h).
    virtual Status turns() = 0;
    virtual Status shift() = 0;
    virtual Status dot() = 0;

    Executor& executor_;
    const Subject& subject_;
    const Cell& cell_;
    Precision precision_;
    Bounds bounds_;
    Plan plan_;  // of the cell, complete, and its result
    ImageF out_;
    // The planes with color as its storage holds it, as a half file would.
    FramePlanes held_planes_;
    FrameDescription held_frame_;
    ImageF held_out_;
    CellMeasures measures_;
    std::vector<Exhibit>* exhibits_;
    std::set<std::string> only_;
};

// Per pixel the maximum over channels of |a - b| / max(|a|, |b|, floor), with the floor relative to
// the largest value of `input`; infinite if not finite.
ImageF errors_of(const ImageF& input, const ImageF& a, const ImageF& b);
double largest_of(const ImageF& image);  // |value|
double mean_of(const ImageF& image);     // |value|
std::string place_of(const ImageF& image, size_t pixel);

}  // namespace postchain::stress
