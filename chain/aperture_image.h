// The picture of an aperture: how much light passes at each point of it.
//
// A table of transmittances over the square [-1, 1]^2 around the circle of confusion, in its radii,
// rows from the top, as it is seen in a highlight behind the focus; one before it shows it turned
// by half a turn. The lens ends at the circle: what the corners of the square hold does not count.
// Described in docs/depth_of_field.md, "Aperture".
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain {

// A value: copies share one table, which never changes.
class ApertureImage {
  public:
    static constexpr int kSide = 128;

    ApertureImage() = default;  // no picture
    // A picture that is named and has not been read yet (tools/sequence/image/aperture_file.h).
    explicit ApertureImage(std::string file) : file_(std::move(file)) {}
    // Of kSide x kSide linear transmittances >= 0, row after row from the top left; their scale
    // does not matter. `file`: where they are from, if from a file. Errors (input): another number
    // of values, one that is negative or not finite (its column and row from 0), no light inside
    // the circle.
    static Result<ApertureImage> make(std::vector<float> values, std::string file = {});

    // Is there a picture, read or not?
    explicit operator bool() const { return light_ || !file_.empty(); }
    bool is_read() const { return light_ != nullptr; }
    const std::string& file() const { return file_; }

    // These need a picture that is read.
    uint64_t hash() const;  // of the values
    // Row after row from the top left.
    const std::vector<float>& values() const;
    // The inverse of the light's distribution, by angle and then by radius: the share `turn`,
    // without its whole part, of the light passes between the right and the direction of this
    // point, clockwise, and of what passes in that direction the share `within`, 0..1, nearer to
    // the middle. In radii, within the unit circle, x to the right, y down.
    std::array<double, 2> point(double within, double turn) const;

    // Of read pictures the values decide, else the names.
    bool operator==(const ApertureImage& other) const;

  private:
    struct Light {
        std::vector<float> values;
        uint64_t hash = 0;
        std::vector<double> turned;  // share of the light up to equal steps of the angle
        // Of what passes in each step, the share up to the end of each ring.
        std::vector<std::vector<float>> within;
    };
    std::string file_;
    std::shared_ptr<const Light> light_;
};

}  // namespace postchain
