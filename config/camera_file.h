// camera.json: lens, shutter and clip planes of a sequence. Format: docs/chain_file.md.
//
// Precedence: defaults < metadata of the image file < --camera < the chain's camera < a pass's own
// value < --set. The first three steps are frame_camera() below; make_plan() (chain/planner.h)
// lays the chain's camera over it, and parse_chain() has applied --set to the chain.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "chain/frame.h"
#include "chain/origin.h"
#include "config/diagnostic.h"

namespace postchain {

// Which side of the picture the sensor size spans.
enum class SensorFit { horizontal, vertical, larger_side };  // larger_side is written "auto"

// The picture a sensor size is applied to.
struct Display {
    int width = 0;  // of the display window, pixels
    int height = 0;
    double pixel_aspect = 1;  // width of a pixel / its height
};

// Millimeters across the picture's width, of a sensor size that spans the side named by `fit`.
double horizontal_sensor_width_mm(double sensor_mm, SensorFit fit, const Display& display);

// Camera to world, rows: the camera looks along its -z, +x is right and +y up.
using Rotation = std::array<std::array<double, 3>, 3>;

struct CameraFile {
    std::string file_name;
    Camera camera;                        // sensor_width_mm as stated, for the side of sensor_fit
    std::optional<SensorFit> sensor_fit;  // horizontal when not stated
    std::optional<double> fps;
    std::optional<std::array<int, 2>> resolution;  // width, height
    Origins origins;                               // of the values of `camera`
    struct Frame {
        Camera camera;
        std::optional<SensorFit> sensor_fit;
        Origins origins;
    };
    std::map<int, Frame> frames;                  // overrides of single frames
    std::map<int, Rotation> rotations;            // of `camera_matrix_world`, by frame
    std::map<int, std::array<double, 3>> places;  // of it too, scene units; of rows of four
    uint64_t text_hash = 0;                       // of the whole text
    Diagnostics diagnostics;

    Status status() const { return status_of(diagnostics); }
    // Values for one frame with sensor_width_mm turned into the horizontal one. A frame without
    // overrides takes the top-level values.
    Camera camera_for(int frame, const Display& display) const;
    // Where its values stand, by key.
    Origins origins_for(int frame) const;
    // A warning when `resolution` is given and is not the display window's size, else nothing.
    std::optional<Diagnostic> check_resolution(const Display& display) const;
};

// Errors are StatusCode::input.
CameraFile parse_camera(std::string_view text, const std::string& file_name);
// Reads the file first; StatusCode::input when it cannot be read.
Result<CameraFile> load_camera(const std::string& path);

// Makes the path of the aperture's picture absolute, unless it is read already. A relative one is
// from the folder of the text that names it, or from the current one if `file_name` is empty.
void resolve_files(Camera& camera, const std::string& file_name);

// FrameDescription::camera of a frame: metadata overlaid by the camera file (nullptr = none).
Camera frame_camera(const Camera& metadata, const CameraFile* file, int frame,
                    const Display& display);

}  // namespace postchain
