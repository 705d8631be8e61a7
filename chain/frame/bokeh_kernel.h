// An image of an aperture: its transmittance at each point.
//
// A table of transmittances over the square [-1, 1]^2 around the circle of confusion, in its radii,
// rows from the top, as seen in a highlight behind the focus; a highlight before the focus shows it
// turned by half a turn. The lens ends at the circle: values in the corners of the square are
// ignored. Described in docs/depth_of_field.md, "Aperture".
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain {

// A value: copies share one table, which never changes.
class BokehKernel {
  public:
    static constexpr int kSide = 128;

    BokehKernel() = default;  // no image
    // An image that is named and has not been read yet (tools/sequence/image/bokeh_kernel_file.h).
    explicit BokehKernel(std::string file) : file_(std::move(file)) {}
    // From kSide x kSide linear transmittances >= 0, row after row from the top left; their scale
    // does not matter. `file`: the file they were read from, if any. Errors (input): another number
    // of values, a negative or non-finite value (its column and row from 0), no light inside the
    // circle.
    static Result<BokehKernel> make(std::vector<float> values, std::string file = {});

    // True if there is an image, read or not.
    explicit operator bool() const { return light_ || !file_.empty(); }
    bool is_read() const { return light_ != nullptr; }
    const std::string& file() const { return file_; }

    // These need an image that is read.
    uint64_t hash() const;  // hash of the values
    // Row after row from the top left.
    const std::vector<float>& values() const;
    // The inverse of the light's distribution, by angle and then by radius: a part `turn` of the
    // light (its fraction) passes between the right and the direction of this point, clockwise, and
    // a part `within` (0..1) of the light in that direction passes nearer to the center. In radii,
    // within the unit circle, x to the right, y down.
    std::array<double, 2> point(double within, double turn) const;

    // Compares loaded images by value, others by name.
    bool operator==(const BokehKernel& other) const;

  private:
    struct Distribution {
        std::vector<float> values;
        uint64_t hash = 0;
        std::vector<double> turned;  // share of the light up to equal steps of the angle
        // For each step of the angle, the share of its light up to the end of each ring.
        std::vector<std::vector<float>> within;
    };
    std::string file_;
    std::shared_ptr<const Distribution> light_;
};

}  // namespace postchain
