// Mattes, and the effect `unblurred`: objects that a pass leaves as they are are held out before it
// and laid over its result. docs/layers.md has the method. The pass itself knows nothing of it: it
// filters two more layers, color without the object and how much of each pixel is not the object.
#pragma once

#include <algorithm>
#include <array>
#include <map>

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

// The frame as a pass with such a matte sees it: with the two layers of held_layers() before its
// own.
FrameDescription with_held_layers(const FrameDescription& frame);

// What hold_out() puts in the place of a frame's layers: restored after the pass.
inline constexpr std::array<Role, 3> kHeldRoles = {Role::layers, Role::layers_before,
                                                   Role::layers_after};

// Adds the steps that make them, of this frame and of the neighbors that the context has, and hands
// them on as its layers. `layers`: how many the frame has of its own. `planner`: of
// with_held_layers().
void hold_out(PassPlanner& planner, int matte, int layers);

// Before and after a pass that filtered held layers.
struct Matted {
    TextureId color, filtered_color;
    TextureId held, filtered_held;
    TextureId layers;  // the frame's own, unfiltered; -1: it has none
};

// Adds the step that lays what was held out over what was filtered, and hands on color and layers.
void lay_over(PassPlanner& planner, int matte, const Matted& matted);

// The same in double precision. `before`: the planes before hold_out_reference().
void hold_out_reference(std::map<Role, ImageD>& planes, int matte);
void lay_over_reference(std::map<Role, ImageD>& planes, const std::map<Role, ImageD>& before,
                        int matte);

}  // namespace postchain
