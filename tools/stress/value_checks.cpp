#include "tools/stress/value_checks.h"

#include <algorithm>
#include <cmath>

#include "chain/base/text.h"
#include "chain/pass/planner.h"
#include "tools/stress/image_change.h"

namespace postchain::stress {

Status check_finite(Measurement& measured) {
    if (!measured.wants("finite")) return Status();
    const ImageF& out = measured.result();
    ImageF map(out.width, out.height, 1);
    size_t bad = 0, first = 0;
    for (size_t i = out.data.size(); i-- > 0;) {
        if (std::isfinite(out.data[i])) continue;
        ++bad;
        first = i;
        map.data[i / 4] = 1;
    }
    measured.add("finite", double(bad), 0, place_of(out, first / 4));
    measured.add_images(measured.color(), out, measured.color(), std::move(map), "input",
                        "1 where a value is not finite");
    return Status();
}

Status check_range(Measurement& measured) {
    if (!measured.wants("range")) return Status();
    const auto convex = measured.chain().that_guarantees(
        [](const Guarantees& one) { return one.convex.has_value(); });
    if (!convex) return Status();
    ASSIGN_OR_RETURN(auto of_convex,
                     measured.filter(*convex, measured.stored_frame(), measured.stored_planes()));
    const ImageF& in = measured.stored_planes().at(Role::color);
    ImageF map(in.width, in.height, 1);
    double worst = 0;
    size_t at = 0;
    for (size_t c = 0; c < 4; ++c) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = c; i < in.data.size(); i += 4) {
            low = std::min(low, double(in.data[i]));
            high = std::max(high, double(in.data[i]));
        }
        const double scale = std::max({std::abs(low), std::abs(high), 1e-30});
        for (size_t i = c; i < in.data.size(); i += 4) {
            const double value = of_convex.data[i];
            const double off = std::max(value - high, low - value) / scale;
            // Skips NaN, which `finite` counts.
            if (off > double(map.data[i / 4])) map.data[i / 4] = float(off);
            if (!(off > worst)) continue;
            worst = off;
            at = i / 4;
        }
    }
    measured.add("range", worst, *convex->guarantees().convex, place_of(in, at));
    measured.add_images(in, of_convex, in, std::move(map), "input",
                        "distance from the channel's input range, relative to its largest");
    return Status();
}

// The cell's depth, motion and lens with constant color: each channel's maximum.
Status check_constant(Measurement& measured) {
    if (!measured.wants("constant") || !measured.chain().guarantees().keeps_constants)
        return Status();
    FramePlanes planes = measured.stored_planes();
    ImageF& flat = planes[Role::color];
    float most[4] = {0, 0, 0, 0};
    for (size_t i = 0; i < flat.data.size(); ++i)
        if (std::abs(flat.data[i]) > std::abs(most[i % 4])) most[i % 4] = flat.data[i];
    for (size_t i = 0; i < flat.data.size(); ++i) flat.data[i] = most[i % 4];
    ASSIGN_OR_RETURN(auto out, measured.filter_anew(measured.chain(), planes));
    measured.add_equal("constant", flat, out, flat, "the constant");
    return Status();
}

Status check_elided(Measurement& measured) {
    if (!measured.wants("elided")) return Status();
    ASSIGN_OR_RETURN(auto out, measured.filter(measured.chain(), measured.cell().frame,
                                               measured.cell().planes, true));
    measured.add_equal("elided", measured.color(), out, measured.result(),
                       "result of the complete run");
    return Status();
}

Status check_repeat(Measurement& measured) {
    if (!measured.wants("repeat")) return Status();
    ASSIGN_OR_RETURN(const auto out, measured.filter_again());
    measured.add_equal("repeat", measured.color(), out, measured.result(),
                       "result of the first run");
    return Status();
}

Status check_identity(Measurement& measured) {
    if (!measured.wants("identity")) return Status();
    const RoleSet driven_by = measured.chain().guarantees().driven_by;
    if (driven_by.empty() || !measured.cell().is_quiet(driven_by)) return Status();
    measured.add_equal("identity", measured.color(), measured.result(), measured.color(), "input");
    return Status();
}

Status check_reference(Measurement& measured) {
    if (!measured.wants("reference")) return Status();
    PlanOptions options;
    options.precision = measured.precision();
    options.elide = false;
    ASSIGN_OR_RETURN(auto run, run_reference(measured.chain(), measured.stored_frame(),
                                             measured.stored_planes(), options));
    measured.add_mean("reference", measured.stored_planes().at(Role::color),
                      measured.stored_result(), image_cast<float>(run.planes.at(Role::color)),
                      "double-precision reference");
    return Status();
}

Status check_counted(Measurement& measured) {
    const MatrixCell& cell = measured.cell();
    if (cell.checks_counts && measured.wants("counted"))
        measured.add("counted",
                     std::abs(double(cell.nonfinite_placed) - double(cell.nonfinite_counted)), 0,
                     concat(cell.nonfinite_placed, " put in"));
    return Status();
}

}  // namespace postchain::stress
