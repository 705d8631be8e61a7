// Predicts a frame's cost for a farm's scheduler: memory from its header and plan, time from the
// sidecar of a frame filtered on a similar machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/plan.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

struct Memory {
    uint64_t frame = 0;     // bytes of one frame in flight and its neighbors
    uint64_t textures = 0;  // peak over the steps, with imported planes and outputs
    // Upper limit of `run` on this sequence, with the software renderer's textures.
    uint64_t process = 0;
};

// `frames`: number in the sequence or part; at most kFramesInFlight are in memory.
Memory memory_of(const FrameInputs& inputs, const Plan& plan, size_t frames);

// Plan and times of a frame that was filtered.
struct Calibration {
    struct Pass {
        std::string name;
        double ms = 0;
        uint64_t taps = 0;
    };
    std::string path;
    uint64_t pixels = 0;
    double read_ms = 0;  // with conversion
    double write_ms = 0;
    std::vector<Pass> passes;  // passes of its chain that ran
};

// Errors (input): unreadable, or not the sidecar of a written frame.
Result<Calibration> read_calibration(const std::string& path);

// Seconds of one frame by itself, without compiling programs. Neighboring frames overlap, so a run
// takes less per frame.
struct Seconds {
    double read = 0, filter = 0, write = 0;
    double all() const { return read + filter + write; }
};

// Scales the calibration's times: reading and writing by pixels, each pass by its texture fetches.
// Empty if the plan runs a pass that the calibration did not.
std::optional<Seconds> seconds_of(const Plan& plan, const Calibration& calibration);

io::Json estimate_json(const Memory& memory, const std::optional<Seconds>& seconds);
std::string estimate_text(const Memory& memory, const std::optional<Seconds>& seconds);

}  // namespace postchain::sequence
