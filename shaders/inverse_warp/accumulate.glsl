// The sums over a pixel's samples.
//
// DENOISE: samples of blurred surfaces are also summed apart, for denoise.comp
// HINT: and their brightness, for the hint

// The surface that a sample sees, and where its color comes from.
struct Hit {
    Source source;
    float inverse_depth;
    vec2 path;  // a
    vec2 at;    // where this frame shows or hides it, px
};

// Samples of surfaces whose displacements spread by more than uniforms.soft_spread.
struct Soft {
    Mean color;
    vec3 spread;  // sum of covariances of the displacements: xx, xy, yy, px^2
};

struct Sums {
    Mean color;
    float moment;  // of the displacements, px^2
    float longest_path;  // squared, px^2
    Soft soft;
    vec3 shown;  // brightness as shown: of the first sample; sums of differences to it, and of squares
};

// Variance along x and y, px^2: a larger one changes no window, and its determinant would be lost
// in rounding.
const float kMaxSpread = 65536.0;

Sums no_samples() {
    return Sums(no_mean(), 0.0, 0.0, Soft(no_mean(), vec3(0.0)), vec3(0.0));
}

// Covariance of a surface's displacements: of a disc, and of a straight line.
vec3 covariance_of(float inverse_depth, vec2 path) {
    precise vec3 covariance = vec3(0.0);
    const float radius = radius_px(inverse_depth);
    const vec2 axes = radius * vec2(uniforms.pixel_axis_x, uniforms.pixel_axis_y);
    if (kLens) covariance.xz += 0.25 * axes * axes;
    if (kShutter) {
        precise const vec2 moved = uniforms.time_scale * path;
        covariance += moved.xxy * moved.xyy / 3.0;
    }
    return covariance;
}

// True if the sample is also summed apart.
bool add_soft(precise inout Soft soft, Hit hit, vec4 color, float weight) {
    const vec3 covariance = covariance_of(hit.inverse_depth, hit.path);
    precise const float variance = covariance.x + covariance.z;
    if (variance < uniforms.soft_spread) return false;
    add(soft.color, color, weight);
    soft.spread += weight * (covariance * min(kMaxSpread / variance, 1.0));
    return true;
}

// From 0 to 1: of displays that show x/(1 + x), less the last of their gamma.
float shown_brightness(vec3 color) {
    const vec3 parts = max(color, vec3(0.0));
    precise const float light = (parts.r + parts.g + parts.b) / 3.0;
    precise const float part = light / (1.0 + light);
    return sqrt(part);
}

void accumulate(precise inout Sums sums, Pixel pixel, Sample now, Hit hit) {
    const vec4 color = color_from(hit.source, kColor);
    const vec2 moved_px = hit.at - pixel.p;
    add(sums.color, color, now.weight);
    sums.moment += now.weight * precise_dot(moved_px, moved_px);
    if (kShutter) sums.longest_path = max(sums.longest_path, precise_dot(hit.path, hit.path));
#if HINT
    const float brightness = shown_brightness(color.rgb);
    if (sums.color.weight == now.weight) sums.shown.x = brightness;  // the first
    precise const float more = brightness - sums.shown.x;
    sums.shown.yz += now.weight * vec2(more, more * more);
#endif
    bool soft = false;
    if (DENOISE == 1) soft = add_soft(sums.soft, hit, color, now.weight);
    keep_tap(hit.source, now.weight, soft);
}
