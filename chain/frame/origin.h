// The origin of a value, and the values that a pass uses on a frame, for the record.
#pragma once

#include <map>
#include <string>

#include "chain/base/parameter.h"
#include "chain/frame/role.h"

namespace postchain {

// "chain file", "chain.yaml:3". A value that was not stated has no `where`.
struct Origin {
    std::string from;   // one of kFrom...
    std::string where;  // file and line, option or attribute
    bool operator==(const Origin&) const = default;
};
inline constexpr const char* kFromOption = "option";
inline constexpr const char* kFromChain = "chain file";
inline constexpr const char* kFromCameraFile = "camera file";
inline constexpr const char* kFromMetadata = "metadata";
inline constexpr const char* kFromDefault = "default";
inline constexpr const char* kFromFrame = "frame";  // found in its pixels, or follows from others

// By the value's name: "f_stop", in a chain "camera.f_stop" and "passes[0].samples".
using Origins = std::map<std::string, Origin>;

// A value as a pass uses it.
struct UsedValue {
    enum class Of { pass, camera, standard, frame };  // standard: not stated
    std::string key;
    ParameterValue value;
    std::string unit;
    Of of = Of::standard;
    std::string row = key;  // the parameter that gave it, of the pass or of the camera
};

// A limit of a pass that the displacements of some pixels exceed: these are clamped to it.
struct ExceededLimit {
    std::string parameter;  // the limit's
    std::string what;       // "half-length of a streak"
    double limit_px = 0;
    double largest_px = 0;  // unclamped
    RoleSet planes;  // a pixel exceeds it if its value in one of them, of motion the length, is
    double low = 0, high = 0;  // below `low` or above `high`
};

}  // namespace postchain
