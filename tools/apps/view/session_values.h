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

// The value that a row takes if it is not set, and its source: "the camera", "default".
struct Inherited {
    ParameterValue value;
    std::string from;
};
// For a row of a pass. Empty: only the filter knows, for example a part of the frame's width.
std::optional<Inherited> inherited(const Session& session, size_t link, const Parameter& row);
// For a row of the chain's camera. Empty: nothing states it.
std::optional<Inherited> inherited_by_camera(const Session& session, const Parameter& row);
// The value to begin with when a row is set: the inherited one, otherwise one of its range.
ParameterValue first_value(const Parameter& row, const std::optional<Inherited>& inherited);

// The number of which `value` is the nearest float, with the fewest digits: 0.941, where a
// conversion gives 0.9409999847412109.
double shortest_double(float value);

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
