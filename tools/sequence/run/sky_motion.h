// Vectors of the sky. Renderers that have no surface there write none, though it moves through the
// picture when the camera turns. It is infinitely far, so its vectors follow from the rotations of
// the camera alone.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "chain/frame.h"
#include "config/camera_file.h"

namespace postchain::sequence {

// How a camera sees what is infinitely far.
struct SkyView {
    Rotation to_world;
    double focal_px = 0;  // along x
};

// Of a frame, the one before and the one after.
struct SkyViews {
    SkyView now, before, after;
    double pixel_aspect = 1;

    std::string text() const;  // every number
};

// From the matrices of a camera file; `metadata` is that of the frame's own file. Where the frame
// before or after has none, or a cut lies between, the camera is taken to turn on evenly. Nothing
// where that is so on both sides, where a focal length is unknown, or where the camera stands
// still.
std::optional<SkyViews> sky_views(const CameraFile& file, const Camera& metadata, int frame,
                                  const Display& display, const std::set<int>& cuts);

// Replaces vectors of (0, 0) where a canonical frame is infinitely far (is_infinitely_far())
// and not clear, and raises the bounds of the speeds. Returns how many pixels it replaced.
uint64_t fill_sky_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame);

// Pixels of the sky without motion, of surfaces, and of surfaces that move.
struct SkyCounts {
    uint64_t sky = 0, surfaces = 0, moving = 0;
    void add(const SkyCounts& more);
    // Pixels that fill_sky_motion() would replace, where nearly all that is not the sky moves; else
    // 0.
    uint64_t without_motion() const;
};
SkyCounts count_sky(const FramePlanes& planes);

}  // namespace postchain::sequence
