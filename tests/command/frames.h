// Writes small frames with depth and motion vectors in each renderer's convention, and reads them
// back.
#pragma once

#include <string>
#include <vector>

#include "chain/base/image.h"
#include "tests/io/exr_files.h"
#include "tools/sequence/exr/planes_writer.h"

namespace postchain::test {

// Canonical motion, depth as distance: a bright square at distance 2 before a ground at distance 6.
// The square moves by (6, 3) pixels to the next frame and came by (5, 2) from the previous one, the
// ground by (-2, 1) and (-3, 1.5).
struct Planes {
    ImageF color;   // RGBA, alpha 1
    ImageF depth;   // distance along the view axis
    ImageF motion;  // to the next frame, pixels, y down
    ImageF back;    // from the previous frame
};
// The square moves with `frame`, so that frames differ.
Planes make_planes(int width, int height, int frame = 1);

struct FrameFile {
    std::string convention = "cycles";  // or nuke, arnold, vray, generic
    io::PixelType color_type = io::PixelType::float32;
    io::PixelType depth_type = io::PixelType::float32;
    bool depth = true;
    bool motion = true;
    bool object_ids = false;                    // one more channel, unused: "id", uint
    std::map<std::string, ImageF> mattes = {};  // extra channels by name
    int origin_x = 0, origin_y = 0;
    std::optional<io::Window> display = {};
    std::map<std::string, io::AttributeValue> attributes = {};
    io::ExrMethod method = io::ExrMethod::zip;
};
// Channel names, signs and encodings as in config/profiles/<convention>.yaml.
void write_frame(const std::string& path, const Planes& planes, const FrameFile& file = {});

// A sequence DIR/in.####.exr of `size` in which the square moves.
void write_sequence(const std::string& folder, const std::vector<int>& frames, int width = 48,
                    int height = 32, const FrameFile& file = {});

// Channels R, G and B of 32-bit floats.
void write_rgb(const std::string& path, const ImageF& rgb);

// Color of a file with any channel names; the test fails if there is none.
ImageF read_color(const std::string& path);
// Stored bytes of every non-color channel of the first part.
std::map<std::string, std::string> other_channels(const std::string& path);

// A chain with its own camera, so that frames need none.
inline const char* kAllPasses =
    "postchain: 1\n"
    "camera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, focus_distance: 2,"
    " meters_per_unit: 0.05, shutter_frames: 0.5}\n"
    "passes:\n"
    "  - motion_blur: {mode: guertin, samples: 9}\n"
    "  - fxaa: {hint: threshold}\n"
    "  - depth_of_field: {method: gilham, downsample: 2}\n";
inline const char* kReversed =
    "postchain: 1\n"
    "camera: {focal_length_mm: 50, sensor_width_mm: 36, f_stop: 1.4, focus_distance: 2,"
    " meters_per_unit: 0.05, shutter_frames: 0.5}\n"
    "passes:\n"
    "  - depth_of_field: {method: gilham, downsample: 2}\n"
    "  - fxaa\n"
    "  - motion_blur: {mode: guertin, samples: 9}\n";
inline const char* kFxaa = "postchain: 1\npasses: [fxaa]\n";
inline const char* kMotionBlur =
    "postchain: 1\npasses: [motion_blur: {mode: guertin, samples: 5, shutter_frames: 0.5}]\n";

double largest_difference(const ImageF& a, const ImageF& b);  // inf if sizes differ

std::vector<std::string> temporaries(const std::string& folder);

}  // namespace postchain::test
