// An engine's frame: all planes, both neighbors, a lens and a shutter, and no known facts.
#pragma once

#include "chain/frame.h"
#include "chain/role.h"

namespace postchain::bench {

inline FrameDescription engine_frame(int width, int height) {
    FrameDescription frame;
    frame.width = frame.display_width = width;
    frame.height = frame.display_height = height;
    frame.planes = {Role::color, Role::inverse_depth, Role::motion, Role::motion_back};
    for (const Neighbor neighbor : kNeighbors)
        for (const Role role : kNeighborRoles) frame.planes.add(role_of(neighbor, role));
    frame.camera.focal_length_mm = 50;
    frame.camera.sensor_width_mm = 36;
    frame.camera.f_stop = 2;
    frame.camera.focus_distance = 4;
    frame.camera.shutter_frames = 0.5;
    frame.camera.meters_per_unit = 1;
    return frame;
}

}  // namespace postchain::bench
