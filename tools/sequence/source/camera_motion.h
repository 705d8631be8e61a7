// Motion vectors made from the camera. Renderers write no vectors for sky, although it moves when
// the camera turns, and some write none at all. For static surfaces, vectors follow from depth and
// the camera's positions and rotations; for the infinitely far sky, from the rotations.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "chain/frame/frame.h"
#include "config/camera_file.h"
#include "tools/sequence/planes/camera_metadata.h"

namespace postchain::sequence {

// Which motion vectors are made from the camera.
enum class CameraMotion {
    none,
    missing,  // all if the file has none; with a camera file, those of the sky and the zoom that
              // Cycles leaves out too
    sky,      // also those of the sky, from the matrices in the frames' metadata
    zoom,     // like sky; also adds the zoom to the vectors of any renderer
    all,      // every one, replacing the file's
};

struct SkyView {
    Rotation to_world;
    double focal_px = 0;                            // along x
    std::optional<std::array<double, 3>> position;  // scene units; not needed for sky
};

struct SkyViews {
    SkyView now, before, after;
    double pixel_aspect = 1;
    // If false, that view is extrapolated from the other side.
    bool knows_before = true, knows_after = true;

    bool turns() const;  // or zooms: the sky moves in the image
    bool have_positions() const { return now.position && before.position && after.position; }
    std::string text() const;  // all values
};

// Focal lengths of the frames before and after, divided by that of this frame.
struct Zoom {
    double before = 1, after = 1;
};

// Camera of a frame's file; empty if it states none.
using MetadataOf = std::function<std::optional<io::CameraMetadata>(int frame)>;

// Views from the matrices of a camera file, otherwise of the frames' metadata. If one neighbor has
// none or a cut lies between, the camera's motion is extrapolated from the other side. Empty if
// both sides lack a view or a focal length is unknown.
std::optional<SkyViews> sky_views(const CameraFile* file, const MetadataOf& metadata_of, int frame,
                                  const Display& display, const std::set<int>& cuts);

// Zoom of a camera file that states focal lengths frame by frame; empty if it has none at this
// frame. If one side is unknown or beyond a cut, the zoom is extrapolated from the other side.
std::optional<Zoom> zoom_of(const CameraFile& file, const Camera& metadata, int frame,
                            const Display& display, const std::set<int>& cuts);

// Sets all motion vectors of a canonical frame for which `views` have the positions, clear pixels'
// too, and the bounds of the speeds. A vector to a frame whose camera has the surface behind it is
// (0, 0), or that of the other side if the frame is unknown. Returns the number of pixels with a
// vector set on either side.
uint64_t set_camera_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame);

// Replaces zero motion vectors of infinitely far (is_infinitely_far()), non-clear pixels of a
// canonical frame, and raises the bounds of the speeds. Returns the number of pixels replaced.
uint64_t fill_sky_motion(const SkyViews& views, FramePlanes& planes, FrameDescription& frame);

// Adds a zoom to motion vectors in which the focal length stays that of the frame, and sets the
// bounds of the speeds. With `keep_sky`, pixels that fill_sky_motion() would replace keep their
// zero vectors. Returns the number of pixels changed.
uint64_t add_zoom_motion(const Zoom& zoom, bool keep_sky, FramePlanes& planes,
                         FrameDescription& frame);

// Number of sky pixels without motion, of surface pixels, and of moving surface pixels.
struct SkyCounts {
    uint64_t sky = 0, surfaces = 0, moving = 0;
    // Pixels that fill_sky_motion() would replace if nearly everything else moves; otherwise 0.
    uint64_t without_motion() const;
};
SkyCounts count_sky(const FramePlanes& planes);

}  // namespace postchain::sequence
