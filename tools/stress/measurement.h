// The work of every check of a cell: it filters frames with the chain under test, and adds what it
// measured, with its images.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/chain.h"
#include "chain/plan/plan.h"
#include "tools/stress/cell.h"
#include "tools/stress/check.h"

namespace postchain::stress {

// Bounds at one precision. fp16 stores velocities, which move taps, and colors with a relative
// error of 2^-11: it needs a larger tolerance, and input changes well above it.
struct Bounds {
    double tolerance = 0;    // relative, of one pixel
    double fraction = 0.01;  // share of pixels above it: taps, steps, ties that round differently
    double mean = 0;         // mean error of the other pixels
    double grid = 0.05;
    double dot = 0;
    double eps = 0;     // relative change of an input
    double color = 4;   // factors
    double motion = 0;  // share of r px: a streak of that length crosses many edges
    double depth = 4;
    double noise = 1;  // per pixel: at most a hard edge of the whole range
};

// One cell with one chain at one precision.
class Measurement {
  public:
    // `images` may be null. `only`: the wanted checks; empty = all.
    Measurement(Executor& executor, const Subject& subject, const MatrixCell& cell,
                Precision precision, std::vector<CheckImages>* images, std::set<std::string> only);
    // Filters the cell. Comes before the checks.
    Status start();
    CellMeasures take() { return std::move(measures_); }

    bool wants(const char* check) const { return only_.empty() || only_.contains(check); }
    const Chain& chain() const { return subject_.chain; }
    const MatrixCell& cell() const { return cell_; }
    const ImageF& color() const { return cell_.planes.at(Role::color); }
    Precision precision() const { return precision_; }
    const Bounds& bounds() const { return bounds_; }
    const ImageF& result() const { return out_; }  // of the complete plan of the cell
    // The planes with color as its storage holds it, as a half file would.
    const FramePlanes& stored_planes() const { return stored_planes_; }
    const FrameDescription& stored_frame() const { return stored_frame_; }
    const ImageF& stored_result() const { return stored_out_; }
    // The expected value as the storage of color can hold it.
    double stored(double value) const;

    // Plans and runs. What start() has run is not run again.
    Result<ImageF> filter(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, bool elide = false);
    Result<ImageF> filter_again();  // the cell, once more
    // Filters planes with the bounds that they have, without elision.
    Result<ImageF> filter_anew(const Chain& chain, FramePlanes planes);

    // NaN is never within a bound.
    void add(const char* check, double value, double bound, std::string note);
    // For the check that was added last.
    void add_images(const ImageF& input, const ImageF& result, const ImageF& compared, ImageF error,
                    const char* compared_is, const char* error_is);
    // Adds the number of pixels of `a` that differ from `b` in any bit.
    void add_equal(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                   const char* compared_is);
    // Adds the mean relative error of `a` against `b`, without the pixels above the tolerance if
    // they are few.
    void add_mean(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                  const char* compared_is);

  private:
    Result<Plan> plan(const Chain& chain, const FrameDescription& frame, bool elide) const;
    Result<ImageF> run(const Plan& plan, const FramePlanes& planes);
    // The cell's description with the bounds of these planes.
    Result<FrameDescription> described(FramePlanes& planes) const;

    Executor& executor_;
    const Subject& subject_;
    const MatrixCell& cell_;
    Precision precision_;
    Bounds bounds_;
    Plan plan_;  // complete plan of the cell, and its result
    ImageF out_;
    FramePlanes stored_planes_;
    FrameDescription stored_frame_;
    ImageF stored_out_;
    CellMeasures measures_;
    std::vector<CheckImages>* images_;
    std::set<std::string> only_;
};

}  // namespace postchain::stress
