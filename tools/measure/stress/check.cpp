#include "tools/measure/stress/check.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "chain/convert.h"
#include "tools/measure/stress/measurement.h"

namespace postchain::stress {
namespace {

// The largest value that a row of this key and type has in any pass; 0 when none has it.
int64_t largest_integer(const Chain& chain, const char* key) {
    int64_t value = 0;
    for (const auto& link : chain.links)
        if (const Parameter* row = link.type->parameters->find(key))
            if (row->type == ParameterType::integer)
                value = std::max(value, std::get<int64_t>(row->get(link.pass->parameters())));
    return value;
}

std::optional<double> number_of(const ChainLink& link, const char* key) {
    const Parameter* row = link.type->parameters->find(key);
    if (!row) return {};
    const ParameterValue value = row->get(link.pass->parameters());
    if (const auto* whole = std::get_if<int64_t>(&value)) return double(*whole);
    if (const auto* real = std::get_if<double>(&value)) return *real;
    return {};
}

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
    ConvertOptions options;  // for the facts of these colors
    options.depth = DepthEncoding::inverse;
    if (Status status = convert_frame(stored.planes, stored.frame, options); !status.ok())
        return status;
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
        {"lean",
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
    const int64_t tile = largest_integer(chain, "max_blur_px");
    return tile > 0 ? int(tile) : 40;
}

int lattice_px(const Chain& chain) {
    return std::lcm(tile_px(chain),
                    int(std::max<int64_t>(largest_integer(chain, "downsample"), 1)));
}

Reach reach_of(const Chain& chain, int display_width) {
    double depends = 0, light = 0, largest = 0;
    for (const auto& link : chain.links) {
        // FXAA decides over 30.5 px at most, and blends with a neighbor.
        double own_depends = 34, own_light = 1;
        // A streak; and the tiles around its own know what lies a tile further.
        if (const auto tile = number_of(link, "max_blur_px")) {
            own_depends = 2 * *tile;
            own_light = *tile;
        }
        // A Gaussian, cut at 3 sigma, of half the largest radius at most unless it is given, and
        // the boxes of its copy.
        if (link.type->parameters->find("blur_sigma_px")) {
            const double radius = number_of(link, "max_radius_px").value_or(0.03 * display_width);
            const double sigma = number_of(link, "blur_sigma_px").value_or(radius / 2);
            own_light = 3 * sigma + 3 * number_of(link, "downsample").value_or(1);
            own_depends = std::max(own_depends, own_light);
        }
        depends += own_depends;
        light += own_light;
        largest = std::max(largest, own_light);
    }
    return {int(std::ceil(depends)), int(std::ceil(light + largest))};
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

Bounds bounds_of(Precision precision, int tile) {
    const bool half = precision == Precision::fp16;
    Bounds bounds;
    bounds.tolerance = half ? 2e-2 : 1e-3;
    bounds.mean = half ? 5e-3 : 1e-4;
    bounds.dot = half ? 5e-3 : 1e-4;
    bounds.eps = half ? 1e-2 : 1e-4;
    bounds.motion = 0.25 * tile;
    return bounds;
}

Result<CellMeasures> measure(Executor& executor, const Subject& subject, const Cell& cell,
                             Precision precision, std::vector<Exhibit>* exhibits) {
    const auto stored = at_precision(cell, precision);
    if (!stored.ok()) return stored.status();
    return Measurement(executor, subject, *stored, precision, exhibits).all();
}

}  // namespace postchain::stress
