// The guarantees of a pass about its results. The suites that run for every pass
// (tests/conformance, tests/elision, `postchain stress`, temporal stability) know no pass: they
// read its guarantees and test them. Properties that are not guaranteed are not tested.
#pragma once

#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/frame/role.h"

namespace postchain {

// Filter and transformation commute: flip swaps top and bottom, turn is a quarter turn, shift a
// move by whole lattices. On average; a shift bit for bit.
enum class Symmetry { mirror, flip, turn, shift };

// Limits of quiet planes: no half-velocity above half a pixel, with the shutter open for a frame;
// no contrast above 1 % of the color.
inline constexpr double kQuietSpeedPx = 0.5;
inline constexpr double kQuietContrast = 0.01;

// How the light of a bright dot changes under one depth and one motion.
enum class Light {
    any,
    not_more,  // some may be lost
    kept,
};

// With the parameters of the pass; the sides of the frame are multiples of the lattice.
struct Guarantees {
    // One color comes back bit for bit, whatever the other planes, if the color's storage holds it.
    bool keeps_constants = false;
    // Each channel stays within its range in the input, but for this part of its largest |value|,
    // for rounding.
    std::optional<double> convex;
    // Edge of the grid that the result is tied to, in pixels. 1: none. 0: the result depends on the
    // place in the frame.
    int lattice_px = 0;
    std::set<Symmetry> symmetries;
    Light light = Light::any;
    // Planes that drive it: if all of them are quiet, every pixel returns bit for bit. Quiet means
    // motion up to kQuietSpeedPx and a hint of such motion, depth in focus (no radius above 0.5
    // px), color with contrast up to kQuietContrast. Empty: it always acts.
    RoleSet driven_by;

    // The guarantees of two passes, one after the other.
    Guarantees then(const Guarantees& next) const;
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

// Settings with which a pass guarantees more than with its defaults: suites that test a guarantee
// take the first variant that gives it.
struct PassVariant {
    std::string name;  // "without jitter"
    std::vector<std::pair<std::string, ParameterValue>> settings;
};

}  // namespace postchain
