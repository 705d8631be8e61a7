// Checks that are known to miss their bound, each with the bound it keeps instead and why.
// docs/stability.md says more of each.
#include "tools/measure/stress/matrix.h"

namespace postchain::stress {

const std::vector<KnownLimit>& known_limits() {
    const char* const no_side =
        "the direction across the streak has no side when a slow pixel moves exactly along the "
        "fastest of its tiles; rounding picks one, and a mirror the other";
    const char* const onset =
        "the blur, and with it FXAA's hint, begins at half-velocities above 0.5 px";
    const char* const darkening =
        "FXAA's blend of tone-mapped texels darkens where the largest channels of two bright "
        "texels differ";
    const char* const ties =
        "FXAA's luma is saturated: edges of rows and of columns tie, or differ by the last bits";
    const char* const order =
        "depth of field blurs along rows, then along columns, and with a leak test that order "
        "shows";
    const char* const boxes = "depth of field's small copy moves in steps of its boxes";
    const char* const few =
        "a single pixel's streak is no more than the taps that meet it: of a change of 1 %, some "
        "round the other way";
    const char* const steep =
        "at f/0.1, focused at the near plane, 1 % of depth is 22 px of radius";
    // The first that names check, chain and cell counts: the special ones stand first.
    static const std::vector<KnownLimit> limits = {
        {"mirror", "motion_blur: ", "/speed/*1 px", 0.047, no_side},
        {"flip", "motion_blur: ", "/speed/*1 px", 0.049, no_side},
        {"flip", "fxaa: ", "/radiance/both signs, 1e10/", 0.004, ties},
        {"flip", "fxaa: ", "/crossed/*both signs, 65504", 0.012, ties},
        {"turn", "fxaa: ", "/radiance/both signs", 0.032, ties},
        {"turn", "leak=coc", "/crossed/", 0.03, order},
        {"turn", "leak=coc", "", 0.0024, order},
        {"turn", "fxaa: ", "/crossed/", 0.0062, ties},
        {"grid", "depth_of_field: ", "/radiance/firefly", 0.76, boxes},
        {"grid", "depth_of_field: ", "/nonfinite/inf in color, clamped/", 0.058, boxes},
        {"grid", "depth_of_field: ", "/crossed/", 0.53, boxes},
        {"range", "fxaa: ", "/radiance/65504/", 0.027, darkening},
        {"range", "fxaa: ", "/radiance/1e10/fp32", 0.027, darkening},
        {"reference", "fxaa: ", "/radiance/both signs, 1e10/", 0.015, ties},
        {"color", "fxaa: ", "/crossed/*1e-8 beside 1e10*39x41/fp32", 8, ties},
        {"motion", "hint=checkerboard", "/speed/*0.5 px", 560, onset},
        {"motion", "motion_blur: ", "/radiance/firefly*fp16", 26, few},
        {"depth", "depth_of_field: ", "/crossed/*f/0.1", 76, steep},
    };
    return limits;
}

void apply_known_limits(CellResult& cell) {
    const std::string name = cell.name();
    for (auto& one : cell.measured) {
        if (one.verdict != Verdict::failed) continue;
        for (const auto& limit : known_limits()) {
            if (limit.check != one.check || !matches(limit.chains, cell.chain) ||
                !matches(limit.cells, name))
                continue;
            if (one.value <= limit.bound) {
                one.verdict = Verdict::limit;
                one.limit = &limit;
            } else {
                one.note += concat("; beyond the known limit ", limit.bound, ": ", limit.reason);
            }
            break;
        }
    }
}

}  // namespace postchain::stress
