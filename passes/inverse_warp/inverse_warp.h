// Inverse warp, shared by the passes that blur with it. For each shutter time and lens sample it
// finds the surface seen at the pixel. Method, measurements: docs/inverse_warp.md.
//
//   inverse_depth [, motion [, motion_back]] --surfaces-> surfaces, marks
//   color, surfaces, marks --bright_edges-> shown
//   inverse_depth [, motion [, motion_back]], shown --shown_surfaces-> some of surfaces
//       likewise of the frames before and after
//   surfaces [of the frame and the layer behind] --block_surfaces-> block_surfaces
//   surfaces and marks of a neighbor --hidden_surfaces-> some of block_surfaces
//   block_surfaces --row_starts-> row_starts
//   row_starts --starts--> starts; work lists: moving_blocks, still_blocks
//   color, surfaces --background--> background_color, background_depth
//   background_depth, background_color --continuation-> background
//   behind --second_surfaces-> some of surfaces, below the frame's
//   layers of this frame and its neighbors --occupied-> occupied
//   color, surfaces, starts, background_color, background [, noise] [, lens_samples]
//                                                     --gather-> color [, hint]     moving_blocks
//   color [, hint]                                    --keep---> color [, hint]     still_blocks
//   colors and surfaces of the frames before and after, behind --gather-> surfaces occluded here
//
// With denoising, gather also writes `soft` and `spread`, and denoise changes color by them.
//
// Sources: Yang et al., Image-Based Bidirectional Scene Reprojection, 2011; Bowles et al.,
// Iterative Image Warping, 2012.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "chain/pass/pass.h"
#include "passes/common/aperture.h"
#include "passes/common/circle_of_confusion.h"
#include "passes/common/noise.h"
#include "passes/common/shutter.h"
#include "shaders/shared/sharp_radius.h"

namespace postchain::inverse_warp {

inline constexpr int kMaxStarts = 8;

// Frames that are searched for surfaces occluded in this one.
enum class Neighbors { none, before, both };

// Shutter::max_path_px if the user sets no limit.
inline constexpr const char* kDefaultMaxPathText =
    "an eighth of the display width, at least 40 and at most 512";

struct SearchParameters {
    int starts = 4;  // start surfaces of a block, beside the pixel's own; 1..kMaxStarts
    Neighbors neighbors = Neighbors::both;
};
// Rows for the table of a pass.
const ParameterTable& search_table();

// Base of the parameters of a pass, whose table has the rows that its user may set.
struct Parameters {
    int samples = 25;  // per pixel, 1..lens::kMaxLensSamples; without a lens an upper limit
    SearchParameters search;
    bool denoise = true;      // remove the noise of the samples where they are blurred
    noise::Parameters noise;  // shifts the times of a pixel, turns its lens samples

    shutter::Parameters shutter;
    std::optional<int> max_blur_px;  // longest path on one side of the frame
    double path_px_per_time = 2;     // without a lens: pixels of a block's path per time sample
    double time_jitter = 0.25;       // without a lens: largest shift of its times, in spacings

    lens::Parameters lens;
    lens::ApertureParameters aperture;
};

// On one frame.
struct Shutter {
    // Frames; 0: closed. Half the open time, if that is centered on the frame; otherwise all of it:
    // times are then those of half of a shutter that is open for twice as long.
    double half_open = 0.25;
    double max_path_px = 40;  // longest path on one side of the frame
    // Times, in [-1, 1] over -half_open .. half_open, are shift + scale u of those of a centered
    // shutter.
    double time_scale = 1, time_shift = 0;
};
Shutter shutter_on(const FrameDescription& frame, const Parameters& parameters);
struct Lens {
    lens::CircleOfConfusion coc;
    lens::Aperture aperture;
};
Lens lens_on(const FrameDescription& frame, const Parameters& parameters,
             const lens::CircleOfConfusion& coc);

// At least one of shutter and lens. The parameters must outlive it.
struct Settings {
    const Parameters& parameters;
    std::optional<Shutter> shutter = {};
    std::optional<Lens> lens = {};
    // A block keeps its color if no displacement is longer.
    double still_limit_px = shared::kSharpRadiusPx;
    const char* still_rule = "";  // rule under which the device finds still blocks; "" = none

    // Without a jitter of its times, the shutter alone needs no random numbers.
    noise::Parameters noise() const;
};

// Planes that it reads, color among them.
RoleSet required_planes(bool shutter);
RoleSet optional_planes(bool shutter, Neighbors neighbors);

// The guarantees of a pass that does nothing else.
Guarantees guarantees_of(const Settings& settings);

// At most both neighbors. Allocates nothing: uniforms are written with it.
class NeighborList {
  public:
    void add(Neighbor neighbor) { items_[size_++] = neighbor; }
    const Neighbor* begin() const { return items_.data(); }
    const Neighbor* end() const { return items_.data() + size_; }
    size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }

  private:
    std::array<Neighbor, kNeighbors.size()> items_{};
    size_t size_ = 0;
};

// The neighbors of this frame that are searched: those whose color, inverse depth and motion are
// available beside the frame's own motion. None if the shutter is open for less than an eighth of a
// frame: a frame is then farther away than the paths of surfaces are known.
NeighborList searched_neighbors(const Settings& settings, RoleSet available);

// Does the pass use the layer behind (chain/frame/behind.h)? Not beside a hint that it is given: a
// step has too few textures for both, and that hint comes from a pass that has blurred the frame's
// color.
bool uses_second_layer(const Settings& settings, const PlanContext& context);

// True if the pass searches other frames or the layer behind: what this frame wholly hides may then
// move or be out of focus, and the frame's bounds do not cover it.
bool uses_hidden_surfaces(const Settings& settings, const PlanContext& context);

// Settings that lead to the same programs as these and to every other choice of programs that
// another shutter time can lead to.
std::vector<Settings> every_shape(const Settings& settings);

// A pass on a frame, without its identity. Adds the steps and textures above and hands on color
// and, if wanted, the hint: with a shutter a new one, otherwise the given one.
class WarpOnFrame : public PassOnFrame {
  public:
    WarpOnFrame(const Settings& settings, const FrameDescription& frame)
        : settings_(settings), frame_(frame) {}

    std::vector<UsedValue> used_values() const override;
    std::vector<ExceededLimit> exceeded_limits() const override;
    Reach reach() const override;
    ShapeNumbers shape(const PlanContext& context) const override;
    void plan(PassPlanner& planner) const override;
    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override;
    void reference(const PlanContext& context, ReferenceFrame& frame) const override;

  protected:
    const Settings& settings() const { return settings_; }
    const FrameDescription& frame() const { return frame_; }

  private:
    Settings settings_;
    const FrameDescription& frame_;
};

}  // namespace postchain::inverse_warp
