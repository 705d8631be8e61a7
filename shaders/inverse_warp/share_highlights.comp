#version 450 core
// Highlights out of focus are met by few of a pixel's samples: their light is shared with the pixels
// around, in proportion to how much of each is out of focus, so that it keeps off what is in focus,
// and as far as the difference to them is no more than the noise of so many samples. The result stays
// within the range of those pixels.
//
//   gathered, excess (of it rgb: bright light out of focus; a: share of samples out of focus),
//   excess_squares (mean over the samples of the square of its largest component) -> color
//
// LIST: only the blocks of a work list
#include "common/finite.glsl"
#include "common/work_list.glsl"
#include "shared/inverse_warp_block.h"

layout(binding = 0) uniform sampler2D gathered;
layout(binding = 1) uniform sampler2D excess;
layout(binding = 2) uniform sampler2D excess_squares;
layout(binding = 0) writeonly uniform image2D shared_light;

float largest(vec3 c) {
    return max(c.r, max(c.g, c.b));
}

void main() {
    ivec2 p;
    if (!next_pixel(block.size, p)) return;
    const vec4 own = texelFetch(gathered, p, 0);
    const vec4 own_excess = texelFetch(excess, p, 0);
    if (own_excess.a == 0.0 || !is_finite(own)) {
        imageStore(shared_light, p, own);
        return;
    }
    const float own_largest = largest(own_excess.rgb);
    const float own_squares = texelFetch(excess_squares, p, 0).x;
    vec4 sum = vec4(0.0);
    vec3 least = own.rgb, most = own.rgb;
    bool any_bright = false;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            const ivec2 at = clamp(p + ivec2(x, y), ivec2(0), block.size - 1);
            const vec4 bright = texelFetch(excess, at, 0);
            const vec4 around = texelFetch(gathered, at, 0);
            if (bright.a == 0.0) continue;
            const float light = largest(bright.rgb);
            const float squares = texelFetch(excess_squares, at, 0).x;
            const float mean = 0.5 * (light + own_largest);
            const float variance =
                max(0.5 * (squares + own_squares) - mean * mean, 0.0) / float(block.samples);
            // Up to so many variances of a mean of random samples all of it is noise, from twice as
            // many nothing.
            const float off = (light - own_largest) * (light - own_largest);
            sum += mix(own_excess, bright, clamp(2.0 - off / max(block.noise_variances * variance, 1e-30), 0.0, 1.0));
            any_bright = any_bright || bright.rgb != vec3(0.0);
            if (!is_finite(around)) continue;
            least = min(least, around.rgb);
            most = max(most, around.rgb);
        }
    }
    vec4 color = own;
    // Where nothing is bright every bit stays.
    if (any_bright)
        color.rgb = clamp(own.rgb - own_excess.rgb + own_excess.a / sum.a * sum.rgb, least, most);
    imageStore(shared_light, p, color);
}
