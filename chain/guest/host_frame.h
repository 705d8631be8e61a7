// A host's frame: the checked input, and the key of its plans.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "chain/guest/failure.h"
#include "chain/guest/host_format.h"
#include "chain/storage.h"
#include "shaders/shared/guest_uniforms.h"

namespace postchain::guest {

// One of the frame's textures.
struct HostTexture {
    uint32_t name = 0;
    const HostFormat* format = nullptr;
    bool at_origin = false;  // the frame's rectangle begins at its first texel
    bool operator==(const HostTexture&) const = default;
};

// A checked frame. Points to its pc_frame, which must outlive it.
struct HostFrame {
    const pc_frame* given = nullptr;
    int width = 0, height = 0;
    HostTexture color, depth, motion, exposure, output;
    bool sky = false;  // vectors of the sky are computed

    bool flag(uint32_t bit) const { return (given->flags & bit) != 0; }
    bool top_left() const { return flag(PC_TOP_LEFT); }
    // Whether passes see color multiplied by a factor.
    bool has_gain() const;
    bool color_in_place() const { return color.at_origin && top_left() && !has_gain(); }
    bool depth_in_place() const {
        return depth.at_origin && top_left() && given->depth_encoding == PC_DEPTH_INVERSE;
    }
    bool motion_in_place() const;
    bool output_is_an_input() const;
    bool output_is_color() const;  // the same rectangle of the same texture
    bool shows_fill() const;       // debug_view "fill": the plan filters a fill mask
};

// Errors name the member. PC_ERROR_INPUT: a texture. PC_ERROR_CHAIN: camera values that the depth
// encoding needs, or a value that is not finite. Calls no GL, allocates nothing. `find`: the
// formats of the textures.
Failure check_frame(const pc_frame* given, HostFrame& frame,
                    const HostFormat* (*find)(unsigned) = find_format);

// For PC_VALIDATE: matrices that cannot be inverted, an output over another plane than color.
// Precondition: check_frame().
Failure check_deeper(const HostFrame& frame);

// The description for the planner. Precondition: check_frame().
FrameDescription describe(const HostFrame& frame);

// Everything that a plan and its conversion depend on, except the frame's size, values and number.
// Plans of equal keys have the same shape if their PlanShapes (chain/planner.h) are equal.
struct PlanKey {
    uint64_t chain = 0, revision = 0;
    Room room;  // its textures are as large as frames of this size need
    uint32_t flags = 0;
    std::array<const HostFormat*, 4> formats = {};  // color, depth, motion, output
    std::array<bool, 9> cases = {};
    std::array<char, 64> debug_view = {};
    bool operator==(const PlanKey&) const = default;
};
PlanKey key_of(const HostFrame& frame, const Room& room, uint64_t chain, uint64_t revision);

// The values that select programs, beside the planes that a frame may lack: pc_prepare() compiles
// the programs of all frames of one kind. docs/integration.md lists the members.
struct FrameKind {
    uint64_t chain = 0, revision = 0;
    uint32_t flags = 0;  // PC_HALF_PLANES, PC_NO_ELISION
    bool depth = false, motion = false, exposure = false;
    std::array<char, 64> debug_view = {};
    bool operator==(const FrameKind&) const = default;
};
FrameKind kind_of(const HostFrame& frame, uint64_t chain, uint64_t revision);
// The member by which a frame is of none of these kinds, and the remedy.
std::string difference_text(const FrameKind& kind, const std::vector<FrameKind>& prepared);

// The frame's size, camera, bounds, and 1 for each flag that changes them.
using FrameValues = std::array<float, 16>;
FrameValues values_of(const HostFrame& frame);

// The uniform block of the steps that convert from and to the host's textures.
shared::GuestUniforms uniforms_of(const HostFrame& frame);

}  // namespace postchain::guest
