// Whether the vectors of a frame follow from the camera, before a pixel is read.
#pragma once

#include "tools/sequence/run/frame_source.h"

namespace postchain::sequence {

// Sets `sky`, `makes_motion` and `looked_for_cameras` of a header whose roles and camera are known,
// as SourceSettings::camera_motion says. Where a matrix is there and gives no vectors, the reason
// joins the names that were looked for, or, with vectors in the file and CameraMotion::all, the
// warnings.
void find_camera_motion(const SourceSettings& settings, const io::CameraMetadata& metadata,
                        int frame, const Display& display, FrameHeader& header);

}  // namespace postchain::sequence
