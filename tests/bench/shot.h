// Frames on disk as input of a benchmark.
#pragma once

#include <string>
#include <vector>

#include "chain/frame/frame.h"
#include "tests/bench/arguments.h"

namespace postchain::bench {

struct Frame {
    FrameDescription description;
    SharedPlanes planes;
};

struct Shot {
    std::string pattern, frames, camera;  // as typed; may be empty
};

// Removes --input, --frames and --camera.
Shot take_shot(Arguments& arguments);

// The planes of `wanted` that the frames and their neighbors have; ends the program on an error.
std::vector<Frame> read_shot(const Shot& shot, RoleSet wanted);

}  // namespace postchain::bench
