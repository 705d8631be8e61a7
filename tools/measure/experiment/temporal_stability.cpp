#include "tools/measure/experiment/temporal_stability.h"

#include <algorithm>

#include "tools/measure/experiment/converge.h"
#include "tools/metrics/temporal.h"
#include "tools/sequence/source/frame_plan.h"

namespace postchain::experiment {
namespace {

Result<metrics::RgbImage> filtered_with(const Plan& plan, PlaneView planes, Executor& executor) {
    ASSIGN_OR_RETURN(auto result, executor.filter(plan, planes));
    return metrics::rgb_image_of(result.at(Role::color));
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
    ASSIGN_OR_RETURN(auto image, metrics::rgb_image_of(filtered));
    if (has_seeds(chain)) {
        metrics::Flicker flicker;
        RETURN_IF_ERROR(flicker.add(image));
        for (int i = 1; i < kFlickerSeeds; ++i) {
            ASSIGN_OR_RETURN(
                auto plan, sequence::plan_source_frame(with_seed_offset(chain, i), frame, options));
            ASSIGN_OR_RETURN(auto other, filtered_with(plan, frame.planes, executor));
            RETURN_IF_ERROR(flicker.add(other));
        }
        result.flicker = flicker.mean();
    }
    const int tile = grid_tile_px(chain);
    const auto shifts = grid_shifts(tile, filtered.width, filtered.height);
    if (shifts.empty()) return result;
    // The plan's facts are bounds over the frame, so they hold for shifted pixels.
    ASSIGN_OR_RETURN(auto plan, sequence::plan_source_frame(chain, frame, options));
    metrics::GridError grid(grid_margin_px(tile, filtered.width, filtered.height));
    for (const int shift : shifts) {
        FramePlanes moved;
        for (const auto& [role, plane] : frame.planes)
            moved[role] = metrics::shifted(*plane, shift, shift);
        ASSIGN_OR_RETURN(auto there, filtered_with(plan, moved, executor));
        RETURN_IF_ERROR(grid.add(there, image, shift, shift));
    }
    result.grid = grid.mean();
    return result;
}

}  // namespace postchain::experiment
