// The extra layers of a pixel. Each sample's source and weight are kept as a tap, and after color
// every layer is summed over the taps: the search runs once, however many layers there are. A layer
// that is 0 wherever the pixel's taps read is 0, and is not summed: `occupied` has a bit for each
// layer that is not (occupied.comp).
//
// TAPS: room for a pixel's samples
// DENOISE: soft taps are also summed apart, and `reached` gets a bit for each layer that is summed
#ifdef LAYERS
#include "inverse_warp/layer_bits.glsl"

layout(binding = GATHER_LAYERS_BLURRED_IMAGE) writeonly uniform image2DArray layers_blurred;
#if DENOISE
layout(binding = GATHER_LAYERS_SOFT_IMAGE) writeonly uniform image2DArray layers_soft;
layout(binding = GATHER_REACHED_IMAGE) writeonly uniform uimage2DArray reached;
#endif
layout(binding = GATHER_OCCUPIED_IMAGE, r32ui) readonly uniform uimage2DArray occupied;

struct Tap {
    Source source;
    float weight;
    bool soft;
};

// From the front: taps that this frame shows, which are most of them. From the back: all others,
// which read more.
// Global, because a compiler copies an array at each call that takes it.
Tap taps[TAPS];
int shown_taps = 0, other_taps = TAPS;

void keep_tap(Source source, float weight, bool soft) {
    const int k = source.kind == 0 ? shown_taps++ : --other_taps;
    taps[k] = Tap(source, weight, soft);
}

uint occupied_in(int frame, ivec2 block, int word) {
    const int place = frame == 0 ? 0 : (frame < 0 ? 1 : 1 + BEFORE);
    const ivec2 at = clamp(block, ivec2(0), uniforms.blocks - 1);
    return imageLoad(occupied, ivec3(at, place * words_of(layers) + word)).x;
}

// The layers that are not 0 where a source reads.
uint occupied_at(Source source, int word) {
    if (source.kind == kSecondLayer) return 0xffffffffu;
    if (source.kind == kContinuation)
        return occupied_in(0, unpack_cell(source.cells.x) / 8, word) |
               occupied_in(0, unpack_cell(source.cells.y) / 8, word);
    if (source.kind != kFill)
        return occupied_in(source.kind, ivec2(source.at) / kBlockPx, word);
    // The cells of 16 px around are blocks, and hold all smaller cells that the fill reads.
    precise const vec2 place = floor((source.at + 0.5) / float(kBlockPx) - 0.5);
    const ivec2 base = ivec2(place);
    return occupied_in(0, base, word) | occupied_in(0, base + ivec2(1, 0), word) |
           occupied_in(0, base + ivec2(0, 1), word) | occupied_in(0, base + ivec2(1, 1), word) |
           occupied_in(0, unpack_cell(source.cells.y) / kBlockPx, word);
}

uint occupied_at_taps(Pixel pixel, int word) {
    uint bits = occupied_in(0, pixel.block, word) |
                occupied_in(0, ivec2(beside(pixel.p, front_in(pixel.own))) / kBlockPx, word) |
                occupied_in(0, ivec2(beside(pixel.p, place_in(pixel.own))) / kBlockPx, word);
    for (int k = 0; k < shown_taps; ++k)
        bits |= occupied_in(0, ivec2(taps[k].source.at) / kBlockPx, word);
    for (int k = other_taps; k < TAPS; ++k) bits |= occupied_at(taps[k].source, word);
    return bits;
}

void store_layer(ivec2 at, int layer, vec4 mean, vec4 soft_mean) {
    imageStore(layers_blurred, ivec3(at, layer), mean);
#if DENOISE
    imageStore(layers_soft, ivec3(at, layer), soft_mean);
#endif
}

struct LayerSums {
    Mean all, soft;
};

void add_tap(precise inout LayerSums sums, Tap tap, int layer, vec4 of_tap) {
    const vec4 value = with_fill(tap.source, layer, of_tap);
    add(sums.all, value, tap.weight);
    if (tap.soft) add(sums.soft, value, tap.weight);
}

void sum_layer(Pixel pixel, int layer, float onset) {
    const Plane plane = Plane(false, layer);
    const vec4 own = fetch(WIDE(color, layers), plane, pixel.at);
    LayerSums sums = LayerSums(no_mean(), no_mean());
    for (int k = 0; k < shown_taps; ++k)
        add_tap(sums, taps[k], layer, color_in(0, taps[k].source.at, plane));
    for (int k = other_taps; k < TAPS; ++k)
        add_tap(sums, taps[k], layer, color_from(taps[k].source, plane));
    const vec4 mean = with_front_over(pixel, plane, value_of(sums.all, own));
    store_layer(pixel.at, layer, faded_in(own, mean, onset), value_of(sums.soft, own));
}

void store_layers(Pixel pixel, float onset) {
    for (int word = 0; word < words_of(layers); ++word) {
        const uint all = bits_of_word(layers, word);
        uint bits = occupied_at_taps(pixel, word) & all;
#if DENOISE
        imageStore(reached, ivec3(pixel.at, word), uvec4(bits));
#endif
        uint empty = all & ~bits;
        while (empty != 0u)
            store_layer(pixel.at, next_layer(empty, word), vec4(0.0), vec4(0.0));
        while (bits != 0u)
            sum_layer(pixel, next_layer(bits, word), onset);
    }
}

void store_unchanged_layers(Pixel pixel) {
    for (int l = 0; l < textureSize(layers, 0).z; ++l)
        imageStore(layers_blurred, ivec3(pixel.at, l), texelFetch(layers, ivec3(pixel.at, l), 0));
}
#else
void keep_tap(Source source, float weight, bool soft) {}
void store_layers(Pixel pixel, float onset) {}
void store_unchanged_layers(Pixel pixel) {}
#endif
