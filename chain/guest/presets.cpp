#include "chain/guest/presets.h"

#include <string>

#include "chain/base/status.h"

namespace postchain::guest {
namespace {

struct Convention {
    std::string_view engine;
    pc_depth depth;
    uint32_t flags;  // of rows and vectors
    bool pixels;     // vectors are in pixels, otherwise in fractions of the image
    float scale_x, scale_y;
    float bias;
};

constexpr uint32_t kFlags = PC_TOP_LEFT | PC_BOTTOM_LEFT | PC_MOTION_TO_NEXT | PC_MOTION_JITTERED;

// Rows are ordered as in the engine's own textures. A host that draws them through GL upside down
// replaces PC_TOP_LEFT by PC_BOTTOM_LEFT and negates motion_scale[1]. "Read" means read in the
// named file. Values that were only taken from descriptions are marked unverified;
// pc_check_motion() decides.
constexpr Convention kConventions[] = {
    // Unity, high definition pipeline under OpenGL: MotionVectorCommon.hlsl, EncodeMotionVector():
    // 0.5 (positionCS - previousPositionCS), both without jitter; depth is not reversed there
    // (UNITY_REVERSED_Z is not defined for OpenGL) and textures begin at the bottom. The function
    // was read; rows and the factor of 0.5 are unverified.
    {"unity", PC_DEPTH_FORWARD, PC_BOTTOM_LEFT, false, 1, 1, 0},
    // Unreal: Common.ush, EncodeVelocityToTexture(): V 0.499 0.5 + 32767/65535 of V = this minus
    // previous in clip space, y up. If VELOCITY_ENCODE_GAMMA is 1, the vectors must be decoded
    // first: they are stored as a root. A stored 0 means unwritten; the host draws those. Read.
    {"unreal", PC_DEPTH_REVERSE_INFINITE, PC_TOP_LEFT, false, 0.5f / (0.499f * 0.5f),
     -0.5f / (0.499f * 0.5f), 32767.0f / 65535.0f},
    // Bevy: pbr_prepass_functions.wgsl, calculate_motion_vector(): (clip - previous clip) (0.5,
    // -0.5), without jitter; the projection is reversed and infinite. Read.
    {"bevy", PC_DEPTH_REVERSE_INFINITE, PC_TOP_LEFT, false, 1, 1, 0},
    // Godot from 4.3 on: scene_forward_clustered.glsl: prev_position_uv - position_uv, without
    // jitter; the projection is reversed, with a far plane. Read; the depth is unverified.
    {"godot", PC_DEPTH_REVERSE, PC_TOP_LEFT, false, -1, -1, 0},
    // Falcor: Utils/Math/MathHelpers.slang, calcMotionVector(): previous minus this in fractions of
    // the image, y down; the depth of GBufferRaster is Direct3D's, not reversed. Unverified.
    {"falcor", PC_DEPTH_FORWARD, PC_TOP_LEFT, false, -1, -1, 0},
    // G3D 10: GBuffer::Field::SS_POSITION_CHANGE, this minus previous in pixels, y down, rows from
    // the top; the projection has a far plane. Unverified.
    {"g3d", PC_DEPTH_FORWARD, PC_TOP_LEFT, true, 1, 1, 0},
};

}  // namespace

// Those that have the name of a shipped chain are that chain, but for `neighbors`, which are used
// if the host gives them, and FXAA's `where`: a frame may have one sample a pixel, and is not read
// back to find out. Errors: docs/integration.md.
const std::vector<Tier>& tiers() {
    using std::string;
    static const std::vector<Tier> all = {
        {"paper",
         "the filters of a 2013 paper, in a third of the time of fast: blur of what is in front "
         "spills over edges",
         {{"motion_blur",
           {{"mode", string("guertin")},
            {"samples", int64_t(25)},
            {"max_blur_px", int64_t(40)},
            {"jitter", 0.95},
            {"center_weight", 40.0},
            {"variance_threshold_px", 1.5}}},
          {"fxaa",
           {{"preset", int64_t(12)},
            {"hint", string("checkerboard")},
            {"hint_gate", string("tile")}}},
          {"depth_of_field",
           {{"method", string("gilham")},
            {"coc", string("lens")},
            {"downsample", int64_t(4)},
            {"leak", string("coc")}}}}},
        {"realtime",
         "motion blur and depth of field in one with 8 samples, for games: after a TAA, with noise "
         "that a TAA behind it resolves",
         {{"joint_blur", {{"samples", int64_t(8)}, {"animate_noise", true}}}}},
        {"fast",
         "15 samples; with the frame before better than balanced without",
         {{"joint_blur", {{"samples", int64_t(15)}, {"starts", int64_t(5)}}},
          {"fxaa", {{"mode", string("directional")}}}}},
        {"balanced",
         "28 samples, for hosts that give the frame before",
         {{"joint_blur", {{"samples", int64_t(28)}, {"starts", int64_t(6)}}},
          {"fxaa", {{"mode", string("directional")}}}}},
        {"best",
         "128 samples, for stills and film",
         {{"joint_blur", {{"samples", int64_t(128)}, {"starts", int64_t(8)}}}}}};
    return all;
}

Result<Chain> make_tier(std::string_view name, const PassRegistry& registry) {
    std::string names;
    for (const Tier& tier : tiers()) {
        names += (names.empty() ? "" : ", ") + std::string(tier.name);
        if (tier.name != name) continue;
        Chain chain;
        for (const Tier::Pass& pass : tier.passes) {
            Pass* made = chain.append(registry, pass.type);
            if (!made)
                return Status(StatusCode::chain,
                              concat("tier:", name, ": this library has no pass ", pass.type));
            const ParameterTable& table = *chain.links.back().type->parameters;
            for (const auto& [key, value] : pass.values)
                if (Status s = table.set(made->parameters(), key, value); !s.ok())
                    return s.at(pass.type);
        }
        return chain;
    }
    return Status(StatusCode::chain, concat("unknown tier \"", name, "\"; known are ", names));
}

bool use_conventions(std::string_view engine, pc_frame& frame) {
    for (const Convention& convention : kConventions) {
        if (convention.engine != engine) continue;
        const pc_texture& color = frame.color;
        const auto width = float(frame.width ? frame.width : int64_t(color.width) - color.x);
        const auto height = float(frame.height ? frame.height : int64_t(color.height) - color.y);
        frame.depth_encoding = convention.depth;
        frame.flags = (frame.flags & ~kFlags) | convention.flags;
        frame.motion_scale[0] = convention.scale_x * (convention.pixels ? 1 : width);
        frame.motion_scale[1] = convention.scale_y * (convention.pixels ? 1 : height);
        frame.motion_bias[0] = frame.motion_bias[1] = convention.bias;
        return true;
    }
    return false;
}

std::string engines_text() {
    std::string text;
    for (const Convention& convention : kConventions)
        text += concat(text.empty() ? "" : ", ", convention.engine);
    return text;
}

}  // namespace postchain::guest
