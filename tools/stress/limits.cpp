// Checks that are known to miss their bound, each with the bound it keeps instead and why.
// docs/stability.md says more of each.
#include "tools/stress/matrix.h"

namespace postchain::stress {

const std::vector<KnownLimit>& known_limits() {
    static const std::vector<KnownLimit> limits = {
        {"mirror", "/speed/* 1 px", 1,
         "the direction across the streak has no side when a slow pixel moves exactly along the "
         "fastest of its tiles; rounding picks one"},
        {"motion", "*/speed/*0.5 px", 600,
         "the blur, and with it FXAA's hint, begins at half-velocities above 0.5 px"},
        {"range", "/radiance/65504/", 0.03,
         "FXAA's blend of tone-mapped texels darkens where the largest channels of two bright "
         "texels differ"},
        {"range", "/radiance/1e10/fp32", 0.03,
         "FXAA's blend of tone-mapped texels darkens where the largest channels of two bright "
         "texels differ"},
        {"color", "/radiance/both signs, 1e10/", 10,
         "FXAA's luma is saturated: decisions hang on the last bits"},
        {"reference", "/radiance/both signs, 1e10/fp32", 0.03,
         "FXAA's luma is saturated: decisions hang on the last bits"},
        {"reference", "/radiance/65504/fp16", 0.03,
         "FXAA's luma is saturated: decisions hang on the last bits"},
        {"range", "/radiance/*1e10*/fp16", 1, "fp16 holds 65504 at most"},
        {"constant", "/radiance/*1e10*/fp16", 1, "fp16 holds 65504 at most"},
        {"reference", "/radiance/*1e10*/fp16", 1, "fp16 holds 65504 at most"},
    };
    return limits;
}

void apply_known_limits(CellResult& cell) {
    const std::string name = cell.name();
    for (auto& one : cell.measured) {
        if (one.verdict != Verdict::failed) continue;
        for (const auto& limit : known_limits()) {
            if (limit.check != one.check || !matches(limit.cells, name)) continue;
            one.note += concat("; known: ", limit.reason, " (bound ", limit.bound, ")");
            if (one.value <= limit.bound) one.verdict = Verdict::limit;
            break;
        }
    }
}

}  // namespace postchain::stress
