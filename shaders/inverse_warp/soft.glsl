// Samples of surfaces whose displacements spread by more than uniforms.soft_spread.
struct Soft {
    vec4 sum;     // of differences to the pixel's own color
    float weight;
    vec3 spread;  // sum of covariances of the displacements: xx, xy, yy, px^2
};

// Variance along x and y, px^2: more changes no window, and its determinant would be lost in
// rounding.
const float kMostSpread = 65536.0;

// Does the sample count? path: of the surface on one side of the frame, a
bool add_soft(inout Soft soft, vec4 difference, float inverse_depth, vec2 path, float weight) {
    vec3 covariance = vec3(0.0);
#if LENS
    const float radius = radius_px(inverse_depth);
    covariance.xz += 0.25 * radius * radius;  // of a disc
#endif
#if SHUTTER
    covariance += path.xxy * path.xyy / 3.0;  // of a straight line
#endif
    const float variance = covariance.x + covariance.z;
    if (variance < uniforms.soft_spread || !is_finite(difference)) return false;
    covariance *= min(kMostSpread / variance, 1.0);
    soft.sum += weight * difference;
    soft.weight += weight;
    soft.spread += weight * covariance;
    return true;
}
