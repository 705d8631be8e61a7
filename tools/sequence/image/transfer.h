// What the stored values of a picture mean as light: a transfer curve, or what a configuration of
// OpenColorIO says.
#pragma once

#include <string>
#include <variant>

namespace postchain::io {

enum class Curve {
    linear,   // values are light, or are to stay as they are
    srgb,     // IEC 61966-2-1
    rec709,   // the camera curve of ITU-R BT.709-6, 1.2, its constants not rounded
    gamma22,  // the power 2.2
    cineon,   // printing density as log, black 95, white 685 of 1023, 0.002 density each, gamma 0.6
};
const char* name_of(Curve curve);

// Stored value to light, and back. 1 is white; stored values below 0 go on along the straight part
// of the curve, those of gamma22 as the negative of their opposite. encode() of light for which
// there is no stored value (cineon, below its black) is NaN.
double decode(Curve curve, double stored);
double encode(Curve curve, double light);

// Values of a color space, or of a role, of an OpenColorIO configuration.
struct OcioSpace {
    std::string config;  // a file
    std::string space;
    std::string working;  // that of the frames; empty: that of the role scene_linear
    bool operator==(const OcioSpace&) const = default;
};

// Values as a view shows the frames. Empty texts: the default display and its default view, and
// the space of the role scene_linear. There is no way back.
struct DisplayView {
    std::string config;  // a file
    std::string display;
    std::string view;
    std::string working;
    bool operator==(const DisplayView&) const = default;
};

using Transfer = std::variant<Curve, OcioSpace, DisplayView>;
// The file of the configuration; empty: a curve.
std::string config_of(const Transfer& transfer);
// All that it says, for identity: "srgb", "space lin of ...".
std::string description_of(const Transfer& transfer);

}  // namespace postchain::io
