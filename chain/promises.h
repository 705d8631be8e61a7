// What a pass promises of its results. The suites that run for every pass (tests/conformance,
// tests/elision, `postchain stress`, temporal stability) ask the promises, hold the pass to them,
// and know no pass. Where nothing is promised nothing is demanded.
#pragma once

#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "chain/parameter.h"
#include "chain/role.h"

namespace postchain {

// Filter and transformation may change places: flip is top for bottom, turn a quarter turn, shift a
// move by whole lattices. In the mean; a shift bit for bit.
enum class Symmetry { mirror, flip, turn, shift };

// The measure of quiet planes: nothing moves by more than half a pixel (half-velocities, with the
// shutter open for a frame); no contrast is above 1 % of the color.
inline constexpr double kQuietSpeedPx = 0.5;
inline constexpr double kQuietContrast = 0.01;

// What becomes of the light of a bright dot under one depth and one motion.
enum class Light {
    any,
    not_more,  // some may be lost
    kept,
};

// With the parameters that the pass has; sides of the picture are multiples of the lattice.
struct Promises {
    // One color comes back bit for bit, whatever the other planes, if the color's storage holds it.
    bool keeps_constants = false;
    // Each channel stays within the range that it has in the input; beyond it by at most this part
    // of its largest |value|, for rounding.
    std::optional<double> convex;
    // Edge of the grid that the result is tied to, in pixels. 1: none. 0: the place in the picture.
    int lattice_px = 0;
    std::set<Symmetry> symmetries;
    Light light = Light::any;
    // Planes that make it do something: where all of them are quiet every pixel returns bit for
    // bit. Quiet is motion up to kQuietSpeedPx and a hint of such motion, depth that the camera has
    // in focus (no radius above 0.5 px), color up to kQuietContrast. Empty: it always acts.
    RoleSet driven_by;

    // The promises of two passes, one after the other.
    Promises then(const Promises& next) const;
};

// Distances in pixels, along x or y.
struct Reach {
    static constexpr double kUnbounded = std::numeric_limits<double>::infinity();
    double depends_px = kUnbounded;  // farthest pixel whose change can change a pixel
    double spreads_px = kUnbounded;  // farthest pixel to which a pixel's color goes

    Reach then(const Reach& next) const {
        return {depends_px + next.depends_px, spreads_px + next.spreads_px};
    }
};

// Settings under which a pass promises more than it does as it is set: suites that check a promise
// take the first variant that gives it.
struct PassVariant {
    std::string name;  // "without jitter"
    std::vector<std::pair<std::string, ParameterValue>> settings;
};

}  // namespace postchain
