// 1 - alpha, between 0 and 1.
float transparency(vec4 stored) {
    precise const float part = 1.0 - clamp(stored.a, 0.0, 1.0);
    return part;
}
