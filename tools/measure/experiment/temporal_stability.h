// Measures effects visible only when one still frame is filtered again: with other seeds (flicker),
// or shifted relative to the filter's tiles (grid). Formulas: docs/metrics.md, "Several frames".
//
//   frame --F, seed + 0..3--> images --> flicker: their standard deviation
//   frame --shift by (k, k)--> F --> against shift(F(frame)), k = some of 1..tile-1 --> grid
#pragma once

#include <optional>
#include <vector>

#include "chain/gl/executor.h"
#include "chain/pass/planner.h"
#include "tools/sequence/source/frame_source.h"

namespace postchain::experiment {

// Maximum number of frames of a sequence, evenly spaced: enough for an interval over frames.
inline constexpr int kStabilityFrames = 8;
inline constexpr int kFlickerSeeds = 4;
inline constexpr int kGridShifts = 4;
// Border tiles excluded from grid, because a shift moves content in and out there.
inline constexpr int kGridMarginTiles = 3;

// Size of the largest grid that a pass depends on (Guarantees::lattice_px). 1 = none. 0 = a pass
// depends on the position in the image, so a shift does not show a grid.
int grid_tile_px(const Chain& chain);
// Up to kGridShifts values spread over 1..tile_px-1, all below a quarter of the shorter side.
std::vector<int> grid_shifts(int tile_px, int width, int height);
// kGridMarginTiles tiles, at most a quarter of the shorter side.
int grid_margin_px(int tile_px, int width, int height);

struct TemporalStability {
    std::optional<double> flicker;  // none if nothing is random
    std::optional<double> grid;     // none without a grid, or if the image is too small for a shift
};
// `filtered`: the chain's result for the unchanged `frame`. Errors: planning, gl.
Result<TemporalStability> temporal_stability(const Chain& chain, const sequence::SourceFrame& frame,
                                             const ImageF& filtered, const PlanOptions& options,
                                             Executor& executor);

}  // namespace postchain::experiment
