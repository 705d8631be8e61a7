// Built-in functions that sum products, written out: a compiler may fuse the products of a built-in
// one even in a `precise` expression, and in one variant of a program only.

float precise_dot(vec2 a, vec2 b) {
    precise const float sum = a.x * b.x + a.y * b.y;
    return sum;
}

float precise_dot(vec3 a, vec3 b) {
    precise const float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

float precise_dot(vec4 a, vec4 b) {
    precise const float sum = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
    return sum;
}

float precise_length(vec2 v) {
    return sqrt(precise_dot(v, v));
}

vec2 precise_normalize(vec2 v) {
    return v * inversesqrt(precise_dot(v, v));
}

// Exactly a for t = 0, b for t = 1.
float precise_mix(float a, float b, float t) {
    precise const float mean = a * (1.0 - t) + b * t;
    return mean;
}

vec2 precise_mix(vec2 a, vec2 b, float t) {
    precise const vec2 mean = a * (1.0 - t) + b * t;
    return mean;
}

vec4 precise_mix(vec4 a, vec4 b, vec4 t) {
    precise const vec4 mean = a * (1.0 - t) + b * t;
    return mean;
}
