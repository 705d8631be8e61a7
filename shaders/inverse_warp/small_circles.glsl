// Pixels with a small circle of confusion that one still surface fills. A few samples of such a circle
// would leave noise, which denoising would spread too far, and bilinear ones add blur. There the circle is
// summed, with a weight for each pixel around (shared/small_circles.h).
//
// uniforms.disc_scale is 0 if the aperture is not round: not a constant, because pixels may have another
// aspect in each frame.
#if LENS
#include "common/software_loop.glsl"
#include "shared/small_circles.h"

struct Circle {
    float radius;  // px, of the surface
    int row;       // of the weights; a part of the next one
    float part;
    int reach;     // px
    float least_weight;
};

Circle circle_of(float radius) {
    precise const float r = abs(radius) * uniforms.disc_scale;
    const int row = min(int(r * (1.0 / SMALL_CIRCLES_STEP)), SMALL_CIRCLES_RADII - 2);
    precise const float least = SMALL_CIRCLES_STEP * float(row), most = least + SMALL_CIRCLES_STEP;
    // Between the rows by their variance.
    precise const float part = (r * r - least * least) / (most * most - least * least);
    return Circle(radius, row, part, min(int(ceil(most)) + 2, SMALL_CIRCLES_REACH_PX), -1.0);
}

float weight_in_table(int i) {
    return uniforms.circle_weights[i >> 2][i & 3];
}

float weight_of(Circle circle, ivec2 away) {
    const ivec2 a = abs(away);
    const int x = max(a.x, a.y), y = min(a.x, a.y), place = x * (x + 1) / 2 + y;
    const int first = circle.row * SMALL_CIRCLES_PLACES + place;
    const float weight = precise_mix(weight_in_table(first),
                                     weight_in_table(first + SMALL_CIRCLES_PLACES), circle.part);
    return max(weight, circle.least_weight);
}

// Does surface s stay in place, with the circle's radius and away from edges?
bool fills(Surface s, Circle circle) {
    const bool moves = kShutter && path_of(s) > kFilledStillPx;
    precise const float apart_px = abs(s.radius - circle.radius);
    return !s.edge && !moves && apart_px <= kOneRadiusPx;
}

// The pixels around, row by row. False after the last one.
bool next_away(Circle circle, inout ivec2 away) {
    away.x += 1;
    if (away.x > circle.reach) away = ivec2(-circle.reach, away.y + 1);
    return away.y <= circle.reach;
}

// Is the circle of the pixel small, and do the pixels around show one still surface?
bool is_filled_by_one(Pixel pixel, Circle circle) {
    precise const float largest = SMALL_CIRCLES_STEP * float(SMALL_CIRCLES_RADII - 1);
    bool filled =
        uniforms.disc_scale > 0.0 && pixel.start_count == 1 &&
        abs(circle.radius) * uniforms.disc_scale <= largest;
    ivec2 away = ivec2(-circle.reach);
    if (filled) SOFTWARE_LOOP do {
        const ivec2 at = ivec2(inside_of(vec2(pixel.at + away)));
        filled = fills(unpack_surface(texelFetch(surfaces, at, 0)), circle);
    } while (next_away(circle, away) && filled);
    return filled;
}

// Sum over the pixels around. By differences to the pixel's own color, so that equal colors keep their bits.
// `least`, `most`: of those that the circle reaches.
vec4 sum_of_circle(Pixel pixel, Circle circle, Plane plane, out vec4 least, out vec4 most) {
    const vec4 own = fetch(WIDE(color, layers), plane, pixel.at);
    precise const float radius = abs(circle.radius) + 1.0, reach_px2 = radius * radius;
    precise vec4 sum = vec4(0.0);
    precise float total = 0.0;
    least = own;
    most = own;
    ivec2 away = ivec2(-circle.reach);
    SOFTWARE_LOOP do {
        const ivec2 at = ivec2(inside_of(vec2(pixel.at + away)));
        const vec4 texel = fetch(WIDE(color, layers), plane, at);
        const float weight = weight_of(circle, away);
        sum += weight * (texel - own);
        total += weight;
        const bool reached = float(away.x * away.x + away.y * away.y) <= reach_px2;
        least = reached ? min(least, texel) : least;
        most = reached ? max(most, texel) : most;
    } while (next_away(circle, away));
    precise const vec4 mean = own + sum / total;
    return mean;
}

// Layers have the weights of color: none is negative if those lead beyond the colors that the circle
// reaches, as beside a lamp.
void store_circle(Pixel pixel, Circle circle) {
    // From 0 at the limit to 1 at half more.
    const float limit_px = max(uniforms.still_limit_px, 1e-6);
    precise const float onset = clamp(2.0 * (abs(circle.radius) / limit_px - 1.0), 0.0, 1.0);
    if (onset == 0.0) {
        imageStore(blurred, pixel.at, fetch(WIDE(color, layers), kColor, pixel.at));
        store_unchanged_layers(pixel);
        return;
    }
    vec4 least, most;
    vec4 mean = sum_of_circle(pixel, circle, kColor, least, most);
    if (any(lessThan(mean, least)) || any(greaterThan(mean, most))) {
        circle.least_weight = 0.0;
        mean = sum_of_circle(pixel, circle, kColor, least, most);
    }
    imageStore(blurred, pixel.at,
               faded_in(fetch(WIDE(color, layers), kColor, pixel.at), mean, onset));
#ifdef LAYERS
    for (int l = 0; l < textureSize(layers, 0).z; ++l) {
        const Plane plane = Plane(false, l);
        mean = sum_of_circle(pixel, circle, plane, least, most);
        imageStore(layers_blurred, ivec3(pixel.at, l),
                   faded_in(fetch(WIDE(color, layers), plane, pixel.at), mean, onset));
    }
#endif
}
#else
struct Circle {
    float radius;
};
Circle circle_of(float radius) {
    return Circle(radius);
}
bool is_filled_by_one(Pixel pixel, Circle circle) {
    return false;
}
void store_circle(Pixel pixel, Circle circle) {}
#endif
