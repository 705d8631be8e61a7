// What shows only when one still frame is filtered again: with other seeds (flicker), and at
// another place under the filter's tiles (grid). Formulas: docs/metrics.md, "Several frames".
//
//   frame --F, seed + 0..3--> pictures --> flicker: their scatter
//   frame --shift by (k, k)--> F --> against shift(F(frame)), k = some of 1..tile-1 --> grid
#pragma once

#include <optional>
#include <vector>

#include "chain/gl/executor.h"
#include "tools/sequence/run/frame_source.h"

namespace postchain::experiment {

// Of a sequence at most this many frames, evenly spread: as many as an interval over frames needs.
inline constexpr int kStabilityFrames = 8;
inline constexpr int kFlickerSeeds = 4;
inline constexpr int kGridShifts = 4;
// Along the edges of the picture this many tiles are left out of grid: what a shift brings in or
// pushes out there changes the result rightly.
inline constexpr int kGridMarginTiles = 3;

// Edge of the largest grid that a pass of the chain is tied to (Promises::lattice_px). 1: none. 0:
// a pass is tied to the place in the picture, and a move of the picture tells nothing of a grid.
int grid_tile_px(const Chain& chain);
// Up to kGridShifts values spread over 1..tile_px-1, all below a quarter of the shorter side.
std::vector<int> grid_shifts(int tile_px, int width, int height);
// kGridMarginTiles tiles, but at most a quarter of the shorter side.
int grid_margin_px(int tile_px, int width, int height);

struct TemporalStability {
    std::optional<double> flicker;  // none without random numbers
    std::optional<double> grid;     // none without a grid, or in a picture too small for a shift
};
// `filtered`: what the chain makes of `frame` as it is. Errors: planning, gl.
Result<TemporalStability> temporal_stability(const Chain& chain, const sequence::SourceFrame& frame,
                                             const ImageF& filtered, const PlanOptions& options,
                                             Executor& executor);

}  // namespace postchain::experiment
