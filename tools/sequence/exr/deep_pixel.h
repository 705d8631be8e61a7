// The samples of one deep pixel, composited front to back.
//
//   samples --sort by depth--> over; where volumes overlap, their light is mixed by density
//           --the sample at which half of the pixel's opacity is reached--> its surface
//           --the samples behind that surface--> the layer behind, with a surface of its own
//
// Source: "Interpreting OpenEXR Deep Pixels" and "The Theory of OpenEXR Deep Samples"
// (openexr.com): color is premultiplied, and a volume of opacity a has the optical depth -ln(1 -
// a), spread evenly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace postchain::io {

// Distances from the camera. A surface has front == back.
struct DeepSample {
    float front = 0;
    float back = 0;
    float alpha = 1;
    uint32_t index = 0;  // in the file
};

// A surface is the sample at which half of the opacity is reached, with the samples behind it whose
// gap is at most this fraction of their distance, until it is opaque.
inline constexpr double kDeepGap = 0.05;
inline constexpr double kDeepClear = 1.0 / 256;  // transmits less: opaque

class DeepPixel {
  public:
    // Room for the pixel's samples. The caller fills them.
    std::vector<DeepSample>& samples() { return samples_; }

    // Composites all samples, or those behind the pixel's surface. If the surface hides nothing in
    // the file, that is the surface itself, or nothing if it is not opaque. Depths that are NaN
    // count as infinite, alpha counts as 0 to 1, NaN as 0. Sorts samples().
    void composite(bool behind);

    // Factors of the samples' premultiplied values, by index in the file.
    double weight(size_t index) const { return weights_[index]; }
    // The pixel's alpha, 0 to 1.
    double alpha() const;
    size_t size() const { return samples_.size(); }
    // The only sample with a weight, if that is 1.
    std::optional<size_t> shown_alone() const;
    // The sample with the pixel's depth, by index in the file; -1 if there is none.
    int64_t surface() const { return surface_; }

  private:
    void weigh(size_t first, size_t end);
    void weigh_overlapping(size_t first, size_t end);
    size_t find_surface(size_t first, size_t end) const;

    // The light that reaches the camera from a depth.
    struct Ray {
        double at = 0;       // depth
        double through = 1;  // transmitted to it
        // Integral of `through` over depth: a volume's share is the difference of two values.
        double shown = 0;
        double density = 0;  // optical depth per unit of depth, of all volumes at this depth
        size_t volumes = 0;
    };
    static void advance(Ray& ray, double to);
    void begin_volume(Ray& ray, size_t i);
    void end_volume(Ray& ray, size_t i);
    // All surfaces at the depth of the event `first`. Returns the first event behind them.
    size_t pass_points(Ray& ray, size_t first);

    std::vector<DeepSample> samples_;
    std::vector<double> weights_;
    int64_t surface_ = -1;

    struct Event {
        double at;
        int kind;
        uint32_t sample;
    };
    std::vector<Event> events_;
    std::vector<double> shown_;  // Ray::shown at the front of each sample
};

}  // namespace postchain::io
