// Mattes, and the effect `unblurred`: objects that a pass leaves as they are. They are held out
// before the pass and laid over its result. The method: docs/layers.md. The pass itself knows
// nothing of it: it filters two more layers, color without the object and the part of each pixel
// that is not the object.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <span>

#include "chain/pass.h"

namespace postchain {

// Index of the matte that holds for this pass of the chain (FrameDescription::mattes); -1: none.
int matte_of(const FrameDescription& frame, size_t pass);

// The matte of this index at a pixel of a frame `height` pixels high, in 0..1; NaN counts as 0.
template <class Image>
double matte_at(const Image& mattes, int index, int height, int x, int y) {
    const double m = mattes.at(x, y + index * height);
    return m > 0 ? std::min(m, 1.0) : 0;
}

// A pass on a frame with the effect of a matte around it. The pass sees a frame of its own.
class MattedPass : public PassOnFrame {
  public:
    // The frame that the pass sees and was resolved with.
    using Seen = std::shared_ptr<const FrameDescription>;

    MattedPass(ResolvedPass pass, Seen frame, int matte)
        : pass_(std::make_unique<ResolvedPass>(std::move(pass))),
          frame_(std::move(frame)),
          matte_(matte) {}

    Reach reach() const override { return pass().reach(); }
    std::vector<UsedValue> used_values() const override { return pass().used_values(); }
    std::vector<Cut> cuts() const override { return pass().cuts(); }
    TileEdge tile_edge() const override { return pass().tile_edge(); }
    std::optional<Identity> identity(const PlanContext& context) const override {
        return pass().identity(seen(context));
    }
    ShapeNumbers shape(const PlanContext& context) const override {
        return pass().shape(seen(context));
    }
    void write_uniforms(const PlanContext& context, UniformWriter& uniforms) const override {
        pass().write_uniforms(seen(context), uniforms);
    }

  protected:
    const PassOnFrame& pass() const { return **pass_; }
    int matte() const { return matte_; }
    PlanContext seen(const PlanContext& context) const;
    // The planes that the pass sees. A neighbor's are available only if its mattes are too.
    virtual RoleSet planes(const PlanContext& context) const;

  private:
    std::unique_ptr<ResolvedPass> pass_;
    Seen frame_;
    int matte_;
};

// The planes of some roles before a pass. restore() puts them in the place of the pass's own.
class PlanesBefore {
  public:
    PlanesBefore(const PassPlanner& planner, std::span<const Role> roles);
    void restore(PassPlanner& planner) const;

  private:
    std::vector<std::pair<Role, TextureId>> planes_;  // -1: there was none
};

// Likewise in the reference.
void restore(std::span<const Role> roles, const std::map<Role, ImageD>& before,
             std::map<Role, ImageD>& planes);

// A pass with the effect `unblurred`, and the frame that the pass sees: with two layers before its
// own.
ResolvedPass unblurred(ResolvedPass pass, MattedPass::Seen frame, int matte);
FrameDescription with_held_layers(const FrameDescription& frame);

// Replaces the layers by those that the pass filters, with the object held out, in the reference.
void hold_out_reference(std::map<Role, ImageD>& planes, int matte);

}  // namespace postchain
