#include "tools/sequence/io/transfer.h"

#include <cmath>

namespace postchain::io {
namespace {

// Kodak, "Conversion of 10-bit log film data to 8-bit linear or video data for the Cineon digital
// film system", 1995: log exposure of a code of 10 bits, with white at 1 and black taken off.
constexpr double kCineonStep = 0.002 / 0.6;
double cineon_exposure(double stored) {
    return std::pow(10, (1023 * stored - 685) * kCineonStep);
}
const double kCineonBlack = cineon_exposure(95 / 1023.0);

}  // namespace

const char* name_of(Transfer transfer) {
    switch (transfer) {
        case Transfer::linear:
            return "linear";
        case Transfer::srgb:
            return "srgb";
        case Transfer::rec709:
            return "rec709";
        case Transfer::gamma22:
            return "gamma22";
        case Transfer::cineon:
            return "cineon";
    }
    return "";
}

double decode(Transfer transfer, double v) {
    switch (transfer) {
        case Transfer::linear:
            return v;
        case Transfer::srgb:
            return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        case Transfer::rec709:
            return v < 0.081 ? v / 4.5 : std::pow((v + 0.099) / 1.099, 1 / 0.45);
        case Transfer::gamma22:
            return std::copysign(std::pow(std::abs(v), 2.2), v);
        case Transfer::cineon:
            return (cineon_exposure(v) - kCineonBlack) / (1 - kCineonBlack);
    }
    return v;
}

double encode(Transfer transfer, double v) {
    switch (transfer) {
        case Transfer::linear:
            return v;
        case Transfer::srgb:
            return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
        case Transfer::rec709:
            return v < 0.018 ? v * 4.5 : 1.099 * std::pow(v, 0.45) - 0.099;
        case Transfer::gamma22:
            return std::copysign(std::pow(std::abs(v), 1 / 2.2), v);
        case Transfer::cineon: {
            const double exposure = v * (1 - kCineonBlack) + kCineonBlack;
            return (std::log10(exposure) / kCineonStep + 685) / 1023;
        }
    }
    return v;
}

}  // namespace postchain::io
