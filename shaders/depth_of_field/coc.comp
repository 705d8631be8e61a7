#version 450 core
// Signed radius of the circle of confusion in pixels, and other values that follow from depth. One
// work group per block of 16 x 16 pixels.
//
//   inverse_depth -> coc
//                 -> small_guide         GUIDE_DEPTH, GUIDE_RADIUS: the mean of w or of |R| over
//                                        boxes of FACTOR x FACTOR pixels, by which the Gaussian
//                                        tells who may leak into whom
//                 -> work lists, blurs   SORT: of the block
//
//   sharp     every |R| is at most 0.5 px: colors return bit for bit
//   blurred   every |R| is at least full_blur_px: only the blurred image shows
//   mixed     all others
//   blurs     1 where the block needs the blurred image
#include "shared/work_group.h"

// Few threads, with eight pixels each: one of them puts their ranges together.
const int kThreads = 2 * kBlockPx;
layout(local_size_x = kBlockPx, local_size_y = 2) in;

#include "common/first_group.glsl"
#include "common/work_list_fill.glsl"
#include "shared/depth_of_field_uniforms.h"
#include "shared/sharp_radius.h"

#include "common/circle_of_confusion.glsl"

layout(binding = 0) uniform sampler2D inverse_depth;
layout(binding = 0) writeonly uniform image2D coc;
#if defined(GUIDE_DEPTH) || defined(GUIDE_RADIUS)
layout(binding = 1) writeonly uniform image2D small_guide;
#endif
#ifdef SORT
layout(binding = 2) writeonly uniform image2D blurs;
layout(std430, binding = 0) buffer SharpBlocks { WORK_LIST } sharp_blocks;
layout(std430, binding = 1) buffer BlurredBlocks { WORK_LIST } blurred_blocks;
layout(std430, binding = 2) buffer MixedBlocks { WORK_LIST } mixed_blocks;

// HALF_RADIUS: coc is stored as a half, by up to 2^-10 of itself smaller than computed.
#ifdef HALF_RADIUS
const float kStored = 1.0 - 1.0 / 1024.0;
#else
const float kStored = 1.0;
#endif

shared vec2 ranges[kThreads];  // smallest and largest |R| of each thread's pixels
#endif

// NaN and negative count as sky, an infinite one (of distance 0) as the largest number.
float depth_at(ivec2 p) {
    const float w = texelFetch(inverse_depth, p, 0).x;
    return w > 0.0 ? min(w, 3.0e38) : 0.0;
}

#if defined(GUIDE_DEPTH) || defined(GUIDE_RADIUS)
float guide_of(ivec2 p) {
#ifdef GUIDE_DEPTH
    return min(depth_at(p), 1.0e37);  // the mean of 16 stays finite
#else
    return abs(radius_px(depth_at(p)));
#endif
}

// Pixels beyond the border do not count. Equal ones return unrounded.
void store_guide(ivec2 low) {
    const ivec2 first = low * FACTOR;
    const ivec2 end = min(first + FACTOR, uniforms.size);
    const float anchor = guide_of(first);
    precise float sum = 0.0;
    for (int i = 0; i < FACTOR * FACTOR; ++i) {
        const ivec2 p = first + ivec2(i % FACTOR, i / FACTOR);
        if (all(lessThan(p, end))) sum += guide_of(p) - anchor;
    }
    const ivec2 count = end - first;
    precise const float mean = anchor + sum / float(count.x * count.y);
    imageStore(small_guide, low, vec4(mean, 0.0, 0.0, 0.0));
}
#endif

void main() {
    const ivec2 at = group_at();
    const ivec2 local = ivec2(gl_LocalInvocationID.xy);
    vec2 range = vec2(uniforms.max_radius_px, 0.0);
    const ivec2 last = uniforms.size - 1;
    for (int y = 0; y < kBlockPx; y += 2) {
        // One beyond the border is taken for the last, which changes no extreme.
        const ivec2 p = min(kBlockPx * at + local + ivec2(0, y), last);
        const float radius = radius_px(depth_at(p));
        imageStore(coc, p, vec4(radius, 0.0, 0.0, 0.0));
        range = vec2(min(range.x, abs(radius)), max(range.y, abs(radius)));
    }
#if defined(GUIDE_DEPTH) || defined(GUIDE_RADIUS)
    const int boxes = kBlockPx / FACTOR;  // along each side of the block
    for (int i = int(gl_LocalInvocationIndex); i < boxes * boxes; i += kThreads) {
        const ivec2 low = boxes * at + ivec2(i % boxes, i / boxes);
        if (all(lessThan(low, uniforms.low_size))) store_guide(low);
    }
#endif
#ifdef SORT
    ranges[gl_LocalInvocationIndex] = range;
    barrier();
    if (gl_LocalInvocationIndex != 0) return;
    for (int i = 1; i < kThreads; ++i)
        range = vec2(min(range.x, ranges[i].x), max(range.y, ranges[i].y));
    const bool sharp = range.y <= kSharpRadiusPx;
    imageStore(blurs, at, vec4(sharp ? 0.0 : 1.0));
    if (sharp) {
        ADD_TO_WORK_LIST(sharp_blocks, at);
    } else if (range.x * kStored >= uniforms.full_blur_px) {
        ADD_TO_WORK_LIST(blurred_blocks, at);
    } else {
        ADD_TO_WORK_LIST(mixed_blocks, at);
    }
#endif
}
