// Scenes of flat surfaces that move along rows, with exact light. Frames are those of a renderer:
// color of a pixel's whole area, motion vectors averaged over it, depth of one random place in it.
#pragma once

#include <array>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/support/images.h"

namespace postchain::test::exact {

constexpr double kFar = 1e6;  // px, beyond any picture
constexpr double kWavePx = 4;
constexpr double kWave = 2 * std::numbers::pi / kWavePx;
constexpr int kWidth = 157;

struct Span {
    double begin, end;  // px
};
using Spans = std::function<std::vector<Span>(double y)>;
// Displacement along rows since time 0, px; time in frames.
using Path = std::function<double(double time)>;

Path steady(double px_per_frame);

struct Surface {
    Spans spans;  // at time 0, in the row at y
    double gray;
    double inverse_depth;
    Path path = steady(0);
    double wave = 0;  // amplitude of a sine along rows with a period of kWavePx
};

struct Scene {
    std::vector<Surface> surfaces;  // from front to back; the last fills the picture
    bool lens = false;              // round_camera(), otherwise a pinhole
    bool behind = false;            // with the layer behind in place of both neighbors
    bool alone = false;             // without motion, neighbors and the layer behind
    bool round = false;             // rows of a pixel differ
    // Inverse depth that is in focus at this time; while the shutter is open it does not change.
    Path focus = [](double) { return 0.25; };
    int height = 67;
};

std::vector<Span> everywhere(double y);
Spans bar(double begin, double end, double top = -kFar, double bottom = kFar);
Spans fence(double first, double width, double period);
Spans discs(const std::vector<std::array<double, 2>>& centers, double radius);

// Radius of the circle of confusion of round_camera(), px.
double radius_of(const Scene& scene, const Surface& surface, double time = 0);

// A row of pixels: light and the share of each surface.
struct Row {
    explicit Row(size_t surfaces) : light(kWidth), shares(surfaces, light) {}
    std::vector<double> light;
    std::vector<std::vector<double>> shares;
};
// The light of row y at this time through a pinhole. depth: 1 shows the first surface behind.
Row row_at(const Scene& scene, int y, double time, int depth = 0);

// The frame at this time with both neighbors or the layer behind, or neither.
FramePlanes frames_of(const Scene& scene, double time = 0);
FrameDescription description_of(const Scene& scene, const FramePlanes& planes, double time = 0);
// Mean of the pixels of row y while the shutter is open around this time, for half a frame. A lens
// only blurs what is the same in all rows, so that it acts along rows alone.
std::vector<double> truth_of(const Scene& scene, int y, double time = 0);
// All rows, RGB.
ImageF truth_image(const Scene& scene, double time);

}  // namespace postchain::test::exact
