// The plan: the work for one frame, as plain data.
//
// make_plan() (chain/pass/planner.h) is a pure function: chain + facts about the frame -> Plan. A
// Plan can be printed, compared and hashed, and links without GL; the executor walks it and adds
// nothing of its own. A step is a compute dispatch: program, bindings, uniform block, groups.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "chain/base/area.h"
#include "chain/frame/frame.h"
#include "chain/frame/role.h"
#include "chain/plan/elision.h"
#include "shaders/shared/work_group.h"

namespace postchain {

using shared::kBlockPx;

// A work list is a buffer of the blocks of pixels that one step has to do, filled on the device by
// an earlier step (shaders/common/work_list.glsl). Its width is its capacity in blocks, its height
// 1.
enum class Format {
    rgba32f,
    rgba16f,
    rg32f,
    rg16f,
    r32f,
    r16f,
    rgba8,
    rg8,
    r8,
    rgba32ui,  // packed bits: usampler2D, uimage2D
    r32ui,
    work_list
};
const char* name_of(Format format);
int bytes_per_pixel(Format format);  // for a work list: per block
int channels_of(Format format);      // 0 for a work list

// The header of a work list: work groups x, y, z, and the number of blocks.
inline constexpr uint64_t kWorkListHeaderBytes = 16;

// Storage of a plane with 1, 2 or 4 channels at the chain's precision.
Format plane_format(int channels, Precision precision);

using TextureId = int;  // index into Plan::textures

// A texture or work list of a device.
struct Storage {
    Format format = Format::rgba32f;
    int width = 0;  // of a work list, the blocks that it can hold
    int height = 0;
    int slices = 0;  // planes of an array (chain/frame/layers.h); 0: not an array

    uint64_t bytes() const;
    std::string text() const;  // "1920x1080x3 rgba16f"
    bool operator==(const Storage&) const = default;
};

// Its storage is that on this frame (fit()).
struct PlanTexture : Storage {
    std::string name;         // "input.color", "0.motion_blur.tile_max"
    bool imported = false;    // handed in by the caller, never in the pool
    Role role = Role::color;  // role of an imported texture
    int first_step = -1;      // first and last step that touch it; -1 = none
    int last_step = -1;       // for an output: one past the plan's last step
    int pass = -1;            // its pass, an index into Plan::passes; -1: an input
    Area area = {};           // its size on frames of every size; of a work list, its blocks

    bool operator==(const PlanTexture&) const = default;
};

// How a step sees a texture: `layout(binding = unit)` of a sampler2D or image2D; for an array of
// planes, of a sampler2DArray or image2DArray. A step may sample a texture that it writes, if each
// invocation reads only texels that it alone writes, and before it writes them.
enum class Access {
    sample_nearest,  // sampler2D, nearest, clamp to edge (texelFetch works too)
    read,            // readonly image2D, for a step that has no sampler2D left
    write,           // writeonly image2D
    list,            // std430 buffer of a work list; empty before the first step that binds it
};

struct Binding {
    int unit = 0;
    TextureId texture = -1;
    Access access = Access::sample_nearest;
    bool operator==(const Binding&) const = default;
};

// A compute program: file under shaders/ and the macros it is compiled with.
struct ProgramKey {
    std::string file;                            // "motion_blur/gather.comp"
    std::map<std::string, std::string> defines;  // name -> value
    std::string text() const;                    // "file A=1 B=2": the cache key
    bool operator==(const ProgramKey&) const = default;
};

// Value of a macro.
inline const char* flag(bool on) {
    return on ? "1" : "0";
}

struct Step {
    int pass = 0;      // index into Plan::passes
    std::string name;  // "gather"
    ProgramKey program;
    std::vector<Binding> bindings;
    std::vector<std::byte> uniforms;            // std140 uniform block at binding 0; may be empty
    std::string uniforms_type;                  // its name in the shader: "MotionBlurUniforms"
    Area spread = Area().in_squares(kBlockPx);  // work groups along x and y on frames of every size
    std::array<int, 3> groups = {1, 1, 1};  // on this frame; with work_list, the most there can be
    TextureId work_list = -1;  // launches one work group per block of this list instead
    uint64_t taps = 0;         // texture fetches per dispatch, for cost reports (0 = not counted)
    uint64_t group_taps = 0;   // of one work group, at most, for its bands (bands.h); 0: by taps
    int first_layer = 0;       // first and number of the frame's extra layers that
    int layers = 0;            // the step does; 0: all layers
    bool operator==(const Step&) const = default;

    // True if the step changes the bound texture. A step fills the lists that it binds, except its
    // own.
    bool writes(const Binding& binding) const {
        return binding.access == Access::write ||
               (binding.access == Access::list && binding.texture != work_list);
    }

    // Its uniform block is this struct of shaders/shared, which PassOnFrame::write_uniforms()
    // fills. The executor compares name and size with the shader's block.
    template <class Uniforms>
    void take_uniforms() {
        static_assert(std::is_trivially_copyable_v<Uniforms> && sizeof(Uniforms) % 16 == 0,
                      "a std140 block is a multiple of 16 bytes");
        uniforms_type = Uniforms::kName;
    }
    // Its uniform block with values that every frame of the plan's shape has.
    template <class Uniforms>
    void set_uniforms(const Uniforms& value) {
        take_uniforms<Uniforms>();
        uniforms.resize(sizeof(Uniforms));
        std::memcpy(uniforms.data(), &value, sizeof(Uniforms));
    }
};

// The edge of the tiles in which a pass counts a part of its textures (Area::tiles()).
struct TileEdge {
    int px = 1;
    int least_px = 1;  // on frames of every size
    bool operator==(const TileEdge&) const = default;
};

struct PlanPass {
    std::string type;  // "motion_blur"
    std::string text;  // its parameters, canonical
    bool elided = false;
    TileEdge tiles = {};
    bool operator==(const PlanPass&) const = default;
};

struct Plan {
    int frame_number = 0;
    int width = 0;
    int height = 0;
    Precision precision = Precision::fp32;
    uint64_t chain_hash = 0;
    std::vector<PlanPass> passes;  // passes of the chain, in order, elided or not
    std::vector<PlanTexture> textures;
    std::vector<Step> steps;
    std::vector<Elision> elisions;
    RoleSet reads;  // imported planes that some step reads
    // Neighbors that a pass which runs could have used, and why they are missing.
    std::map<Neighbor, std::string> missing_neighbors;
    std::map<Place, double> inverse_depth_at;  // depths given to its passes, 1/scene units
    std::map<Role, TextureId> outputs;         // at least color

    std::vector<std::string> types() const;       // of the passes
    std::string name_of(const Step& step) const;  // "motion_blur.gather"
    uint64_t transient_bytes() const;             // all textures the plan allocates, without reuse
    uint64_t peak_bytes() const;                  // largest sum alive at one step
    uint64_t hash() const;
    bool operator==(const Plan&) const = default;
};

// How many blocks a work list held when the plan had run.
struct WorkDone {
    std::string list;     // "0.motion_blur.still_blocks"
    unsigned blocks = 0;  // of 16 x 16 pixels
    unsigned of = 0;      // blocks in all
};

// An entry of plan.elisions after the plan has run: with the taps of the blocks that the device
// found, or empty if it found none. Other entries are unchanged.
std::optional<Elision> found_in(const Elision& elision, const Plan& plan,
                                const std::vector<WorkDone>& done);

// item_text() of one of the plan's entries.
std::string item_text(const Elision& elision, const Plan& plan);

// True if both plans differ only in values and in what fit() sets: a compiled one can take the
// values of the other. Names of passes and elisions do not count.
bool same_shape(const Plan& a, const Plan& b);
// Makes the plan one for a frame of this size: sets its size, and those of textures and work
// groups. Allocates nothing.
void fit(Plan& plan, int width, int height);
// The width and height of a texture on such a frame; a work list has the height 1.
std::array<int, 2> size_of(const PlanTexture& texture, const FrameSize& frame);

// Sets first and last step of every texture. `outputs`: textures read after the last step; their
// last step is one past it.
void find_lifetimes(Plan& plan, const std::vector<TextureId>& outputs);

}  // namespace postchain
