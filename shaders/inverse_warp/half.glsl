// The place of a pixel's surface in a texture of two halves: the frame before and the one after, if both
// are searched; this frame and the layer behind. After surface.glsl.
ivec2 in_half(ivec2 p) {
    return p + uniforms.second_half * second_half();
}
