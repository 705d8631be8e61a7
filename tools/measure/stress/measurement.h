// One cell under one chain at one precision: what measure() does, inside this folder alone.
//
//   check.h         the chain and its numbers, the precision, measure()
//   measurement.h   running it, and the checks of one picture
//   equivariance.h  turns, moves and the dot
#pragma once

#include "chain/planner.h"
#include "tools/measure/stress/check.h"
#include "tools/measure/stress/transform.h"

namespace postchain::stress {

// Bounds at one precision. fp16 stores a velocity to 2^-11 of itself, which moves taps, and a color
// too: a larger tolerance, and a change of the input that stands out of that.
struct Bounds {
    double tolerance = 0;    // of one pixel, relative
    double fraction = 0.01;  // of pixels above it: taps and steps that round the other way, ties
    double mean = 0;         // error of the others, in the mean
    double grid = 0.05;
    double dot = 0;
    double eps = 0;     // change of an input, relative
    double color = 4;   // factors
    double motion = 0;  // of r px: a streak of that length crosses many edges
    double depth = 4;
};
Bounds bounds_of(Precision precision, int tile);

// The largest half.
inline constexpr float kMaxHalf = 65504;
// A pixel jumps when it changes by more than this many times eps of the largest color.
inline constexpr double kJump = 20;
// Errors are relative to at least this part of the largest.
inline constexpr double kRelativeFloor = 1e-4;

class Measurement {
  public:
    Measurement(Executor& executor, const Subject& subject, const Cell& cell, Precision precision,
                std::vector<Exhibit>* exhibits);
    virtual ~Measurement() = default;
    Result<CellMeasures> all();

  protected:
    const ImageF& color() const { return cell_.planes.at(Role::color); }
    Result<ImageF> filter(const Chain& chain, const FrameDescription& frame,
                          const FramePlanes& planes, bool elide = false);
    // The frame's bounds as they are with these planes.
    Result<FrameDescription> described(FramePlanes& planes) const;
    // The frame of these planes, filtered with nothing left out.
    Result<ImageF> filter_anew(const Chain& chain, FramePlanes planes);
    // What the storage of color can hold of an expected value.
    double held(double value) const;

    // NaN is never inside a bound.
    void add(const char* check, double value, double bound, std::string note);
    void exhibit(const ImageF& input, const ImageF& result, const ImageF& compared, ImageF error,
                 const char* compared_is, const char* error_is);
    // Pixels of `a` that are not those of `b`, bit for bit.
    void add_equal(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                   const char* compared_is);
    // Mean relative error of `a` against `b`, without the pixels above the tolerance if they are
    // few.
    void add_mean(const char* check, const ImageF& input, const ImageF& a, const ImageF& b,
                  const char* compared_is);

    void finite();
    Status range();
    Status constant();
    Status elided();
    Status repeat();
    void identity();
    Status reference();
    Status continuity();

    // Checks of more than one picture (equivariance.h).
    virtual Status turns() = 0;
    virtual Status shift() = 0;
    virtual Status dot() = 0;

    Executor& executor_;
    const Subject& subject_;
    const Cell& cell_;
    Precision precision_;
    Bounds bounds_;
    ImageF out_;
    // The same where the storage of color holds the whole input, as a half file would bring it.
    FramePlanes held_planes_;
    FrameDescription held_frame_;
    ImageF held_out_;
    CellMeasures measures_;
    std::vector<Exhibit>* exhibits_;
};

// Per pixel the largest of its channels' |a - b| / max(|a|, |b|, floor), the floor a part of the
// largest of `input`; not finite: infinite.
ImageF errors_of(const ImageF& input, const ImageF& a, const ImageF& b);
double largest_of(const ImageF& image);  // |value|
double mean_of(const ImageF& image);     // |value|
std::string place_of(const ImageF& image, size_t pixel);

}  // namespace postchain::stress
