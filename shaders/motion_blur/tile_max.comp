#version 450 core
// TileMax: the longest half-velocity of each tile. One work group per tile.
//
//   motion        -> tile_max        x y: v, z: its squared length before the clamp, w: least |v|
//                 -> half_velocity   STORAGE: v of each pixel
//   inverse_depth -> tile_depth      DEPTH: x: smallest inverse depth, y: largest
//
// Lengths are compared before the clamp: after it, all long vectors have length r and the last bit
// would decide. On a tie, the first in row order wins.
#include "shared/motion_blur_uniforms.h"

#ifdef SOFTWARE_RENDERER
const int kThreads = 64;
#else
const int kThreads = 256;  // a frame has few tiles, and a GPU hides latency by threads
#endif
layout(local_size_x = kThreads) in;

#include "common/first_group.glsl"
#include "common/software_loop.glsl"

layout(binding = 0) uniform sampler2D motion;
layout(binding = 0) writeonly uniform image2D tile_max;
#if STORAGE
layout(binding = 1) writeonly uniform image2D half_velocity;
#endif
#if DEPTH
layout(binding = 1) uniform sampler2D inverse_depth;
layout(binding = 3) writeonly uniform image2D tile_depth;
#endif

#include "motion_blur/velocity.glsl"

// Results over some pixels of the tile.
struct Part {
    vec3 largest;  // v and its squared length before the clamp
    int index;     // index of its pixel, in row order
    float smallest_squared;
#if DEPTH
    vec2 depths;
#endif
};
shared Part parts[kThreads];

void add(inout Part part, Part other) {
    if (other.largest.z > part.largest.z ||
        (other.largest.z == part.largest.z && other.index < part.index)) {
        part.largest = other.largest;
        part.index = other.index;
    }
    part.smallest_squared = min(part.smallest_squared, other.smallest_squared);
#if DEPTH
    part.depths = vec2(min(part.depths.x, other.depths.x), max(part.depths.y, other.depths.y));
#endif
}

void main() {
    const ivec2 tile = group_at();
    const int thread = int(gl_LocalInvocationIndex);
    const float radius = float(uniforms.tile_px);
    const ivec2 first = tile * uniforms.tile_px;
    Part part;
    part.largest = vec3(0.0, 0.0, -1.0);
    part.index = 0;
    part.smallest_squared = radius * radius;
#if DEPTH
    part.depths = vec2(texelFetch(inverse_depth, first, 0).x);
#endif
    // Every kThreads-th pixel in row order.
    const ivec2 size = min(ivec2(uniforms.tile_px), uniforms.size - first);
    const int count = size.x * size.y;
    int next = thread;
    SOFTWARE_LOOP do {
        // One beyond the end is taken for the last, which changes no extreme.
        const int index = min(next, count - 1);
        precise const float rows = (float(index) + 0.5) / float(size.x);
        const int row = int(rows);
        const ivec2 p = first + ivec2(index - row * size.x, row);
        vec2 v = long_velocity(texelFetch(motion, p, 0).xy);
        const float squared = precise_dot(v, v);
#if STORAGE
        const vec2 stored = encode_velocity(clamped_velocity(v, squared));
        imageStore(half_velocity, p, vec4(stored, 0.0, 0.0));
        v = decode_velocity(stored);
        part.smallest_squared = min(part.smallest_squared, precise_dot(v, v));
#else
        part.smallest_squared = min(part.smallest_squared, squared);
#endif
        if (squared > part.largest.z) {
            part.largest = vec3(v, squared);
            part.index = index;
        }
#if DEPTH
        const float q = texelFetch(inverse_depth, p, 0).x;
        part.depths = vec2(min(part.depths.x, q), max(part.depths.y, q));
#endif
        next += kThreads;
    } while (next < count);

    parts[thread] = part;
    barrier();
#ifdef SOFTWARE_RENDERER
    if (thread != 0) return;
    for (int i = 1; i < kThreads; ++i) add(part, parts[i]);
#else
    for (int rest = kThreads / 2; rest > 0; rest /= 2) {
        if (thread < rest) {
            add(part, parts[thread + rest]);
            parts[thread] = part;
        }
        barrier();
    }
    if (thread != 0) return;
#endif
#if !STORAGE
    part.largest.xy = clamped_velocity(part.largest.xy, part.largest.z);
#endif
    imageStore(tile_max, tile, vec4(part.largest, sqrt(part.smallest_squared)));
#if DEPTH
    imageStore(tile_depth, tile, vec4(part.depths, 0.0, 0.0));
#endif
}
