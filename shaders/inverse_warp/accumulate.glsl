// The sums over a pixel's samples, as differences to its own color: one color stays to the bit.
//
// FILL_LAYER: which of the frame's layers is the fill mask (chain/layers.h)
// DENOISE: samples of blurred surfaces are also summed apart, for denoise.comp
// ADAPTIVE: and two halves of the samples, for adaptive.glsl

// A sample's color, and the surface that it sees.
struct Seen {
    WideColor color;
    float inverse_depth;
    vec2 path;  // a
    vec2 at;    // where this frame shows or hides it, px
};

// Samples of surfaces whose displacements spread by more than uniforms.soft_spread.
struct Soft {
    WideColor color;
    float weight;
    vec3 spread;  // sum of covariances of the displacements: xx, xy, yy, px^2
};

// Half of a pixel's samples.
struct Half {
    vec3 color;
    float weight;
};

struct Sums {
    WideColor color;
    float weight;
    float moment;  // of the displacements, px^2
    Soft soft;
    Half halves[2];
};

// Variance along x and y, px^2: a larger one changes no window, and its determinant would be lost
// in rounding.
const float kMaxSpread = 65536.0;

Sums no_samples() {
    const Half none = Half(vec3(0.0), 0.0);
    return Sums(no_color(), 0.0, 0.0, Soft(no_color(), 0.0, vec3(0.0)), Half[2](none, none));
}

// Covariance of a surface's displacements: of a disc, and of a straight line.
vec3 covariance_of(float inverse_depth, vec2 path) {
    precise vec3 covariance = vec3(0.0);
    const float radius = radius_px(inverse_depth);
    const vec2 axes = radius * vec2(uniforms.pixel_axis_x, uniforms.pixel_axis_y);
    if (kLens) covariance.xz += 0.25 * axes * axes;
    if (kShutter) covariance += path.xxy * path.xyy / 3.0;
    return covariance;
}

// Channels of the fill mask.
const vec4 kFromNeighbor = vec4(0.0, 1.0, 0.0, 0.0), kEstimated = vec4(0.0, 0.0, 1.0, 0.0);

// A sample's color whose fill mask says that all of it comes from `source`.
WideColor from(vec4 source, WideColor color) {
#ifdef FILL_LAYER
    FOR_LAYERS(l)
        if (LAYERS_FIRST + l == FILL_LAYER)
            color.planes[1 + l] = dot(color.planes[1 + l].rgb, vec3(1.0)) * source;
#endif
    return color;
}

// The color of a surface that a frame shows. This frame's keeps its shares: an earlier pass may have
// filled it.
WideColor shown_color(Found found) {
    const WideColor color = color_of(found);
    if (found.frame != 0) return from(kFromNeighbor, color);
    if (found.beyond) return from(kEstimated, color);
    return color;
}

void add_soft(precise inout Soft soft, Seen seen, WideColor difference, float weight) {
    const vec3 covariance = covariance_of(seen.inverse_depth, seen.path);
    precise const float variance = covariance.x + covariance.z;
    if (variance < uniforms.soft_spread) return;
    soft.color = plus(soft.color, weight, difference);
    soft.weight += weight;
    soft.spread += weight * (covariance * min(kMaxSpread / variance, 1.0));
}

// The samples whose number has an odd count of binary digits 1 are one half. Both halves are even
// over the shutter, whose times go by mirrored digits, and over the lens, whose samples go outward
// (Thue-Morse).
void add_to_half(precise inout Half halves[2], int number, vec3 difference, float weight) {
    const bool odd = (bitCount(number) & 1) == 1;
    halves[0].color += odd ? vec3(0.0) : weight * difference;
    halves[1].color += odd ? weight * difference : vec3(0.0);
    halves[0].weight += odd ? 0.0 : weight;
    halves[1].weight += odd ? weight : 0.0;
}

void accumulate(precise inout Sums sums, Pixel pixel, Sample now, Seen seen) {
    const WideColor difference = minus(seen.color, pixel.color);
    const vec2 moved_px = seen.at - pixel.p;
    sums.color = plus(sums.color, now.weight, difference);
    sums.weight += now.weight;
    sums.moment += now.weight * dot(moved_px, moved_px);
    if (ADAPTIVE == 1) add_to_half(sums.halves, now.number, difference.planes[0].rgb, now.weight);
    if (DENOISE == 1) add_soft(sums.soft, seen, difference, now.weight);
}
