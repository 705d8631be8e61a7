#include "tools/stress/check.h"

#include <algorithm>
#include <cmath>

#include "chain/frame/convert.h"
#include "shaders/shared/color_limits.h"
#include "tools/stress/continuity_check.h"
#include "tools/stress/symmetry_checks.h"
#include "tools/stress/value_checks.h"

namespace postchain::stress {
namespace {

using shared::kMaxHalf;

// The nearest half, ties to even; values beyond the largest half are unchanged.
float as_half(float value) {
    if (std::abs(value) > kMaxHalf) return value;
    int exponent = 0;
    std::frexp(value, &exponent);
    // 11 significant bits, fewer below 2^-14: the smallest step is 2^-24.
    const int step = std::max(exponent - 11, -24);
    return float(std::ldexp(std::nearbyint(std::ldexp(double(value), -step)), step));
}

// With fp16, rounds color to half as a half file would, so that results expected to be exact can
// be. Colors outside the range of half stay; they come from a float file.
Result<MatrixCell> at_precision(const MatrixCell& cell, Precision precision) {
    MatrixCell stored = cell;
    if (precision == Precision::fp32) return stored;
    for (float& value : stored.planes.at(Role::color).data) value = as_half(value);
    ConvertOptions options;  // for the bounds of these colors
    options.depth = DepthEncoding::inverse;
    RETURN_IF_ERROR(convert_frame(stored.planes, stored.frame, options).status());
    return stored;
}

}  // namespace

const char* name_of(Verdict verdict) {
    constexpr const char* kNames[] = {"ok", "limit", "FAIL"};
    return kNames[size_t(verdict)];
}

const std::vector<CheckRow>& check_rows() {
    static const std::vector<CheckRow> rows = {
        {"finite", "Output values that are NaN or infinite."},
        {"range",
         "Distance of an output from the range of its channel's input, relative to the "
         "largest value there."},
        {"constant", "Fraction of the pixels of a constant image that changed."},
        {"identity", "Fraction of the pixels that changed although the pass has nothing to do."},
        {"elided",
         "Fraction of the pixels that differ between the run with elision and "
         "the full run."},
        {"repeat", "Fraction of the pixels in which a second run differs from the first."},
        {"mirror",
         "Mean relative error between the mirrored result and the result of the "
         "mirrored frame."},
        {"flip", "As mirror, upside down."},
        {"turn", "As mirror, after a quarter turn."},
        {"shift",
         "Fraction of the pixels that differ after the image moves by whole "
         "tiles."},
        {"grid",
         "Mean change when the image moves by parts of a tile, relative to the "
         "colors."},
        {"dot", "Fraction of the light of a dot on black that is lost or gained."},
        {"reference", "Mean relative error against the double-precision reference."},
        {"color", "Mean relative change of the output per relative change of the color."},
        {"motion", "As color, per change of the motion."},
        {"depth", "As color, per change of the depth."},
        {"noise", "As color, per pixel of noise on vectors that are 0."},
        {"counted", "Non-finite input pixels that were not counted."}};
    return rows;
}

const std::vector<std::string>& check_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const auto& row : check_rows()) all.push_back(row.name);
        return all;
    }();
    return names;
}

int tile_px(const Chain& chain) {
    constexpr int kFine = 16, kUsual = 40;
    const int lattice = std::max(chain.guarantees().lattice_px, 1);
    return lattice >= kFine ? lattice : (kUsual + lattice - 1) / lattice * lattice;
}

Subject with_cells_camera(Subject subject) {
    subject.chain.camera = Camera();
    for (auto& link : subject.chain.links) {
        for (const auto& row : link.type->parameters->rows()) {
            const bool of_camera =
                camera_parameters().find(row.key) ||
                (!row.excludes.empty() && camera_parameters().find(row.excludes));
            if (row.optional && of_camera)
                row.set(link.pass->parameters(), ParameterValue(std::monostate()));
        }
    }
    return subject;
}

Result<CellMeasures> measure(Executor& executor, const Subject& subject, const MatrixCell& cell,
                             Precision precision, std::vector<CheckImages>* images,
                             const std::set<std::string>& only) {
    ASSIGN_OR_RETURN(const auto stored, at_precision(cell, precision));
    Measurement measured(executor, subject, stored, precision, images, only);
    RETURN_IF_ERROR(measured.start());
    for (const auto check :
         {check_finite, check_range, check_constant, check_elided, check_repeat, check_turns,
          check_shift, check_dot, check_reference, check_continuity, check_identity, check_counted})
        RETURN_IF_ERROR(check(measured));
    return measured.take();
}

}  // namespace postchain::stress
