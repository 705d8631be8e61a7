// camera.json: lens, shutter and clip planes of a sequence. Format: docs/chain_file.md.
//
// Precedence: defaults < metadata of the image file < --camera < the chain's camera < a pass's own
// value < --set. The first three steps are frame_camera() below; make_plan() (chain/pass/planner.h)
// applies the chain's camera, into which parse_chain() has put --set.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "chain/frame/frame.h"
#include "chain/frame/origin.h"
#include "config/diagnostic.h"

namespace postchain {

// Side of the image that the sensor size spans.
enum class SensorFit { horizontal, vertical, larger_side };  // larger_side is written "auto"

// The image to which a sensor size applies.
struct Display {
    int width = 0;  // display window, pixels
    int height = 0;
    double pixel_aspect = 1;  // pixel width / pixel height
};

// Sensor width in millimeters across the image, from a sensor size that spans the side `fit`.
double horizontal_sensor_width_mm(double sensor_mm, SensorFit fit, const Display& display);

// Camera to world, rows: the camera looks along its -z, +x is right and +y up.
using Rotation = std::array<std::array<double, 3>, 3>;
// Removes the scale of the columns. Returns why they are no axes; empty: they are.
std::string without_scale(Rotation& rotation);

struct CameraFile {
    std::string file_name;
    Camera camera;                        // sensor_width_mm as given, for the side sensor_fit
    std::optional<SensorFit> sensor_fit;  // horizontal if not given
    std::optional<double> fps;
    std::optional<std::array<int, 2>> resolution;  // width, height
    Origins origins;                               // where each value of `camera` is given
    struct Frame {
        Camera camera;
        std::optional<SensorFit> sensor_fit;
        Origins origins;
    };
    std::map<int, Frame> frames;                  // overrides of single frames
    std::map<int, Rotation> rotations;            // from `camera_matrix_world`, by frame
    std::map<int, std::array<double, 3>> places;  // camera positions, scene units; as rotations
    uint64_t text_hash = 0;
    Diagnostics diagnostics;

    Status status() const { return status_of(diagnostics); }
    bool zooms() const;  // states focal lengths frame by frame
    // One frame's values, with sensor_width_mm converted to horizontal. Frames without overrides
    // have the top-level values.
    Camera camera_for(int frame, const Display& display) const;
    // The places of one frame's values, by key.
    Origins origins_for(int frame) const;
    // A warning if `resolution` is given and differs from the display window's size.
    std::optional<Diagnostic> check_resolution(const Display& display) const;
};

// Errors are StatusCode::input.
CameraFile parse_camera(std::string_view text, const std::string& file_name);
// Reads and parses a file. Errors: StatusCode::input.
Result<CameraFile> load_camera(const std::string& path);

// Makes the path of an aperture image that has not been read absolute. Relative paths start at the
// folder of `file_name`, or at the current folder if it is empty.
void resolve_files(Camera& camera, const std::string& file_name);

// FrameDescription::camera of a frame: metadata overlaid by the camera file (nullptr = none).
Camera frame_camera(const Camera& metadata, const CameraFile* file, int frame,
                    const Display& display);

}  // namespace postchain
