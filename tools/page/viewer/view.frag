#version 300 es
// Part of a picture, or its error map, at one scale. Tone curves are those of tone.js; a
// pixel has the same color as on the CPU (cpu_view.js) to one step of 8 bits.
precision highp float;
precision highp int;

uniform highp sampler2D picture;  // linear RGB
uniform highp sampler2D error;    // an error map, places 0..1 on its scale
uniform highp sampler2D magma;    // 256 x 1
uniform highp sampler2D other;    // linear RGB, left of `split`

uniform vec2 canvas;      // device pixels
uniform vec2 size;        // frame size in image pixels; a texture may be smaller
uniform float split;      // device pixels; 0: none
uniform vec2 center;      // picture pixel at the center of the canvas
uniform float scale;      // device pixels per picture pixel
uniform float gain;       // 2^EV
uniform int tone;
uniform bool map;         // the error map, not the picture
uniform vec3 background;
uniform bool grid;
uniform int n;            // taps a side of a device pixel (taps_of of cpu_view.js)

out vec4 color;

vec3 srgb(vec3 v) {
    return mix(1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, 12.92 * v,
               lessThanEqual(v, vec3(0.0031308)));
}

vec3 shown(vec3 v) {
    vec3 x = min(max(v, 0.0) * gain, 1e30);
    if (tone == 0) return pow(x / (1.0 + x), vec3(1.0 / 2.2));
    if (tone == 1) {
        x = 0.6 * min(x, 1e6);
        return srgb(clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0));
    }
    return srgb(clamp(x, 0.0, 1.0));
}

ivec2 texel(vec2 at, ivec2 texels) {
    return clamp(ivec2(floor(at * vec2(texels) / size)), ivec2(0), texels - 1);
}

vec3 pixel(vec2 at, bool left) {
    if (!map) {
        vec3 v = left ? texelFetch(other, texel(at, textureSize(other, 0)), 0).rgb
                      : texelFetch(picture, texel(at, textureSize(picture, 0)), 0).rgb;
        // NaN is magenta.
        return any(isnan(v)) ? vec3(1.0, 0.0, 1.0) : shown(v);
    }
    float place = texelFetch(error, texel(at, textureSize(error, 0)), 0).r;
    return texelFetch(magma, ivec2(int(round(255.0 * place)), 0), 0).rgb;
}

void main() {
    vec2 device = vec2(gl_FragCoord.x, canvas.y - gl_FragCoord.y);
    vec2 at = (device - 0.5 * canvas) / scale + center;
    color = vec4(background, 1.0);
    if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, size))) return;

    // The mean of the image over the footprint of a device pixel.
    vec3 sum = vec3(0.0);
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            vec2 offset = ((vec2(x, y) + 0.5) / float(n) - 0.5) / scale;
            sum += pixel(at + offset, device.x < split);
        }
    color.rgb = sum / float(n * n);

    if (grid) {
        vec2 inside = fract(at) * scale;
        if (min(inside.x, inside.y) < 1.0) {
            float light = dot(color.rgb, vec3(0.3, 0.6, 0.1));
            color.rgb = mix(color.rgb, vec3(light > 0.45 ? 0.0 : 1.0), 0.22);
        }
    }
}
