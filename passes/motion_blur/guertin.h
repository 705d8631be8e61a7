// The report's filter, modes guertin and single.
#pragma once

#include "chain/pass.h"
#include "passes/motion_blur/parameters.h"

namespace postchain::motion_blur {

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
