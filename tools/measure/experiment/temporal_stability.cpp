#include "tools/measure/experiment/temporal_stability.h"

#include <algorithm>

#include "tools/measure/experiment/converge.h"
#include "tools/measure/metrics/temporal.h"

namespace postchain::experiment {
namespace {

Result<metrics::RgbImage> filtered_with(const Plan& plan, PlaneView planes, Executor& executor) {
    auto result = executor.filter(plan, planes);
    if (!result.ok()) return result.status();
    return metrics::rgb_image_of(result->at(Role::color));
}

}  // namespace

int grid_tile_px(const Chain& chain) {
    int tile = 1;
    for (const auto& link : chain.links) {
        const int lattice = link.pass->guarantees().lattice_px;
        if (lattice == 0) return 0;
        tile = std::max(tile, lattice);
    }
    return tile;
}

std::vector<int> grid_shifts(int tile_px, int width, int height) {
    const int largest = std::min(tile_px - 1, std::min(width, height) / 4);
    std::vector<int> shifts;
    // The centers of kGridShifts equal parts of 1..largest.
    for (int i = 0; i < kGridShifts && largest > 0; ++i) {
        const int shift = 1 + (2 * i + 1) * largest / (2 * kGridShifts);
        if (shifts.empty() || shift != shifts.back()) shifts.push_back(shift);
    }
    return shifts;
}

int grid_margin_px(int tile_px, int width, int height) {
    return std::min(kGridMarginTiles * tile_px, std::min(width, height) / 4);
}

Result<TemporalStability> temporal_stability(const Chain& chain, const sequence::SourceFrame& frame,
                                             const ImageF& filtered, const PlanOptions& options,
                                             Executor& executor) {
    TemporalStability result;
    auto image = metrics::rgb_image_of(filtered);
    if (!image.ok()) return image.status();
    if (has_seeds(chain)) {
        metrics::Flicker flicker;
        if (Status status = flicker.add(*image); !status.ok()) return status;
        for (int i = 1; i < kFlickerSeeds; ++i) {
            auto plan = sequence::plan_source_frame(with_seed_offset(chain, i), frame, options);
            if (!plan.ok()) return plan.status();
            auto other = filtered_with(*plan, frame.planes, executor);
            if (!other.ok()) return other.status();
            if (Status status = flicker.add(*other); !status.ok()) return status;
        }
        result.flicker = flicker.mean();
    }
    const int tile = grid_tile_px(chain);
    const auto shifts = grid_shifts(tile, filtered.width, filtered.height);
    if (shifts.empty()) return result;
    // The plan's facts are bounds over the frame, so they hold for shifted pixels.
    auto plan = sequence::plan_source_frame(chain, frame, options);
    if (!plan.ok()) return plan.status();
    metrics::GridError grid(grid_margin_px(tile, filtered.width, filtered.height));
    for (const int shift : shifts) {
        FramePlanes moved;
        for (const auto& [role, plane] : frame.planes)
            moved[role] = metrics::shifted(*plane, shift, shift);
        auto there = filtered_with(*plan, moved, executor);
        if (!there.ok()) return there.status();
        if (Status status = grid.add(*there, *image, shift, shift); !status.ok()) return status;
    }
    result.grid = grid.mean();
    return result;
}

}  // namespace postchain::experiment
