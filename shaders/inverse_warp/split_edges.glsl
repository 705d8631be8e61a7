// The pixels at depth edges that may mix two surfaces: those of a lamp's edge show the lamp
// (shown_surfaces.comp).
layout(binding = 2) uniform usampler2D marks;
layout(binding = 3) uniform usampler2D shown;

// A word of `mixed`, beside a place (mixture.glsl).
const uint kTakes = 32u;  // the pixel takes the surface there, not the color
const uint kMixed = 64u;
const uint kHolds = 128u;  // the pixel takes the surface there, and another stays in front: its place and part follow
const int kFrontShift = 8, kPartsShift = 13;

void list_edges() {
    begin_list();
    int k = int(gl_LocalInvocationIndex);
    SOFTWARE_LOOP do {
        const ivec2 square = square_of(k);
        uint edges = 0u;
        if (is_square(square))
            edges = texelFetch(marks, square, 0).x & 0xffffu &
                    ~texelFetch(shown, square * ivec2(2, 1), 0).x;
        add_to_list(k, edges);
    } while ((k += kThreads) < kSquares);
    barrier();
}
