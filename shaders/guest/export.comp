#version 450 core
// Writes the chain's color to a host's texture, in its row order without the gain. Values
// beyond the range of its format are the ends of that range.
#include "guest/place.glsl"

layout(binding = 0) uniform sampler2D color;
layout(binding = 0) writeonly uniform image2D host_output;

void main() {
    const ivec2 p = invocation_at();
    if (any(greaterThanEqual(p, uniforms.size))) return;
    vec4 c = texelFetch(color, p, 0);
    c.rgb /= gain();
    c = clamp(c, -uniforms.output_max, uniforms.output_max);
    imageStore(host_output, stored_at(p, uniforms.output_at), c);
}
