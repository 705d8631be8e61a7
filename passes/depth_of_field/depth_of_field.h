// Depth of field: parameters and pass type.
//
// Described in docs/depth_of_field.md. The method `gilham` is the documented core of D. Gilham,
// Real-Time Depth-of-Field Implemented with a Post-Processing only Technique, ShaderX5, 2006:
// signed circle of confusion, downsampled image, separable Gaussian, interpolation with the sharp
// image. Its kernel, tap counts and leak test are not public; ours are in gilham.cpp and
// docs/depth_of_field.md.
#pragma once

#include <optional>

#include "chain/pass.h"

namespace postchain::depth_of_field {

enum class Method { gilham };
enum class CocSource { lens, planes, range };  // circle_of_confusion.h
enum class Leak { none, depth, coc };          // which neighbors the Gaussian may mix in

inline constexpr double kDefaultMaxRadiusFraction = 0.03;  // of the display width

struct Parameters {
    Method method = Method::gilham;
    CocSource coc = CocSource::lens;

    // coc: lens. Unset = the camera's.
    std::optional<double> focal_length_mm;
    std::optional<double> f_stop;
    std::optional<double> focus_distance;  // scene units
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

    std::optional<double> max_radius_px;  // unset = 3 % of the display width
    int downsample = 4;
    std::optional<double> blur_sigma_px;  // unset = from the lens, gilham.cpp
    Leak leak = Leak::coc;
    bool hdr_weight = false;
};

// Its own rule of leaving out, of blocks that the device finds.
inline constexpr const char* kRuleFocusTiles = "focus_tiles";

const PassType& pass_type();

}  // namespace postchain::depth_of_field
