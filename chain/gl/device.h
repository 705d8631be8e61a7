// Properties of the GL context that is current on this thread. It may be this project's own
// (chain/egl) or a host's; nothing here makes, keeps or ends one.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "chain/plan/device_class.h"

namespace postchain::gl {

// Takes one message, without a newline at its end.
using LogCallback = std::function<void(const std::string&)>;

// Limits of the device, as GL states them.
struct Limits {
    int texture_px = 0;               // a side of a texture
    int64_t storage_block_bytes = 0;  // a work list
    int shared_memory_bytes = 0;      // per work group
    int group_invocations = 0;        // threads per work group
    int groups = 0;                   // work groups a side of a dispatch, the least of x and y
    int texture_units = 0;            // in a compute shader
    int image_units = 0;
};

struct Device {
    std::string vendor, renderer, version;  // GL's words
    bool software = false;                  // llvmpipe, softpipe, swrast: GL timers are wrong there
    Limits limits;
    LogCallback log;  // messages of the library other than errors; may be empty

    // Software if it is a software renderer with units enough to read textures as images
    // (image_reads.h).
    DeviceClass device_class() const;
};

// Describes the current context, which must be OpenGL 4.5 core or later.
Device describe_current(LogCallback log = {});

}  // namespace postchain::gl
