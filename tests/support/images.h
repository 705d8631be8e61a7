// Images for tests, and comparisons that say where two differ.
#pragma once

#include <cstdint>
#include <string>

#include "chain/base/image.h"
#include "chain/frame/frame.h"

namespace postchain::test {

// Uniform noise in [low, high), the same for the same seed.
ImageF noise_image(int width, int height, int channels, uint32_t seed, float low = 0,
                   float high = 1);

// Channel c of the pixel at x, y is f(x, y, c).
template <class F>
ImageF make_image(int width, int height, int channels, const F& f) {
    ImageF image(width, height, channels);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) image.at(x, y, c) = float(f(x, y, c));
    return image;
}

inline ImageF constant_image(int width, int height, std::initializer_list<float> pixel) {
    return make_image(width, height, int(pixel.size()),
                      [&](int, int, int c) { return pixel.begin()[c]; });
}

// Smooth waves of unrelated lengths with hard-edged bars over them, in 0..1: detail without the
// exact ties that noise has (on noise, FXAA's two edge scores are often the same sum).
ImageF textured_image(int width, int height, int channels, uint32_t seed);

// A small canonical frame: textured color with alpha 1, two depth layers (near square on far
// ground), the square moving by `square_motion` and the ground by `ground_motion` pixels.
struct TestFrame {
    FrameDescription description;  // bounds filled, camera of a 50 mm lens at f/2, focus on ground
    FramePlanes planes;            // color, inverse_depth, motion
};
TestFrame layered_frame(int width, int height, std::array<float, 2> square_motion,
                        std::array<float, 2> ground_motion, uint32_t seed = 1);
// Adds the planes of both neighbors: two other frames of the kind.
void add_neighbors(TestFrame& frame);

// Adds a layer behind that moves too, with a corner of which nothing is known; before add_lights().
void add_behind(TestFrame& frame);
// Splits color into `count` lights, whose shares vary from pixel to pixel. One light is brighter
// than color and the last is negative there; their sum is color up to rounding. Replaces the
// frame's layers, and does the same to its neighbors and its layer behind if it has them.
void add_lights(TestFrame& frame, int count);
// Size, planes and bounds of hand-made canonical planes.
FrameDescription describe(const FramePlanes& planes);
// A lens with round numbers: f_px = 640, A = 0.1, s = 4, so R = 32 (1/4 - w) px. By default
// max_radius_px is 3 % of 640 = 19.2 px (gilham), whatever the size of the planes. The shutter is
// open for half a frame.
Camera round_camera();
// A frame of these planes seen by round_camera(), on a display of 640 x 360 px.
FrameDescription describe_round(const FramePlanes& planes);

struct Difference {
    double max = 0;       // largest |a-b| / max(1, |b|)
    double fraction = 0;  // pixels with a channel above `tolerance`
    int x = -1, y = -1;   // of the largest
    std::string text;     // for failure messages
};
template <class A, class B>
Difference compare(const Image<A>& a, const Image<B>& b, double tolerance);

extern template Difference compare(const ImageF&, const ImageF&, double);
extern template Difference compare(const ImageF&, const ImageD&, double);
extern template Difference compare(const ImageD&, const ImageD&, double);

bool equal_bits(const ImageF& a, const ImageF& b);  // NaN equals the same NaN

}  // namespace postchain::test
