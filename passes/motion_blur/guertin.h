// The report's filter, modes guertin and single.
#pragma once

#include "chain/pass/pass.h"
#include "passes/motion_blur/motion_blur.h"

namespace postchain::motion_blur {

// The limit of the report's filter, which is the edge of its tiles: the user's, or a sixteenth of
// the display width but at least kMinTilePx.
inline constexpr int kMinTilePx = 40;
inline constexpr int kMinFractionTilePx = 8;  // with max_blur_fraction
int tile_px(const Parameters& parameters, const FrameDescription& frame);
// On frames of every size.
int least_tile_px(const Parameters& parameters);

// A tile is left unblurred if |v_max| is at most this: min_speed_px plus the largest lengthening by
// storage of a half-velocity, so that motion that is still by the frame's bounds is still by its
// stored vectors too.
double still_limit_px(const Parameters& parameters, int tile_px);

// True if the report's filter compares depths, and splits its taps by the tiles' variance.
bool compares_depth(const Parameters& parameters);
bool splits_by_variance(const Parameters& parameters);

// True if the filter needs random numbers for tiles, and for taps.
bool jitters_tiles(const Parameters& parameters);
bool jitters_taps(const Parameters& parameters);

// The pass on a frame, without its identity. Steps and textures: guertin.cpp.
class Guertin : public PassOnFrame {
  public:
    // Facts about a frame's depths from its bounds.
    struct Depths {
        bool one = false;  // all pixels have the same depth
        bool sky = true;   // some pixels may be sky
    };
    static Depths depths_of(const FrameBounds& bounds);

    Guertin(const Parameters& parameters, const FrameDescription& frame, Depths depths)
        : parameters_(parameters), frame_(frame), depths_(depths) {}

    std::vector<UsedValue> used_values() const override;
    std::vector<ExceededLimit> exceeded_limits() const override;
    Reach reach() const override;
    TileEdge tile_edge() const override;
    ShapeNumbers shape(const PlanContext& context) const override;
    void plan(PassPlanner& planner) const override;
    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override;
    void reference(const PlanContext& context, ReferenceFrame& frame) const override;

  private:
    const Parameters& parameters_;
    const FrameDescription& frame_;
    Depths depths_;
};

}  // namespace postchain::motion_blur
