// The camera in a file's metadata: the table of known attributes, and the camera that a file's
// attributes give. docs/profiles.md is generated from the table.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "chain/frame/origin.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io {

// Position and orientation of a camera in a file's metadata: camera to world, rows. The camera
// looks along -z; +x is right and +y up.
struct CameraPose {
    std::array<std::array<double, 3>, 3> to_world = {};
    std::array<double, 3> position = {};  // scene units
    std::optional<double> focal_widths;   // focal length / image width
};

struct CameraAttribute {
    const char* name;    // name in the header
    const char* writer;  // program that writes it
    const char* unit;    // unit of its value
    const char* gives;   // a row of the camera, "camera matrix"; empty: known, but not used
    const char* how;     // conversion, or why it is not used; empty: as it is
};
// The attributes by the values that they give, as a table in Markdown.
std::string camera_attributes_as_markdown();

// An attribute of the table that was found in a file.
struct FoundAttribute {
    const CameraAttribute* row = nullptr;
    std::string text;   // its value
    std::string gives;  // "focal_length_mm = 50"; empty: not used
    std::string why;    // not used
};

struct CameraMetadata {
    Camera camera;
    Origins origins;  // origins of its values: the attributes' names
    std::optional<CameraPose> pose;
    std::vector<FoundAttribute> found;  // in the order of the table
};

// Reads the camera from the color part. Values that are not numbers, not positive, or contradict
// others are not used; `found` has the reason.
CameraMetadata camera_metadata(const ExrPart& part);

}  // namespace postchain::io
