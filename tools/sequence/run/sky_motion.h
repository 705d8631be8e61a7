// Vectors that follow from the camera. Renderers that have no surface in the sky write none there,
// though it moves through the picture when the camera turns; some write none at all. Of what stands
// still in the world they follow from its depth and from where the camera stood and looked, of the
// sky, which is infinitely far, from the camera's rotations alone.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "chain/frame.h"
#include "config/camera_file.h"
#include "tools/sequence/frame/camera_metadata.h"

namespace postchain::sequence {

// Which vectors are made from the camera.
enum class CameraMotion {
    none,
    missing,  // all where the file has no channel of them; those of the sky by a camera file
    sky,      // besides, those of the sky by the matrices of the frames' metadata
    all,      // every one, in place of the file's
};

// How a camera sees.
struct SkyView {
    Rotation to_world;
    double focal_px = 0;                         // along x
    std::optional<std::array<double, 3>> place;  // scene units; not needed for the sky
};

// Of a frame, the one before and the one after.
struct SkyViews {
    SkyView now, before, after;
    double pixel_aspect = 1;
    bool from_metadata = false;  // else from the camera file
    // Else that view is `now`, moved on evenly from the other side.
    bool knows_before = true, knows_after = true;

    bool turns() const;  // or zooms: the sky moves through the picture
    bool have_places() const { return now.place && before.place && after.place; }
    std::string text() const;  // every number
};

// What the file of a frame says of its camera, nothing where there is none.
using MetadataOf = std::function<std::optional<io::CameraMetadata>(int frame)>;

// From the matrices of a camera file, else from those of the frames' metadata. Where the frame
// before or after has none, or a cut lies between, the camera is taken to move on evenly. Nothing
// where that is so on both sides, or where a focal length is unknown.
std::optional<SkyViews> sky_views(const CameraFile* file, const MetadataOf& metadata_of, int frame,
                                  const Display& display, const std::set<int>& cuts);

// Sets every vector of a canonical frame of which `views` have the places, clear pixels' too, and
// the bounds of the speeds. Each side by itself: the vector to a frame that has the pixel's surface
// behind its camera is (0, 0), and where no such frame is known it is that of the other side.
// Returns how many pixels it set, of either side.
uint64_t set_camera_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame);

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
