// A host's frame: the checked input, and the key of its plans.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <map>
#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "chain/guest/failure.h"
#include "chain/pass/chain.h"
#include "chain/plan/storage.h"
#include "shaders/shared/guest_uniforms.h"

namespace postchain::guest {

struct HostFormat {
    unsigned name = 0;  // GL_RGBA16F
    const char* text = "";
    int channels = 0;
    bool depth = false;
    bool image = false;  // can be written as an image
    bool half = false;   // halves hold every value
    // Largest value of a float format; 0: normalized, or as large as color can be.
    float largest() const;
};

// Null for integer, compressed and unsized formats, and others that no plane can be read from.
const HostFormat* find_format(unsigned internal_format);

// "GL_RGBA16F", "0x8d7c".
std::string text_of_format(unsigned internal_format);

// One of the frame's textures.
struct HostTexture {
    uint32_t name = 0;
    const HostFormat* format = nullptr;
    bool at_origin = false;     // the frame's rectangle begins at its first texel
    ImageOf image;              // the slice and level that count
    bool array = false;         // a GL_TEXTURE_2D_ARRAY
    int width = 0, height = 0;  // texels of the frame's rectangle
};

// The planes of a checked frame or neighbor. Points to its pc_frame, which must outlive it.
struct HostPlanes {
    const pc_frame* given = nullptr;  // null: a neighbor that is not used
    int width = 0, height = 0;
    HostTexture color, depth, motion, exposure;
    bool sky = false;  // vectors of the sky are computed

    bool flag(uint32_t bit) const { return (given->flags & bit) != 0; }
    bool top_left() const { return flag(PC_TOP_LEFT); }
    // The size of the planes that passes see.
    int plane_width() const { return halved() ? (width + 1) / 2 : width; }
    int plane_height() const { return halved() ? (height + 1) / 2 : height; }
    // The largest planes of frames like this one, up to that size.
    MaxFrameSize max_planes(uint32_t max_width, uint32_t max_height) const {
        const uint32_t part = halved() ? 2 : 1;
        return {int((max_width + part - 1) / part), int((max_height + part - 1) / part)};
    }
    bool halved() const { return flag(PC_HALF_RESOLUTION); }
    // Whether passes see color multiplied by a factor.
    bool has_gain() const;
    // Whether passes can read this texture as it is, apart from its values.
    bool is_plane(const HostTexture& texture) const {
        return texture.at_origin && top_left() && !texture.array && texture.image.level == 0 &&
               texture.width == width && texture.height == height && !halved();
    }
    bool color_is_plane() const { return is_plane(color) && !has_gain(); }
    bool depth_in_place() const {
        return is_plane(depth) && given->depth_encoding == PC_DEPTH_INVERSE;
    }
    bool motion_in_place() const;
    bool color_is_half() const { return color.format->half && !has_gain(); }
    // Motion has fewer texels than depth, which chooses among them.
    bool motion_by_depth() const {
        return motion.name && depth.name && motion.width <= depth.width &&
               motion.height <= depth.height &&
               (motion.width < depth.width || motion.height < depth.height);
    }
    uint32_t arrays() const;  // GUEST_ARRAY_...: which of the textures are arrays
    bool has_depth_range() const {
        return given->depth_range[0] != 0 || given->depth_range[1] != 0;
    }
};

// A checked frame.
struct HostFrame : HostPlanes {
    HostTexture mask, output;
    std::array<HostPlanes, kNeighbors.size()> neighbors;
    const std::map<Place, double>* focus = nullptr;  // inverse depths at the chain's places
    // The place that a step of the plan writes this frame's inverse depths to; -1: it has none.
    int focus_slot = -1;

    // Not if the output is another rectangle of its texture, which may overlap it.
    bool color_in_place() const {
        return color_is_plane() && (output.name != color.name || output_is_color());
    }
    bool output_is_an_input() const;
    bool output_is_color() const;  // the same rectangle of the same image
    // The output's format holds every value that color's does.
    bool output_holds_color() const;
    uint32_t all_arrays() const;  // arrays() with the mask and, four bits each, the neighbors'
    bool shows_fill() const;      // debug_view "fill": the plan filters a fill mask
};

// The description for the planner. Precondition: check_frame().
FrameDescription describe(const HostFrame& frame, const Chain& chain);

// Directions to x, y and w of clip space: the first three columns of a view projection.
glm::dmat3 clip_directions(const float (&columns)[16]);

inline constexpr size_t kLongestView = 63;  // letters of a debug_view
// Flags that choose a plan's programs or textures.
inline constexpr uint32_t kPlanFlags =
    PC_HALF_PLANES | PC_NO_ELISION | PC_HALF_RESOLUTION | PC_FAST_MATH;

// Everything that a plan and its conversion depend on, except the frame's size, values and number.
// Plans of equal keys have the same shape if their PlanShapes (chain/pass/planner.h) are equal.
struct PlanKey {
    uint64_t chain = 0, revision = 0;
    MaxFrameSize max_size;  // its textures are as large as frames of this size need
    uint32_t flags = 0;
    std::array<const HostFormat*, 4> formats = {};  // color, depth, motion, output
    std::array<bool, 12> cases = {};
    std::array<uint32_t, kNeighbors.size()> neighbors = {};  // bits of their cases; 0: not used
    uint32_t arrays = 0;                                     // HostFrame::all_arrays()
    std::array<char, kLongestView + 1> debug_view = {};
    bool operator==(const PlanKey&) const = default;
};
PlanKey key_of(const HostFrame& frame, const MaxFrameSize& max_size, uint64_t chain,
               uint64_t revision);

// The values that select programs, beside the planes that a frame may lack: pc_prepare() compiles
// the programs of all frames of one kind. Its comment in postchain.h lists the members.
struct FrameKind {
    uint64_t chain = 0, revision = 0;
    uint32_t flags = 0;  // those of kPlanFlags
    bool depth = false, motion = false, mask = false, exposure = false, before = false,
         after = false;
    uint32_t arrays = 0;  // HostFrame::all_arrays()
    std::array<char, kLongestView + 1> debug_view = {};
    bool operator==(const FrameKind&) const = default;
};
FrameKind kind_of(const HostFrame& frame, uint64_t chain, uint64_t revision);
// The member by which a frame is of none of these kinds, and the remedy. `prepare`: the function of
// the host that prepares.
std::string difference_text(const FrameKind& kind, const std::vector<FrameKind>& prepared,
                            const std::string& prepare = "pc_prepare()");

// The uniform block of the step that converts these planes.
shared::GuestUniforms uniforms_of(const HostPlanes& planes);
// Likewise of the other steps between the host's textures and the chain.
shared::GuestUniforms uniforms_of(const HostFrame& frame);

}  // namespace postchain::guest
