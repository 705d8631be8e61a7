// Color of a surface between pixels.

const float kSharpening = 2.0;  // of bilinear weights about their middle: half the added blur

// Where the bilinear filter has the weights of the place `at`, pixels.
vec2 sampled_at(vec2 at) {
    const vec2 base = floor(at);
    const vec2 f = clamp(kSharpening * (at - base - 0.5) + 0.5, 0.0, 1.0);
    return (base + f + 0.5) / vec2(uniforms.size);
}

// Color of the surface that is seen at `at`, pixels.
vec4 color_at(sampler2D plane, vec2 at) {
    const vec4 c = textureLod(plane, sampled_at(at), 0.0);
    // A weight of 0 times what is not finite is NaN: then the nearest pixel alone counts.
    return is_finite(c) ? c : texelFetch(plane, ivec2(at + 0.5), 0);
}

#ifdef LAYERS
// The same of layers. They are finite where color is not, too: color's pixel alone counts there.
void layers_at(sampler2D plane, sampler2DArray planes, vec2 at, out vec4 seen[LAYERS]) {
    const vec2 place = sampled_at(at);
    const bool mixed = is_finite(textureLod(plane, place, 0.0));
    FOR_LAYERS(l)
        seen[l] = mixed ? textureLod(planes, vec3(place, float(LAYERS_FIRST + l)), 0.0)
                        : LAYER_FETCH(planes, ivec2(at + 0.5), l);
}
#endif

vec2 inside_of(vec2 at) {
    return clamp(at, vec2(0.0), vec2(uniforms.size - 1));
}
