// The relation of an image's stored values to light: a transfer curve, or a configuration of
// OpenColorIO.
#pragma once

#include <string>
#include <variant>

namespace postchain::io {

enum class Curve {
    linear,   // values are light, or stay unchanged
    srgb,     // IEC 61966-2-1
    rec709,   // the camera curve of ITU-R BT.709-6, 1.2, with exact constants
    gamma22,  // the power 2.2
    cineon,   // printing density as log, black 95, white 685 of 1023, 0.002 density each, gamma 0.6
};
const char* name_of(Curve curve);

// Stored value to light, and back. 1 is white. Stored values below 0 continue the straight part of
// the curve; gamma22 is odd. encode() of light without a stored value (cineon, below its black) is
// NaN.
double decode(Curve curve, double stored);
double encode(Curve curve, double light);

// A color space, or a role, of an OpenColorIO configuration.
struct OcioSpace {
    std::string config;  // a file
    std::string space;
    std::string working;  // the frames' color space; empty: that of the role scene_linear
    bool operator==(const OcioSpace&) const = default;
};

// A view of a display. Empty strings: the default display, its default view, and the color space of
// the role scene_linear. It cannot be inverted.
struct DisplayView {
    std::string config;  // a file
    std::string display;
    std::string view;
    std::string working;
    bool operator==(const DisplayView&) const = default;
};

using Transfer = std::variant<Curve, OcioSpace, DisplayView>;
// The file of the configuration; empty for a curve.
std::string config_of(const Transfer& transfer);
// All fields as text, for comparison: "srgb", "space lin of ...".
std::string description_of(const Transfer& transfer);

}  // namespace postchain::io
