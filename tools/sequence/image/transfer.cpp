#include "tools/sequence/image/transfer.h"

#include <cmath>

#include "chain/base/status.h"
#include "chain/base/text.h"

namespace postchain::io {
namespace {

// Kodak, "Conversion of 10-bit log film data to 8-bit linear or video data for the Cineon digital
// film system", 1995: log exposure of a code of 10 bits, with white at 1 and black taken off.
constexpr double kCineonStep = 0.002 / 0.6;
double cineon_exposure(double stored) {
    return std::pow(10, (1023 * stored - 685) * kCineonStep);
}
const double kCineonBlack = cineon_exposure(95 / 1023.0);

// BT.709 rounds them to 1.099 and 0.018, which leaves a gap between the curve's parts: these are
// where they meet with one slope (ITU-R BT.2020-2, table 4, note).
constexpr double kAlpha = 1.09929682680944;
constexpr double kBeta = 0.018053968510807;

}  // namespace

const char* name_of(Curve curve) {
    switch (curve) {
        case Curve::linear:
            return "linear";
        case Curve::srgb:
            return "srgb";
        case Curve::rec709:
            return "rec709";
        case Curve::gamma22:
            return "gamma22";
        case Curve::cineon:
            return "cineon";
    }
    return "";
}

double decode(Curve curve, double v) {
    switch (curve) {
        case Curve::linear:
            return v;
        case Curve::srgb:
            return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        case Curve::rec709:
            return v < 4.5 * kBeta ? v / 4.5 : std::pow((v + kAlpha - 1) / kAlpha, 1 / 0.45);
        case Curve::gamma22:
            return std::copysign(std::pow(std::abs(v), 2.2), v);
        case Curve::cineon:
            return (cineon_exposure(v) - kCineonBlack) / (1 - kCineonBlack);
    }
    return v;
}

double encode(Curve curve, double v) {
    switch (curve) {
        case Curve::linear:
            return v;
        case Curve::srgb:
            return v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
        case Curve::rec709:
            return v < kBeta ? v * 4.5 : kAlpha * std::pow(v, 0.45) - (kAlpha - 1);
        case Curve::gamma22:
            return std::copysign(std::pow(std::abs(v), 1 / 2.2), v);
        case Curve::cineon: {
            const double exposure = v * (1 - kCineonBlack) + kCineonBlack;
            return (std::log10(exposure) / kCineonStep + 685) / 1023;
        }
    }
    return v;
}

std::string config_of(const Transfer& transfer) {
    if (const auto* space = std::get_if<OcioSpace>(&transfer)) return space->config;
    if (const auto* view = std::get_if<DisplayView>(&transfer)) return view->config;
    return "";
}

std::string description_of(const Transfer& transfer) {
    if (const auto* curve = std::get_if<Curve>(&transfer)) return name_of(*curve);
    if (const auto* space = std::get_if<OcioSpace>(&transfer))
        return concat("space ", quoted(space->space), " from ", quoted(space->working), " of ",
                      quoted(space->config));
    const auto& view = std::get<DisplayView>(transfer);
    return concat("view ", quoted(view.view), " of ", quoted(view.display), " from ",
                  quoted(view.working), " of ", quoted(view.config));
}

}  // namespace postchain::io
