// The signed circle of confusion in double precision: the plan decides by it, and the uniform
// blocks of shaders/common/circle_of_confusion.glsl are filled from it.
//
// Described in docs/depth_of_field.md, "Circle of confusion". Radius R in pixels of the full
// image, half the diameter c; R > 0 behind the focus plane, R < 0 in front of it. Pixels that are
// not square: R counts their shorter sides (pixel_axes()). With w = 1/d:
//
//   lens          R = gain (1/s - w)    gain = f_px A / 2, f_px = f W / sensor_width, A = f/N
//   + breathing   gain = f_px A / 2 * s/(s - f), which makes c = f^2/(N (s-f)) W/sensor (1 - s w)
//   planes        R = far_radius clamp((d - far_sharp)/(far_blurry - far_sharp), 0, 1)
//                   - near_radius clamp((near_sharp - d)/(near_sharp - near_blurry), 0, 1)
//   range         R = max_radius clamp((d - focus)/range, -1, 1): planes with both sharp planes at
//                 the focus, both ramps `range` long and both radii max_radius
//
// |R| <= max_radius_px always. In w (lens) and in d (planes) R is monotonic, so its largest
// magnitude over a range of depths is at one of the two ends.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "chain/base/status.h"
#include "chain/frame/frame.h"
#include "chain/frame/origin.h"
#include "passes/common/lens.h"

namespace postchain::lens {

struct CircleOfConfusion {
    bool lens = true;  // otherwise planes
    // lens
    double gain_px = 0;        // pixels times scene units
    double focus_inverse = 0;  // 1/s, 1/scene units
    double focal_inverse = 0;  // 1/f, 1/scene units
    // planes, scene units
    double near_sharp = 0;
    double near_span = 1;
    double far_sharp = 0;
    double far_span = 1;
    double near_radius_px = 0;
    double far_radius_px = 0;

    double max_radius_px = 0;
    const char* limit = "max_radius_px";  // the parameter that sets it
    std::array<double, 2> axes = {1, 1};  // of a circle on the display: pixels per shorter side

    // R at inverse depth w (1/scene units); 0 = sky, NaN and negative count as sky.
    double radius_px(double w) const;
    // An upper bound of |R| for inverse depths in [w_min, w_max] that holds for the fp32
    // evaluation on the GPU too.
    double largest_radius_px(double w_min, double w_max) const;
    // |R| without max_radius_px, largest over these depths.
    double largest_unclamped_radius_px(double w_min, double w_max) const;
    // An upper bound of |R| over all depths.
    double largest_radius_px() const;
    // lens: the larger of |R| at infinity and at kTypicalFocalLengths; a function of the camera
    // alone, continuous in each of its values. With the focus up to twice kTypicalFocalLengths away
    // it is the radius at infinity; with the focus at infinity, whose radius is 0, that of the
    // foreground.
    double typical_radius_px() const;
};

// Distance of a typical foreground, in focal lengths: 1 m for 50 mm. A ratio of two lengths, so it
// has no world units.
inline constexpr double kTypicalFocalLengths = 20;

// Pixels along x and y that are as long as the shorter side of a pixel: {1, 1} for square ones.
std::array<double, 2> pixel_axes(const FrameDescription& frame);

// The largest radius that the parameters set, or its default for this frame; `unset_fraction`:
// kMaxRadiusFraction or kSmallMaxRadiusFraction.
double max_radius_px(const Parameters& parameters, const FrameDescription& frame,
                     double unset_fraction = kMaxRadiusFraction);

// The largest radius if the frame's depths exceed it.
std::vector<ExceededLimit> exceeded_limits(const CircleOfConfusion& coc,
                                           const FrameDescription& frame);

// Places whose depth must be known: Pass::depth_places().
std::vector<Place> depth_places(const Parameters& parameters);

// All values known and checked. Errors: StatusCode::chain; the message has the parameter, its
// value, its origin and the remedy.
Result<CircleOfConfusion> circle_of_confusion(const Parameters& parameters,
                                              const FrameDescription& frame,
                                              double unset_fraction = kMaxRadiusFraction);

// A circle of confusion of this kind, without the values of a lens: for listing programs, which
// depend only on the kind.
CircleOfConfusion any_circle_of_confusion(const Parameters& parameters);

// The resolved lens; the diameter of the largest circle of confusion on this frame, if its depths
// are known; and the limits of sharpness, circles of at most `sharp_radius_px`. A far limit without
// a value: everything beyond the near limit is sharp.
std::vector<UsedValue> used_values(const Parameters& parameters, const CircleOfConfusion& coc,
                                   const FrameDescription& frame, double sharp_radius_px);

// Fills the members of the circle of confusion of a uniform block. fp32 cannot multiply by
// infinity: larger values become kMaxFactor.
template <class Block>
void set_uniforms(const CircleOfConfusion& coc, Block& uniforms) {
    constexpr double kMaxFactor = 1e30;
    uniforms.gain_px = float(coc.gain_px);
    uniforms.focus_inverse = float(std::min(coc.focus_inverse, kMaxFactor));
    uniforms.near_sharp = float(coc.near_sharp);
    uniforms.near_inverse_span = float(std::min(1 / coc.near_span, kMaxFactor));
    uniforms.far_sharp = float(coc.far_sharp);
    uniforms.far_inverse_span = float(std::min(1 / coc.far_span, kMaxFactor));
    uniforms.near_radius_px = float(coc.near_radius_px);
    uniforms.far_radius_px = float(coc.far_radius_px);
    uniforms.max_radius_px = float(coc.max_radius_px);
}

}  // namespace postchain::lens
