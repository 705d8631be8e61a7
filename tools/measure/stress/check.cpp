#include "tools/measure/stress/check.h"

#include <algorithm>
#include <cmath>

#include "chain/convert.h"
#include "tools/measure/stress/equivariance.h"

namespace postchain::stress {
namespace {

// The nearest half, ties to even; beyond the largest half the value stays as it is.
float as_half(float value) {
    if (std::abs(value) > kMaxHalf) return value;
    int exponent = 0;
    std::frexp(value, &exponent);
    // 11 significant bits, fewer below 2^-14: the smallest step is 2^-24.
    const int step = std::max(exponent - 11, -24);
    return float(std::ldexp(std::nearbyint(std::ldexp(double(value), -step)), step));
}

// With fp16 the color comes as a half file brings it, so that what is exact has to be exact there
// too. Colors that no half holds stay: they come from a float file.
Result<Cell> at_precision(const Cell& cell, Precision precision) {
    Cell stored = cell;
    if (precision == Precision::fp32) return stored;
    for (float& value : stored.planes.at(Role::color).data) value = as_half(value);
    ConvertOptions options;  // for the bounds of these colors
    options.depth = DepthEncoding::inverse;
    if (auto found = convert_frame(stored.planes, stored.frame, options); !found.ok())
        return found.status();
    return stored;
}

}  // namespace

const char* name_of(Verdict verdict) {
    switch (verdict) {
        case Verdict::ok:
            return "ok";
        case Verdict::limit:
            return "limit";
        case Verdict::failed:
            return "FAIL";
    }
    return "";
}

const std::vector<CheckRow>& check_rows() {
    static const std::vector<CheckRow> rows = {
        {"finite", "Output values that are NaN or infinite."},
        {"range",
         "How far an output leaves the range of its channel's input, relative to the "
         "largest value there."},
        {"constant", "Part of the pixels of a constant picture that changed a bit."},
        {"identity", "Part of the pixels that changed a bit where nothing should happen."},
        {"elided",
         "Part of the pixels in which the run that leaves out what is not needed differs "
         "from the full one by a bit."},
        {"repeat", "Part of the pixels in which a second run differs from the first by a bit."},
        {"mirror",
         "Mean relative error between the mirrored result and the result of the "
         "mirrored frame."},
        {"flip", "The same, upside down."},
        {"turn", "The same, after a quarter turn."},
        {"shift",
         "Part of the pixels that differ by a bit when the picture moves by whole "
         "tiles."},
        {"grid",
         "Mean change when the picture moves by parts of a tile, relative to the "
         "colors."},
        {"dot", "Part of the light of a dot in black that is lost or won."},
        {"reference", "Mean relative error against the double-precision reference."},
        {"color", "Relative change of the output per relative change of the color, in the mean."},
        {"motion", "The same, per change of the motion."},
        {"depth", "The same, per change of the depth."},
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
    const int lattice = std::max(chain.promises().lattice_px, 1);
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

Result<CellMeasures> measure(Executor& executor, const Subject& subject, const Cell& cell,
                             Precision precision, std::vector<Exhibit>* exhibits) {
    const auto stored = at_precision(cell, precision);
    if (!stored.ok()) return stored.status();
    return CellMeasurement(executor, subject, *stored, precision, exhibits).all();
}

}  // namespace postchain::stress
