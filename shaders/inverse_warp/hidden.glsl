// Surfaces that this frame hides, as candidates for start surfaces.

// How differently a surface is displaced from those that this frame shows in the block that hides it,
// px^2. 0 if one of them moves alike, whose search finds it, or if none is farther.
float apart_from(Surface shown[3], Surface hidden) {
    float least = 3.0e38, far = 3.0e38;
    for (int k = 0; k < 3; ++k) {
        const float px2 = apart(hidden, shown[k]);
        precise const float alike =
            kOneMotionPx * kOneMotionPx + kOneMotion * kOneMotion * displaced(shown[k]);
        least = px2 > alike ? min(least, px2) : 0.0;
        far = min(far, shown[k].inverse_depth);
    }
    precise const float nearest_hidden = kOneDepth * far;
    return hidden.inverse_depth > nearest_hidden ? least : 0.0;
}
