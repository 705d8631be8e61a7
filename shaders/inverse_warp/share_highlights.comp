#version 450 core
// Highlights out of focus are met by few of a pixel's samples: their light is shared with the pixels
// around, in proportion to how much of each is out of focus, so that it keeps off what is in focus.
// The result stays within the range of those pixels.
//
//   gathered, excess (of it rgb: bright light out of focus; a: share of samples out of focus) -> color
//
// LIST: only the blocks of a work list
#include "common/finite.glsl"
#include "common/work_list.glsl"
#include "shared/inverse_warp_block.h"

layout(binding = 0) uniform sampler2D gathered;
layout(binding = 1) uniform sampler2D excess;
layout(binding = 0) writeonly uniform image2D shared_light;

void main() {
    ivec2 p;
    if (!next_pixel(block.size, p)) return;
    const vec4 own = texelFetch(gathered, p, 0);
    const vec4 own_excess = texelFetch(excess, p, 0);
    vec4 sum = vec4(0.0);
    vec3 least = own.rgb, most = own.rgb;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            const ivec2 at = clamp(p + ivec2(x, y), ivec2(0), block.size - 1);
            const vec4 bright = texelFetch(excess, at, 0);
            const vec4 around = texelFetch(gathered, at, 0);
            sum += bright;
            if (bright.a == 0.0 || !is_finite(around)) continue;
            least = min(least, around.rgb);
            most = max(most, around.rgb);
        }
    }
    vec4 color = own;
    // Where nothing is bright every bit stays.
    if (own_excess.a > 0.0 && is_finite(own) && any(notEqual(sum.rgb, vec3(0.0))))
        color.rgb = clamp(own.rgb - own_excess.rgb + own_excess.a / sum.a * sum.rgb, least, most);
    imageStore(shared_light, p, color);
}
