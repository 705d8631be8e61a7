#version 450 core
// Half-velocities, and the first half of TileMax: for each tile column and each row of pixels the
// half-velocity of largest length.
//
//   motion -> half_velocity  v = 0.5 shutter motion, |v| > r -> v r/|v| (radial, not per component)
//          -> row_max        x y: v, z: its squared length before the clamp, w: smallest |v|
//          -> row_range      RANGE: x y: smallest components of v, z w: largest
//   inverse_depth
//          -> row_depth      DEPTH: x: smallest, y: largest
//
// Lengths are compared before the clamp: after it, everything long has length r and the last bit
// would decide. Ties: the first in the row.
#include "common/work_group.glsl"
#include "shared/motion_blur_block.h"

layout(binding = 0) uniform sampler2D motion;
layout(binding = 0) writeonly uniform image2D half_velocity;
layout(binding = 1) writeonly uniform image2D row_max;
#if RANGE
layout(binding = 2) writeonly uniform image2D row_range;
#endif
#if DEPTH
layout(binding = 1) uniform sampler2D inverse_depth;
layout(binding = 3) writeonly uniform image2D row_depth;
#endif

#include "motion_blur/velocity.glsl"

// A motion of this many pixels (or NaN) is none: its square would not fit a float.
const float kLargestMotion = 1e18;

void main() {
    const int column = int(gl_GlobalInvocationID.x);
    const int y = int(gl_GlobalInvocationID.y);
    if (column >= block.tiles.x || y >= block.size.y) return;
    const float radius = float(block.tile_px);
    const int first = column * block.tile_px;
    const int last = min(first + block.tile_px, block.size.x) - 1;
    vec3 largest = vec3(0.0, 0.0, -1.0);
    float smallest_squared = radius * radius;
    vec4 range = vec4(radius, radius, -radius, -radius);
#if DEPTH
    vec2 depths = vec2(texelFetch(inverse_depth, ivec2(first, y), 0).x);
#endif
    for (int x = first; x <= last; ++x) {
        const vec2 m = texelFetch(motion, ivec2(x, y), 0).xy;
        vec2 v = vec2(0.0);
        if (max(abs(m.x), abs(m.y)) <= kLargestMotion) v = block.half_shutter * m;
        const float squared = dot(v, v);
        if (squared > radius * radius) v *= radius / sqrt(squared);
        const vec2 stored = encode_velocity(v);
        imageStore(half_velocity, ivec2(x, y), vec4(stored, 0.0, 0.0));
        v = decode_velocity(stored);
        if (squared > largest.z) largest = vec3(v, squared);
        smallest_squared = min(smallest_squared, dot(v, v));
        range = vec4(min(range.xy, v), max(range.zw, v));
#if DEPTH
        const float q = texelFetch(inverse_depth, ivec2(x, y), 0).x;
        depths = vec2(min(depths.x, q), max(depths.y, q));
#endif
    }
    imageStore(row_max, ivec2(column, y), vec4(largest, sqrt(smallest_squared)));
#if RANGE
    imageStore(row_range, ivec2(column, y), range);
#endif
#if DEPTH
    imageStore(row_depth, ivec2(column, y), vec4(depths, 0.0, 0.0));
#endif
}
