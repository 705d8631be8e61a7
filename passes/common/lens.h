// The lens parameters of a pass, from which the circle of confusion follows
// (circle_of_confusion.h).
#pragma once

#include <optional>

#include "chain/base/parameter.h"
#include "chain/frame/frame.h"

namespace postchain::lens {

enum class CocSource { lens, planes, range };

// max_radius_px if it is unset, in display widths. It is smaller if the width of the blur
// follows from it (coc: range, method: gilham).
inline constexpr double kMaxRadiusFraction = 1.0 / 8, kSmallMaxRadiusFraction = 0.03;
inline constexpr double kMaxRadiusPx = 512;  // of kMaxRadiusFraction

inline constexpr double kMaxDistance = 1e30;  // scene units; fp32 holds it and its inverse

struct Parameters {
    CocSource coc = CocSource::lens;

    // coc: lens. Unset = the camera's.
    std::optional<double> focal_length_mm;
    std::optional<double> f_stop;
    std::optional<double> focus_distance;  // scene units
    std::optional<Place> focus_at;         // instead: a place in the frame that is in focus
    std::optional<double> sensor_width_mm;
    bool breathing = false;  // refocus like a thin lens: radius times s/(s - f)

    // coc: planes. Distances in scene units, radii as fractions of the display width.
    double near_blurry = 0.25;
    double near_sharp = 1;
    double far_sharp = 40;
    double far_blurry = 100;
    double max_near_fraction = 0.015;
    double max_far_fraction = 0.005;

    // coc: range. Scene units.
    std::optional<double> focus;  // unset = focus_distance, the pass's or the camera's
    double range = 1;

    std::optional<double> max_radius_px;        // unset: a part of the display width
    std::optional<double> max_radius_fraction;  // instead, display heights
};

// Rows for the table of a pass that has a lens.
const ParameterTable& parameter_table();

}  // namespace postchain::lens
