// Decides from headers whether a frame's motion vectors are made from the camera.
#pragma once

#include "tools/sequence/source/frame_source.h"

namespace postchain::sequence {

// Sets `sky`, `sky_is_still`, `makes_motion` and `looked_for_cameras` of a header whose roles and
// camera are known, according to SourceSettings::camera_motion. If a matrix exists but gives no
// vectors, the reason is added to the names that were looked for, or, if the file has vectors and
// CameraMotion::all was asked for, to the warnings.
void find_camera_motion(const SourceSettings& settings, const io::CameraMetadata& metadata,
                        int frame, const Display& display, FrameHeader& header);

}  // namespace postchain::sequence
