// The aperture: the shape of the lens, and so of out-of-focus highlights.
//
// Its points are in radii of the circle of confusion, x to the right and y down, as seen in a
// highlight behind the focus; a highlight before the focus shows them turned by half a turn. The
// corners of the blades are on the unit circle, as in Cycles. Described in docs/depth_of_field.md,
// "Aperture".
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/frame/frame.h"
#include "chain/frame/origin.h"

namespace postchain::lens {

// The aperture's parameters of a pass. Unset = the camera's.
struct ApertureParameters {
    std::optional<int> aperture_blades;
    std::optional<double> aperture_rotation_deg;
    std::optional<double> aperture_curvature;
    std::optional<double> aperture_ratio;
    std::optional<double> cats_eye;
};

// Rows for the table of a pass whose filter has the shape of the lens.
const ParameterTable& aperture_parameter_table();

// Errors (chain): the camera has an image of its aperture, and camera or pass also have blades or
// their curvature; the image has not been read.
Status check_aperture(const ApertureParameters& parameters, const Camera& camera);

struct Aperture {
    int blades = 0;           // below 3: a disc
    BokehKernel image = {};   // replaces blades and curvature
    double rotation_deg = 0;  // counterclockwise
    double curvature = 0;     // curvature of the blades: 0 straight .. 1 a disc
    double ratio = 1;         // height over width; the longer of them has the whole radius
    double cats_eye = 0;      // shift of the barrel's circle in the corners, radii
    std::array<double, 2> axes = {1, 1};  // CircleOfConfusion::axes

    // Half-width and half-height of the ellipse around it in pixels, for a radius of 1.
    std::array<double, 2> half_size() const;
};

// Hash of all values: equal hashes mean the same lens samples.
uint64_t hash_of(const Aperture& aperture);

Aperture aperture_of(const ApertureParameters& parameters, const Camera& camera,
                     std::array<double, 2> axes = {1, 1});

// Its resolved shape; a disc is blades 0. With an image only the image.
std::vector<UsedValue> used_values(const ApertureParameters& parameters, const Camera& camera);

// The barrel's front, a unit circle, is shifted by this times a ray's place in the frame, radii per
// shorter side of a pixel from the center. A ray's place follows from its direction: through the
// lens sample l, pixel p sees at infinity the point p - R l, R the radius there.
double barrel_per_px(const Aperture& aperture, const FrameDescription& frame);

// The radius of the disc with the same variance, for a circle of 1, if the aperture is nearly such
// a disc everywhere in the frame: on square pixels a disc, or six blades and more.
std::optional<double> disc_radius(const Aperture& aperture);

// The boundary of an aperture, for points spread evenly over its area.
class Outline {
  public:
    explicit Outline(const Aperture& aperture);

    // After `turn` of a whole turn by area: equal steps sweep equal areas.
    std::array<double, 2> at(double turn) const;

  private:
    Aperture aperture_;
    std::vector<double> swept_;  // share of half a blade's area up to equal steps of the angle
};

// Distance of a blade's edge from the center, at `angle` from the center of the blade, radians
// within pi/blades. An arc of the given curvature through the two corners.
double blade_radius(int blades, double curvature, double angle);

}  // namespace postchain::lens
