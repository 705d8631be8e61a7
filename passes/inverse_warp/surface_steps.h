// The steps of the inverse warp that make the surfaces of this frame and of its neighbors.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "chain/work_list.h"
#include "passes/inverse_warp/inverse_warp.h"
#include "shaders/shared/inverse_warp_uniforms.h"

namespace postchain::inverse_warp {

inline constexpr Area kBlocks = groups_for(Area());  // of the frame

// Value of a macro.
std::string flag(bool on);

// The uniforms of these steps that differ from the pass's.
void write_surface_uniforms(const NeighborList& neighbors, shared::InverseWarpUniforms uniforms,
                            UniformWriter& writer);

class SurfacePlanner {
  protected:
    SurfacePlanner(PassPlanner& planner, const Settings& settings);

    // With a layer behind also its surfaces, in the texture's second half.
    TextureId add_surfaces();
    // Surfaces of the neighbors, a half of the texture each if there are two. Those that this frame
    // hides are left out if the light has changed around them.
    TextureId add_surfaces_of(const NeighborList& neighbors, TextureId surfaces_here);

    // A step over all pixels.
    Step make_step(const std::string& name) const;
    // For every step that reads surfaces.
    Step make_surface_step(const std::string& name) const;

    PassPlanner& planner_;
    const Settings& settings_;
    const FrameDescription& frame_;
    const bool motion_;        // surfaces hold it
    const bool second_layer_;  // the pass uses the layer behind (chain/behind.h)
    const std::array<int, 3> blocks_;
    const uint64_t pixels_;

  private:
    Format surface_format() const { return motion_ ? Format::rgba32ui : Format::r32ui; }
    // The planes of this frame, or of a neighbor whose light is compared with this frame's.
    struct Packed {
        TextureId surfaces = -1;
        std::optional<Neighbor> neighbor = {};
        TextureId here = -1;   // with a neighbor: surfaces of this frame
        TextureId marks = -1;  // of squares
        TextureId light = -1;  // with a neighbor
    };
    // A step over all pixels of this frame or of a neighbor.
    Step make_surface_step_of(const Packed& packed, const std::string& name) const;
    // A step that reads planes, with a thread for each square.
    Step make_plane_step(const Packed& packed, const std::string& name) const;
    void add_second_surfaces(TextureId surfaces);
    // From the planes.
    void add_packed(Packed& packed);
    void add_light(Packed& packed);
    // Changes the surfaces of bright edges and, of a neighbor, of those whose light differs.
    void add_shown(const Packed& packed);
};

}  // namespace postchain::inverse_warp
