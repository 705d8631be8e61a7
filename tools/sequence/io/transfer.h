// Transfer curves: what the stored values of a picture mean as light.
#pragma once

#include <optional>
#include <string>

namespace postchain::io {

enum class Transfer {
    linear,   // values are light, or are to stay as they are
    srgb,     // IEC 61966-2-1
    rec709,   // the camera curve of ITU-R BT.709-6, 1.2
    gamma22,  // the power 2.2
    cineon,   // printing density as log, black 95, white 685 of 1023, 0.002 density each, gamma 0.6
};
const char* name_of(Transfer transfer);

// Stored value to light, and back. 1 is white; stored values below 0 go on along the straight part
// of the curve, those of gamma22 as the negative of their opposite. encode() of light for which
// there is no stored value (cineon, below its black) is NaN.
double decode(Transfer transfer, double stored);
double encode(Transfer transfer, double light);

}  // namespace postchain::io
