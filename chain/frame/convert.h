// Conversion to the canonical frame: any depth encoding and motion convention -> the planes of
// chain/frame/role.h, with bounds and faults found on the way, in one walk over the pixels.
// Tables of encodings and conventions: docs/frame.md.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "chain/base/image.h"
#include "chain/base/status.h"
#include "chain/frame/frame.h"

namespace postchain {

enum class DepthEncoding {
    linear,            // distance along the view axis, scene units; <= 0 or non-finite = far
    inverse,           // already 1/d
    forward,           // GL window depth or D3D forward z in 0..1, needs near and far
    forward_infinite,  // (1 - z)/n, needs near
    reverse,           // reverse-Z with near and far
    reverse_infinite,  // z/n, needs near
    ray_distance,      // distance along the pixel's ray, needs focal length and sensor width
};
inline const std::vector<std::string>& depth_encoding_names() {
    static const std::vector<std::string> names = {
        "linear",  "inverse",          "forward",     "forward_infinite",
        "reverse", "reverse_infinite", "ray_distance"};
    return names;
}

enum class MotionUnit {
    pixels,
    fraction,  // of the display window's width and height (uv, or ndc with scale 0.5)
};

// canonical = scale * (stored - bias), times the display's size if the unit is a fraction. The sign
// of each scale turns direction and axis into the canonical ones (+x right, +y down, this frame to
// the next).
struct MotionConvention {
    MotionUnit unit = MotionUnit::pixels;
    double scale_x = 1;
    double scale_y = 1;
    double bias = 0;
    double sentinel = std::numeric_limits<double>::infinity();  // |stored| >= this: 0, counted
};

// NaN -> 0 always; Inf, and values that passes cannot average (shaders/shared/color_limits.h) -> 0
// or the largest half of their sign
enum class NonfiniteColor { zero, clamp };

struct ConvertOptions {
    DepthEncoding depth = DepthEncoding::linear;
    MotionConvention motion;
    MotionConvention motion_back;
    bool unpremultiplied = false;  // color must be multiplied by its alpha
    NonfiniteColor nonfinite_color = NonfiniteColor::clamp;
};

// The color that passes read if a frame was not converted, in their references.
ImageD finite_color(ImageD color);

// Converts `planes` in place: color (4 channels), inverse_depth (1, still encoded depth), motion
// and motion_back (2, still in the file's convention). Other planes, a neighbor's among them, are
// already canonical and stay as they are. Fills frame.width, height, planes, bounds. frame.camera,
// display size, pixel aspect, origin, frame_number and bounds.camera_cut are read. Errors: chain
// (near = 0 with a buffer encoding, a camera value missing), input (sizes that differ, channel
// counts).
Result<InputHealth> convert_frame(FramePlanes& planes, FrameDescription& frame,
                                  const ConvertOptions& options);

}  // namespace postchain
