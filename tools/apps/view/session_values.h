// Values of a session: under the cursor, of the lens, and the focus by mouse.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/apps/view/session.h"

namespace postchain::view {

// The values of each plane at a pixel of the frame: "depth", "2.5".
std::vector<std::pair<std::string, std::string>> values_at(const Session& session, int x, int y);
// Planes of the frame that a view can show.
std::vector<std::string> planes_of(const Session& session);
// The camera that the chain works with on this frame.
Camera camera_of(const Session& session);

// The distance at a pixel of the frame; empty: unknown, or the sky.
std::optional<double> distance_at(const Session& session, int x, int y);
// Errors (input): no depth, or the sky.
Status focus_at_pixel(Session& session, int x, int y);
// Keys at the first and the last frame, with the distances at two pixels of this one. Errors
// (input): one frame, no distance.
Status focus_pull(Session& session, std::array<int, 2> from, std::array<int, 2> to);
// Limits of sharpness, scene units, as the chain's lens has them; empty: no pass with a lens.
std::optional<std::array<double, 2>> sharp_limits(const Session& session);
// Positions of the surface at a pixel while the shutter is open, pixels of the frame; empty: no
// motion vectors.
std::vector<std::array<double, 2>> motion_path(const Session& session, int x, int y);

// Writes the camera file with the focus of every frame. Errors: no keys, those of new_file().
// With `replace` the session's own camera file may be replaced.
Status save_camera(Session& session, const std::string& path, bool replace);

}  // namespace postchain::view
