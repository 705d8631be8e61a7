// The camera in a file's metadata: the one table of the attributes that are read, and what those of
// a file give. docs/camera_metadata.md is made from the same table.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "chain/frame.h"
#include "chain/origin.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io {

// Row vectors, as Imath has them: a point of the world is multiplied from the left.
using Matrix4 = std::array<std::array<double, 4>, 4>;

// Where a camera stands and looks, as a file's metadata say it: camera to world, rows; the camera
// looks along its -z, +x is right and +y up.
struct CameraPose {
    std::array<std::array<double, 3>, 3> to_world = {};
    std::array<double, 3> place = {};    // scene units
    std::optional<double> focal_widths;  // focal length over the width of the picture
};

struct CameraAttribute {
    const char* name;    // as it stands in the header
    const char* writer;  // whose it is
    const char* unit;    // of what stands there
    const char* gives;   // a row of the camera, "camera matrix"; empty: known, and not used
    const char* how;     // from the one to the other, or why not
    const char* source;  // where this is documented
};
// In the order in which they are asked: of two that give the same value the first counts.
std::span<const CameraAttribute> camera_attributes();
// The same as a table in Markdown.
std::string camera_attributes_as_markdown();

// An attribute of the table that a file has.
struct FoundAttribute {
    const CameraAttribute* row = nullptr;
    std::string text;   // its value
    std::string gives;  // "focal_length_mm = 50"; empty: not used
    std::string why;    // not used
};

struct CameraMetadata {
    Camera camera;
    Origins origins;  // of its values: the attribute's name
    std::optional<CameraPose> pose;
    std::vector<FoundAttribute> found;  // in the order of the table
};

// Of the part that has the color. A value that is no number, not positive, or contradicts another
// is not used; `found` says why.
CameraMetadata camera_metadata(const ExrPart& part);

}  // namespace postchain::io
